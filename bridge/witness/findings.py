"""Findings of the witness: stops with their times, alarms, and the return of its sight."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Cause(StrEnum):
    """Reason why a drive stopped."""

    CONTROLLER = "controller silent"
    COMMAND = "stop commanded"
    BRIDGE = "bridge silent"
    DRIVE = "drive by itself"


class AlarmKind(StrEnum):
    """Kind of alarm."""

    LATE = "late"
    RUNS_ON = "runs on"
    IGNORED = "stop ignored"
    UNTOLD = "enabled untold"
    INTRUDER = "intruder"
    UNHEARD = "unheard"
    BLIND = "blind"


@dataclass(frozen=True, slots=True)
class Stop:
    """One stop of a drive, or of a node's outputs that became safe. ``bus_ms``: from the owner's last
    telegram to the first RPDO that stops, None where the silence is not what stopped it; ``drive_ms``: from
    the cause of the stop to the drive's report of it, None without a report."""

    drive: str
    cause: Cause
    time: float
    bus_ms: int | None
    bus_bound_ms: int | None
    drive_ms: int | None
    drive_bound_ms: int | None

    @property
    def is_in_time(self) -> bool:
        pairs = ((self.bus_ms, self.bus_bound_ms), (self.drive_ms, self.drive_bound_ms))
        return all(ms is None or bound is None or ms <= bound for ms, bound in pairs)


@dataclass(frozen=True, slots=True)
class Alarm:
    """Alarm: a promise is broken, or a foreign sender is on the bus. ``source`` is a drive, a node with
    outputs, a bus."""

    source: str
    kind: AlarmKind
    time: float
    message: str


@dataclass(frozen=True, slots=True)
class Sight:
    """End of a blindness that was reported."""

    source: str
    time: float
    message: str


Finding = Stop | Alarm | Sight
