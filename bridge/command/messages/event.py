"""Events that people want to know of: trips, lost nodes, refused writes."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from bridge.base.ratelimit import PerSecond
from bridge.text import Said, render


class EventKind(StrEnum):
    WATCHDOG = "watchdog"
    EMERGENCY = "emergency"
    NODE_LOST = "node_lost"
    NODE_BACK = "node_back"
    REFUSED = "refused"
    OWNER = "owner"
    BUS = "bus"
    CONFIGURATION = "configuration"
    FRONT = "front"
    INTRUDER = "intruder"
    CAUSE = "cause"
    """Common cause of several other events."""


@dataclass(frozen=True, slots=True)
class Event:
    """One event. ``source`` is a drive, a node or a bus by its name in the site; ``severity`` is that of OPC
    UA (1 … 1000, Part 5 §6.4.2); ``time`` is monotonic seconds. ``because`` is the cause, as a phrase; empty
    where none is known."""

    time: float
    kind: EventKind
    source: str
    severity: int
    said: Said
    because: Said = ""

    @property
    def message(self) -> str:
        """The message in English."""
        return render(self.said)

    @property
    def cause(self) -> str:
        """The cause in English; empty where none is known."""
        return render(self.because)

    @property
    def text(self) -> str:
        """The message with its cause, in English."""
        return f"{self.message} (because: {self.cause})" if self.because else self.message


class EventQueue:
    """Events of nodes and buses, in order, until the plant passes them on: no listener runs while frames are
    taken in or words are decided on."""

    def __init__(self) -> None:
        self.waiting: list[Event] = []

    def report(self, event: Event) -> None:
        self.waiting.append(event)

    def take(self) -> list[Event]:
        """The events since the last call."""
        taken, self.waiting = self.waiting, []
        return taken


REPEATING: Final = frozenset(
    (EventKind.REFUSED, EventKind.EMERGENCY, EventKind.CONFIGURATION, EventKind.INTRUDER)
)
"""Kinds that an outsider can trigger at will; rate-limited."""
_MOST_A_SECOND: Final = 10


class EventGate:
    """Limit that keeps a client which is refused again and again, or a babbling node, from flooding the
    listeners. Events left out are still counted where they happen."""

    def __init__(self) -> None:
        self._limits: dict[tuple[str, EventKind], PerSecond] = {}

    def admits(self, event: Event) -> bool:
        """Whether this event is passed on: of kinds that repeat, at most ten a second of each source."""
        if event.kind not in REPEATING:
            return True
        limit = self._limits.setdefault((event.source, event.kind), PerSecond(_MOST_A_SECOND))
        return limit.allows(event.time)
