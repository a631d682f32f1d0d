"""Messages of CANopen itself in a DBC file: NMT, SYNC, heartbeats and emergencies, without overlap."""

from __future__ import annotations

import pytest

from bridge.config import BusTable
from bridge.dbc.model import Message
from bridge.dbc.protocol_messages import bus_messages


def bus(**given: object) -> dict[str, Message]:
    table = BusTable.model_validate({"name": "can0", "interface": "virtual", **given})
    return {message.name: message for message in bus_messages(table)}


def test_nmt_has_its_commands_and_nodes() -> None:
    """CiA 301 §7.2.8.2.1."""
    nmt = bus()["NMT"]
    assert (nmt.cob_id, nmt.length) == (0x000, 2)
    command, node = nmt.signals
    assert command.choices == {
        1: "start",
        2: "stop",
        128: "enter pre operational",
        129: "reset node",
        130: "reset communication",
    }
    assert (node.start, node.low, node.high) == (8, 0, 127)


@pytest.mark.parametrize(("counter", "length"), [(0, 0), (240, 1)])
def test_sync_has_its_period_and_its_counter(counter: int, length: int) -> None:
    sync = bus(sync_period_ms=20, sync_counter=counter)["SYNC"]
    assert (sync.cob_id, sync.length, sync.cycle_ms) == (0x080, length, 20)
    assert [(one.low, one.high) for one in sync.signals] == ([(1, counter)] if counter else [])


def test_without_sync_or_a_heartbeat_of_ours_there_is_none() -> None:
    assert "SYNC" not in bus(sync_period_ms=0)
    silent = {message.cob_id for message in bus(heartbeat_ms=0, deadman_ms=500).values()}
    assert 0x77F not in silent
    assert 0x77F in {message.cob_id for message in bus(heartbeat_ms=100).values()}
