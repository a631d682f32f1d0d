"""Power, time and frames of any simulated node."""

from __future__ import annotations

import pytest

from bridge.canopen.frame import ERROR, EXTENDED, Frame
from bridge.sim.catalogue import simulate_node
from bridge.sim.core.simulated_device import SimulatedDevice

FAMILIES = ("nord/sk-tu4-cao", "lenze/8400-motec", "stoeber/5000", "cia402/velocity")
READ = Frame(0x605, bytes.fromhex("4000100000000000"))


@pytest.fixture(params=FAMILIES)
def node(request: pytest.FixtureRequest) -> SimulatedDevice:
    made = simulate_node(request.param, 5, {})
    made.start(1.0)
    made.on_time(1.0)
    return made


def sent(node: SimulatedDevice, frame: Frame, now: float) -> list[int]:
    node.take_frames()
    node.on_frame(frame, now)
    return [one.can_id for one in node.take_frames()]


def test_it_says_hello_and_answers(node: SimulatedDevice) -> None:
    assert Frame(0x705, b"\0") in node.take_frames()
    assert 0x585 in sent(node, READ, 2.0)
    assert {0x000, 0x605} <= node.heard
    for flag in (EXTENDED, ERROR):
        assert 0x585 not in sent(node, Frame(READ.can_id | flag, READ.data), 3.0)


def test_silent_it_goes_on_and_without_power_it_does_nothing(node: SimulatedDevice) -> None:
    node.silence()
    assert sent(node, READ, 2.0) == []
    node.speak()
    assert 0x585 in sent(node, READ, 3.0)
    node.power_off()
    assert node.next_deadline() is not None, "what is injected is due at once"
    node.on_time(4.0)
    assert (sent(node, READ, 5.0), node.next_deadline(), node.powered) == ([], None, False)


def test_a_power_cycle_brings_the_boot_up_message(node: SimulatedDevice) -> None:
    node.take_frames()
    node.power_cycle()
    node.on_time(2.0)
    assert [frame for frame in node.take_frames() if frame.can_id == 0x705][:1] == [Frame(0x705, b"\0")]


def test_a_time_before_the_last_one_moves_nothing_back(node: SimulatedDevice) -> None:
    node.on_time(10.0)
    node.on_frame(READ, 9.0)
    deadline = node.next_deadline()
    assert deadline is None or deadline > 10.0
