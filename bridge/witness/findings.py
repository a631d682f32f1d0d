"""What the witness finds: stops with their times, alarms, and that it sees again."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Cause(StrEnum):
    """Why a drive stopped."""

    CONTROLLER = "controller silent"
    COMMAND = "stop commanded"
    BRIDGE = "bridge silent"
    DRIVE = "drive by itself"


class Kind(StrEnum):
    """What an alarm is about."""

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
    telegram to the first RPDO that stops, None where that is not what stopped it; ``drive_ms``: from what
    stopped it to the drive that says so, None where nothing says so."""

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
    """A promise is broken, or somebody else is there. ``source`` is a drive, a node with outputs, a bus."""

    source: str
    kind: Kind
    time: float
    message: str


@dataclass(frozen=True, slots=True)
class Sight:
    """What was said to be blind sees again."""

    source: str
    time: float
    message: str


Finding = Stop | Alarm | Sight
