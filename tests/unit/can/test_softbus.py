"""Buses whose bursts a timer of ours sends: what comes back, what is overheard, and what is counted."""

from __future__ import annotations

import pytest

from bridge.can.burstend import Burst
from bridge.can.virtual import VirtualBus, VirtualWire
from bridge.canopen.frame import Frame

RPDO = Frame(0x205, b"\x7f\x04")


class Case:
    def __init__(self) -> None:
        self.wire = VirtualWire()
        self.ours, self.theirs = self.wire.end("ours"), self.wire.end("theirs")

    def others_see(self) -> list[tuple[int, float]]:
        return [(frame.can_id, frame.time) for frame in self.theirs.drain(99.0)]

    def bursts(self, now: float, total: int = 10) -> None:
        self.ours.burst(Burst((RPDO,), 0.01, total), now)


@pytest.fixture
async def case() -> Case:
    case = Case()
    for end in (case.ours, case.theirs):
        end.open(lambda: None)
    return case


def runs(bus: VirtualBus, end: float) -> None:
    while (due := bus.next_deadline()) is not None and due <= end:
        bus.on_time(due)


async def test_a_burst_is_sent_so_many_times_and_then_not(case: Case) -> None:
    case.bursts(10.0, total=3)
    runs(case.ours, 11.0)
    assert len(case.others_see()) == 3
    assert case.ours.next_deadline() is None


async def test_one_that_is_ended_sends_nothing_more(case: Case) -> None:
    case.bursts(10.0)
    case.others_see()
    case.ours.end_burst(0x205)
    runs(case.ours, 11.0)
    assert case.others_see() == []


async def test_its_frames_come_back_where_their_identifier_is_accepted(case: Case) -> None:
    case.ours.accept([0x185])
    case.bursts(10.0, total=1)
    assert case.ours.drain(10.1) == []
    case.ours.end_burst(0x205)
    case.ours.accept([0x185, 0x205])
    case.bursts(11.0, total=1)
    assert [(frame.can_id, frame.time) for frame in case.ours.drain(11.1)] == [(0x205, 11.0)]


async def test_all_that_passes_is_overheard_while_somebody_wants_it(case: Case) -> None:
    case.ours.send(RPDO, 10.0, 11.0)
    assert case.ours.take_overheard() == []
    case.ours.overhear(is_on=True)
    case.ours.send(RPDO, 10.1, 11.0)
    case.theirs.send(Frame(0x185), 10.2, 11.0)
    assert [frame.can_id for frame in case.ours.take_overheard()] == [0x205, 0x185]
    assert case.ours.take_overheard() == []
    case.ours.overhear(is_on=False)
    case.ours.send(RPDO, 10.3, 11.0)
    assert case.ours.take_overheard() == []


async def test_who_takes_nothing_for_long_loses_the_oldest(case: Case) -> None:
    case.ours.overhear(is_on=True)
    for number in range(16_400):
        case.ours.send(Frame(0x205, number.to_bytes(2, "little")), 10.0, 11.0)
    frames = case.ours.take_overheard()
    assert len(frames) == 16_384
    assert frames[0].data == (16).to_bytes(2, "little")


async def test_bits_are_counted_whoever_sends(case: Case) -> None:
    before = case.ours.status.bits
    case.ours.send(RPDO, 10.0, 11.0)
    own = case.ours.status.bits
    case.theirs.send(RPDO, 10.0, 11.0)
    assert before < own < case.ours.status.bits
    assert 63 <= own - before <= 80, "47 + 16 bits, and stuff bits"
