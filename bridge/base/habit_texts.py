"""Habits of devices as texts: ``canopen`` says them in English."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from bridge.canopen.habits import HabitCount, Odd
from bridge.text import Text

_ONE: Final[Mapping[Odd, Callable[[int, int, int], Text]]] = {
    Odd.SDO_LENGTH: lambda count, has, due: Text.of("habit.sdo_length", count=count, has=has, due=due),
    Odd.HEARTBEAT_LENGTH: lambda count, has, due: Text.of("habit.heartbeat", count=count, has=has, due=due),
    Odd.EMCY_LENGTH: lambda count, has, due: Text.of("habit.emergency", count=count, has=has, due=due),
    Odd.TPDO_LENGTH: lambda count, has, due: Text.of("habit.tpdo", count=count, has=has, due=due),
    Odd.TPDO_LENGTH_BY_FILE: lambda count, has, due: Text.of(
        "habit.tpdo_by_file", count=count, has=has, due=due
    ),
    Odd.SDO_LATE: lambda count, has, due: Text.of("habit.sdo_late", count=count, has=has, due=due),
}
_MANY: Final[Mapping[Odd, Callable[[int, int, int], Text]]] = {
    Odd.SDO_LENGTH: lambda count, has, due: Text.of("habit.sdo_lengths", count=count, has=has, due=due),
    Odd.HEARTBEAT_LENGTH: lambda count, has, due: Text.of("habit.heartbeats", count=count, has=has, due=due),
    Odd.EMCY_LENGTH: lambda count, has, due: Text.of("habit.emergencies", count=count, has=has, due=due),
    Odd.TPDO_LENGTH: lambda count, has, due: Text.of("habit.tpdos", count=count, has=has, due=due),
    Odd.TPDO_LENGTH_BY_FILE: lambda count, has, due: Text.of(
        "habit.tpdos_by_file", count=count, has=has, due=due
    ),
    Odd.SDO_LATE: lambda count, has, due: Text.of("habit.sdo_late_often", count=count, has=has, due=due),
}


def text_of_habit(shown: HabitCount) -> Text:
    """Number of times it has shown, and what is right."""
    texts = _ONE if shown.count == 1 else _MANY
    return texts[shown.odd](shown.count, shown.has, shown.due)
