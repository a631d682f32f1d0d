"""Bursts that a timer of ours sends: turns of several frames, steps, and their end."""

from __future__ import annotations

from bridge.can.burstend import Burst
from bridge.can.softbursts import SoftBursts
from bridge.canopen.frame import Frame


def test_a_burst_of_several_frames_takes_turns_and_keeps_its_place_when_renewed() -> None:
    beats = SoftBursts()
    frames = tuple(Frame(0x80, bytes((number,))) for number in range(1, 5))
    first = beats.start(Burst(frames, 0.01, 10), 0.0, at_once=False)
    sent = [first.data[0]] if first else []
    for step in range(1, 25):
        now = step * 0.01 + 1e-6
        if step % 4 == 0:
            assert beats.start(Burst(frames, 0.01, 10), now - 0.005, at_once=False) is None
        sent += [frame.data[0] for frame in beats.due(now)]
    assert sent == [number % 4 + 1 for number in range(len(sent))]
    assert len(sent) == 25


def test_bursts_in_step_are_due_together_and_none_sooner_than_at_a_multiple_of_its_period() -> None:
    beats = SoftBursts(in_step=True)
    starts = {0x205: 7.0031, 0x206: 7.0048, 0x080: 7.0}
    for can_id, start in starts.items():
        assert beats.start(Burst((Frame(can_id),), 0.01, 300), start, at_once=False) is not None
    wakes: list[float] = []
    while (due := beats.next_deadline()) is not None and len(wakes) < 200:
        wakes.append(due)
        assert [frame.can_id for frame in beats.due(due)] == [0x205, 0x206, 0x080]
    assert wakes == [step * 0.01 for step in range(701, 901)]


def test_a_burst_in_step_ends_no_later_than_one_that_is_not() -> None:
    ends: list[float] = []
    for in_step in (False, True):
        beats = SoftBursts(in_step=in_step)
        beats.start(Burst((Frame(0x205),), 0.01, 10), 7.0031, at_once=False)
        end = 7.0031
        for millisecond in range(7004, 7200):
            end = millisecond / 1000 if beats.due(millisecond / 1000) else end
        ends.append(end)
    assert ends[0] - 0.01 <= ends[1] <= ends[0]
