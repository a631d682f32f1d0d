"""Effects of drives and outputs, collected for their plant."""

from __future__ import annotations

from bridge.command import EventQueue
from bridge.command.effects import Effects


def test_of_several_trips_the_first_that_was_due_counts() -> None:
    effects = Effects(EventQueue())
    for due in (3.0, 2.0, 4.0):
        effects.tripped(due)
    assert effects.stop_due == 2.0
