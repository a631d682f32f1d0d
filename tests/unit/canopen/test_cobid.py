"""Identifiers of CiA 301 §7.3.5 against canopen's, one by one."""

from __future__ import annotations

import canopen
from canopen.pdo.base import PDO_NOT_VALID, RTR_NOT_ALLOWED
from canopen.sync import SyncProducer

from bridge.canopen import cobid

NODE = 5
FIXED = {0x000, 0x080, 0x100, *range(0x580, 0x680), *range(0x6E0, 0x800)}
"""NMT, SYNC, TIME, SDOs, error control, and what is reserved beside them (CiA 301 §7.3.5)."""
RESERVED = {*range(0x001, 0x080), *range(0x101, 0x181)}


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
