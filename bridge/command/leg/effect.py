"""Effects of a step of the leg beside the words that are sent."""

from __future__ import annotations

from dataclasses import dataclass

from bridge.command.messages.event import EventKind
from bridge.command.messages.request import Identity, Outcome
from bridge.text import Text


@dataclass(frozen=True, slots=True)
class Answer:
    """Outcome of the request that was the event."""

    outcome: Outcome
    is_refused: bool = False


@dataclass(frozen=True, slots=True)
class StartBegun:
    """The request was a start: its outcome comes with ``StartEnded``."""


@dataclass(frozen=True, slots=True)
class StartEnded:
    outcome: Outcome


@dataclass(frozen=True, slots=True)
class Heard:
    """A valid telegram of the owner, which has brought these commands."""

    names: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Tripped:
    """The watchdog has tripped; it was due at this time. ``who`` was silent for ``timeout_ms``."""

    due: float
    who: Identity | None
    timeout_ms: int


@dataclass(frozen=True, slots=True)
class LetGo:
    """A stop by a command: nothing is held any more."""


@dataclass(frozen=True, slots=True)
class Ignored:
    """A silent controller that the site file has ignored."""


@dataclass(frozen=True, slots=True)
class Tell:
    """An event for people."""

    kind: EventKind
    severity: int
    said: Text


Effect = Answer | StartBegun | StartEnded | Heard | Tripped | LetGo | Ignored | Tell
