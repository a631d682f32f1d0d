"""Events of the leg: requests, reports of the drive, changes of the way to it, time."""

from __future__ import annotations

from dataclasses import dataclass

from bridge.command.leg.state import Way
from bridge.command.messages.request import Identity, Request
from bridge.drive import DriveState
from bridge.text import Words


@dataclass(frozen=True, slots=True)
class StatusReport:
    """A report of the drive's status word. ``is_acknowledged``: with the bit "set-point acknowledge";
    ``fault`` is empty but for a fault."""

    state: DriveState
    is_acknowledged: bool
    fault: Words


@dataclass(frozen=True, slots=True)
class ActualWords:
    """The drive's actual words, the status word first."""

    words: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Time:
    """The bus has been drained: all that is due is to happen. ``way`` is the way to the drive then."""

    way: Way | None = None


@dataclass(frozen=True, slots=True)
class NodeBack:
    """The node is operational anew. It may have been switched off and on: what it was told before does not
    count."""


@dataclass(frozen=True, slots=True)
class StartAnew:
    """The bus was gone, or the node was stopped or has restarted: whatever the drive was told does not count
    any more, not even where communication errors are ignored."""


@dataclass(frozen=True, slots=True)
class BridgeGap:
    """The bridge itself was not there for longer than the dead-man time."""


@dataclass(frozen=True, slots=True)
class StopsOnSilence:
    """Whether the drive stops by itself when it gets no RPDO any more."""

    stops: bool


@dataclass(frozen=True, slots=True)
class Connection:
    """A connection of ``identity`` has begun or ended. ``has_others``: the same user has other ones."""

    identity: Identity
    is_there: bool
    has_others: bool = False


Event = (
    Request
    | Time
    | StatusReport
    | ActualWords
    | Way
    | NodeBack
    | StartAnew
    | BridgeGap
    | StopsOnSilence
    | Connection
)
