"""NMT commands and error control of a simulated slave."""

from __future__ import annotations

import pytest

from bridge.sim.core.communication_settings import CobId, CommunicationSettings
from bridge.sim.core.nmt_slave import CommandSpecifier, SlaveErrorControl, SlaveState, nmt_command_for
from bridge.sim.core.store import Store


def control(**settings: int) -> SlaveErrorControl:
    made = SlaveErrorControl(Store(lambda: CommunicationSettings(emcy=CobId(0x85), sdo=[], **settings)))
    made.boot()
    return made


@pytest.mark.parametrize(
    ("data", "command"),
    [
        ("0105", CommandSpecifier.START),
        ("8100", CommandSpecifier.RESET_NODE),
        ("0106", None),
        ("0305", None),
        ("01", None),
        ("010500", None),
    ],
)
def test_a_command_is_for_this_node_or_for_all(data: str, command: CommandSpecifier | None) -> None:
    assert nmt_command_for(5, bytes.fromhex(data)) is command


def test_guarding_toggles_and_watches_the_master_from_the_first_request_on() -> None:
    made = control(guard_time_ms=100, life_time_factor=3)
    assert made.next_deadline() is None
    answers = [made.on_guard_request(SlaveState.OPERATIONAL, now) for now in (1.0, 1.1, 1.2)]
    assert answers == [b"\x05", b"\x85", b"\x05"]
    assert made.next_deadline() == pytest.approx(1.5)
    made.boot()
    assert made.on_guard_request(SlaveState.PRE_OPERATIONAL, 2.0) == b"\x7f"


def test_with_a_heartbeat_there_is_no_guarding() -> None:
    made = control(heartbeat_ms=200, guard_time_ms=100, life_time_factor=3)
    assert made.on_guard_request(SlaveState.OPERATIONAL, 1.0) is None
    assert not made.heartbeat_due(1.0)
    assert made.next_deadline() == pytest.approx(1.2)
    assert made.heartbeat_due(1.2)
