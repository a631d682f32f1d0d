"""Frames that do not fit what their node says it sends: counted, told, and noted by their length."""

from __future__ import annotations

import pytest

from bridge.canopen.frame import Frame
from bridge.canopen.habits import HabitCounter, Odd
from bridge.command import EventQueue
from bridge.node.process.unfit_frames import UnfitFrames
from bridge.text import Text


class Case:
    def __init__(self) -> None:
        self.events, self.habits = EventQueue(), HabitCounter()
        self.unfit = UnfitFrames("conveyor", self.events, self.habits, 0x085)
        self.unfit.mapped_bytes = {0x185: 8}

    def rejects(self, can_id: int, data: bytes) -> str:
        self.unfit.reject(Frame(can_id, data, 1.0), Text.of("frame.bytes_mapped", length=8))
        return self.events.waiting[-1].message


def test_each_is_counted_and_told_with_the_reason() -> None:
    case = Case()
    assert case.rejects(0x185, b"\1").endswith("8 bytes are mapped")
    case.rejects(0x705, b"")
    assert case.unfit.count == 2
    assert {event.source for event in case.events.waiting} == {"conveyor"}


@pytest.mark.parametrize(
    ("can_id", "data", "odd"),
    [
        (0x185, bytes(7), Odd.TPDO_LENGTH),
        (0x185, bytes(8), None),
        (0x085, bytes(7), Odd.EMCY_LENGTH),
        (0x085, bytes(8), None),
        (0x705, bytes(7), None),
    ],
)
def test_a_length_that_is_not_the_standards_is_noted(can_id: int, data: bytes, odd: Odd | None) -> None:
    case = Case()
    for _ in range(3):
        case.rejects(can_id, data)
    assert [habit.odd for habit in case.habits.habits()] == ([] if odd is None else [odd])
