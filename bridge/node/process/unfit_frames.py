"""Frames of a node that do not fit what it says it sends. They change nothing. Sans-IO."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from bridge.canopen.frame import Frame
from bridge.canopen.habits import HabitCounter, Odd
from bridge.command import Event, EventKind, EventQueue
from bridge.text import Text

_EMCY_BYTES: Final = 8


class UnfitFrames:
    """Frames of one node, called ``name``, that do not fit: counted and reported. Odd lengths are noted in
    ``habits``."""

    def __init__(self, name: str, events: EventQueue, habits: HabitCounter, emcy_id: int | None) -> None:
        self._name = name
        self._events = events
        self._habits = habits
        self.emcy_id = emcy_id
        """COB-ID of the node's emergency messages; None where it has none."""
        self.mapped_bytes: Mapping[int, int] = {}
        """Length of each TPDO in bytes, by COB-ID."""
        self.count = 0

    def reject(self, frame: Frame, why: Text) -> None:
        """Count and report a frame, at most once a minute."""
        self.count += 1
        due = self.mapped_bytes.get(frame.can_id, len(frame.data))
        if due != len(frame.data):
            self._habits.note(Odd.TPDO_LENGTH, len(frame.data), due)
        elif frame.can_id == self.emcy_id and len(frame.data) != _EMCY_BYTES:
            self._habits.note(Odd.EMCY_LENGTH, len(frame.data), _EMCY_BYTES)
        said = Text.of("node.frame_does_not_fit", frame=repr(frame), why=why)
        self._events.report(Event(frame.time, EventKind.CONFIGURATION, self._name, 300, said))
