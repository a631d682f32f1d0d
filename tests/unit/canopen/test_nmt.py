"""NMT states and commands (CiA 301 §7.2.8) against canopen's tables, and in words."""

from __future__ import annotations

import pytest
from canopen.nmt import NMT_COMMANDS, NMT_STATES

from bridge.canopen import nmt
from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.catalogue.codes import NMT_STATES as POINT_CODES


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
