"""A bus that can be muted: what is sent before and after, whole or in part, and when the last was out."""

from __future__ import annotations

import pytest

from bridge.bustools.muted_bus import MutableBus
from bridge.can.burstend import Burst
from bridge.canopen.frame import Frame
from tests.support.bench import ClockBus

RPDO, SYNC = Frame(0x205, b"\x7f\x04"), Frame(0x080)


class Case:
    def __init__(self) -> None:
        self.sent: list[Frame] = []
        self.heard: list[Frame] = []
        self.under = ClockBus(self.sent.append)
        self.bus = MutableBus(self.under, self.heard.append)

    def sends(self, frame: Frame, now: float) -> list[int]:
        """The identifiers that go out."""
        self.sent.clear()
        self.bus.send(frame, now, now + 1)
        return [one.can_id for one in self.sent]

    def bursts(self, frame: Frame, now: float) -> None:
        self.bus.burst(Burst((frame,), 0.01, 10), now)


@pytest.fixture
def case() -> Case:
    return Case()


def test_before_it_is_muted_everything_goes_out(case: Case) -> None:
    assert case.sends(RPDO, 10.0) == [0x205]
    assert not case.bus.is_muted
    assert case.bus.name == "can0"
    assert case.bus.status is case.under.status


def test_muted_nothing_goes_out_until_it_is_not(case: Case) -> None:
    case.bus.mute()
    assert case.sends(RPDO, 10.0) == case.sends(SYNC, 10.0) == []
    case.bus.unmute()
    assert case.sends(RPDO, 10.1) == [0x205]


def test_some_identifiers_may_be_muted_alone(case: Case) -> None:
    case.bus.mute(frozenset({0x205}))
    assert case.sends(RPDO, 10.0) == []
    assert case.sends(SYNC, 10.0) == [0x080]


def test_the_last_of_what_is_muted_is_known(case: Case) -> None:
    assert case.bus.last_sent == float("-inf")
    case.sends(RPDO, 10.0)
    case.sends(SYNC, 10.5)
    case.bus.mute(frozenset({0x205}))
    assert case.bus.last_sent == 10.0
    case.bus.mute()
    assert case.bus.last_sent == 10.5


def test_bursts_end_with_the_sending_and_none_begins(case: Case) -> None:
    case.bursts(RPDO, 10.0)
    assert case.under.next_deadline() is not None
    case.bus.mute()
    assert case.under.next_deadline() is None
    case.bursts(SYNC, 10.1)
    assert case.under.next_deadline() is None


def test_frames_of_a_burst_come_back_and_are_not_taken_for_others(case: Case) -> None:
    case.bus.accept([0x185])
    case.bursts(RPDO, 10.0)
    assert case.under.accepted == {0x185, 0x205}
    case.under.inbox = [Frame(0x205, RPDO.data, 10.02), Frame(0x185, b"", 10.03)]
    assert len(case.bus.drain(10.1)) == 2
    assert [frame.can_id for frame in case.heard] == [0x185]
    assert case.bus.last_sent == 10.02
