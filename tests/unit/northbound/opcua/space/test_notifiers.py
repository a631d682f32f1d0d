"""Objects that tell an event."""

from __future__ import annotations

import pytest
from asyncua import ua

from bridge.northbound.opcua.space.notifiers import Notifiers

NAMES = ("bridge", "bus/can0", "conveyor", "conveyor/fu1")
NOTIFIERS = Notifiers({name: ua.NodeId(name, 2) for name in NAMES})
SERVER = ua.NodeId(ua.ObjectIds.Server)


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("conveyor/fu1", ["conveyor/fu1", "conveyor"]),
        ("conveyor", ["conveyor"]),
        ("can0", ["bus/can0"]),
        ("somebody", ["bridge"]),
        ("gone/fu1", ["bridge"]),
    ],
)
def test_an_event_is_told_by_the_server_and_by_what_it_is_about(source: str, expected: list[str]) -> None:
    assert NOTIFIERS.emitters(source) == [SERVER, *(ua.NodeId(name, 2) for name in expected)]
    assert NOTIFIERS.source(source) == ua.NodeId(expected[0], 2)


def test_all_that_tell_events() -> None:
    assert NOTIFIERS.all == [SERVER, *(ua.NodeId(name, 2) for name in NAMES)]
