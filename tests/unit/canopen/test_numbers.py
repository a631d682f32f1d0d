"""Numbers of CiA 301 and of the kernel that nothing computes, held against what others have of them."""

from __future__ import annotations

import socket

import canopen
import pytest
from canopen.nmt import NMT_COMMANDS, NMT_STATES
from canopen.pdo.base import PDO_NOT_VALID, RTR_NOT_ALLOWED
from canopen.sdo.exceptions import SdoAbortedError
from canopen.sync import SyncProducer

from bridge.canopen import abort, cobid, frame, nmt
from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.command.points import NMT_STATES as POINT_CODES

NODE = 5
FIXED = {0x000, 0x080, 0x100, *range(0x580, 0x680), *range(0x6E0, 0x800)}
"""NMT, SYNC, TIME, SDOs, error control, and what is reserved beside them (CiA 301 §7.3.5)."""
RESERVED = {*range(0x001, 0x080), *range(0x101, 0x181)}


def test_the_abort_codes() -> None:
    assert set(abort.TEXTS) == set(SdoAbortedError.CODES)
    assert len(set(abort.TEXTS.values())) == len(abort.TEXTS)
    assert abort.text(0x1234_5678) == "unknown abort code"


def test_what_the_abort_codes_are_for() -> None:
    assert {abort.text(code) for code in abort.TRANSIENT} == {
        "toggle bit not alternated",
        "SDO protocol timed out",
        "invalid block size",
        "invalid sequence number",
        "CRC error",
        "data type does not match, length of service parameter too high",
        "data type does not match, length of service parameter too low",
    }
    assert abort.text(abort.UNKNOWN_COMMAND) == "client/server command specifier not valid or unknown"
    assert abort.text(abort.OUT_OF_MEMORY) == "out of memory"
    assert abort.text(abort.BUSY) == "resource not available: SDO connection"
    assert abort.text(abort.GENERAL) == "general error"


def test_the_identifiers_of_the_pre_defined_connection_set() -> None:
    network = canopen.Network()
    node = network.add_node(canopen.LocalNode(NODE, canopen.ObjectDictionary()))
    assert (node.sdo.rx_cobid, node.sdo.tx_cobid) == (cobid.SDO_REQUEST + NODE, cobid.SDO_REPLY + NODE)
    assert cobid.EMCY + NODE == 0x085
    assert cobid.is_for_emcy(cobid.EMCY + NODE)
    assert SyncProducer.cob_id == cobid.SYNC
    assert {cobid.NMT, cobid.ERROR_CONTROL + NODE} == {0x000, 0x705}
    assert cobid.TIME == 0x100
    fixed = (cobid.NMT, cobid.SYNC, cobid.TIME, cobid.SDO_REPLY + NODE, cobid.SDO_REQUEST + NODE)
    assert not any(map(cobid.is_for_pdos, fixed))


def test_the_bits_of_an_identifier_in_the_object_dictionary() -> None:
    assert (cobid.PDO_DISABLED, cobid.NO_REMOTE) == (PDO_NOT_VALID, RTR_NOT_ALLOWED)
    assert cobid.PDO_EXTENDED == 1 << 29
    assert cobid.COB_ID_MASK == 0x7FF
    entry = cobid.PDO_DISABLED | cobid.NO_REMOTE | 0x185
    assert cobid.is_for_pdos(entry & cobid.COB_ID_MASK)


def test_which_identifiers_a_pdo_and_an_emergency_message_may_have() -> None:
    for can_id in range(0x800):
        is_free = can_id not in FIXED | RESERVED
        assert cobid.is_for_emcy(can_id) == is_free, hex(can_id)
        assert cobid.is_for_pdos(can_id) == (is_free and can_id > 0x0FF), hex(can_id)


def test_the_flags_of_an_identifier_are_the_kernels() -> None:
    assert frame.EXTENDED == socket.CAN_EFF_FLAG
    assert frame.REMOTE == socket.CAN_RTR_FLAG
    assert frame.ERROR == socket.CAN_ERR_FLAG
    assert frame.STANDARD_MASK == socket.CAN_SFF_MASK
    for flag in (frame.EXTENDED, frame.ERROR):
        assert repr(Frame(0x123 | flag)) == "123#", "a flag is no part of the identifier"


@pytest.mark.parametrize(
    ("one", "text"),
    [
        (Frame(0x085, b"\x00\x81"), "085#0081"),
        (Frame(0x705 | frame.REMOTE, b"\0"), "705#R00"),
        (Frame(0x1234567 | frame.EXTENDED), "1234567#"),
    ],
)
def test_how_a_frame_is_printed(one: Frame, text: str) -> None:
    assert repr(one) == text
    assert one.time == 0.0, "it has not been on the bus"


def test_the_nmt_states() -> None:
    for octet, name in NMT_STATES.items():
        state = nmt.state_of(octet)
        assert nmt.state_of(octet | 0x80) is state, "with the toggle bit of node guarding"
        if name in ("SLEEP", "STANDBY"):  # of an early CiA 301
            assert state is NmtState.UNKNOWN
        else:
            assert state.words == name.lower()
    shown = {(int(state), state.label) for state in map(nmt.state_of, range(0x80))}
    assert shown == {*POINT_CODES}, "what the points say that their numbers mean"


@pytest.mark.parametrize(
    ("command", "name", "text"),
    [
        (NmtCommand.START, "OPERATIONAL", "start for node 5"),
        (NmtCommand.STOP, "STOPPED", "stop for node 5"),
        (NmtCommand.ENTER_PRE_OPERATIONAL, "PRE-OPERATIONAL", "enter pre operational for node 5"),
        (NmtCommand.RESET_NODE, "RESET", "reset node for node 5"),
        (NmtCommand.RESET_COMMUNICATION, "RESET COMMUNICATION", "reset communication for node 5"),
    ],
)
def test_the_nmt_commands(command: NmtCommand, name: str, text: str) -> None:
    sent = nmt.command(command, 5)
    assert sent == Frame(0x000, bytes((NMT_COMMANDS[name], 5)))
    assert nmt.describe(sent.data) == text


@pytest.mark.parametrize(
    ("data", "text"),
    [
        ("0100", "start for all nodes"),
        ("0301", "unknown command 03h for node 1"),
        ("01", "01 (not an NMT command)"),
        ("010203", "010203 (not an NMT command)"),
        ("", "nothing (not an NMT command)"),
    ],
)
def test_nmt_messages_in_words(data: str, text: str) -> None:
    assert nmt.describe(bytes.fromhex(data)) == text
