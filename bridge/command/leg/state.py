"""The state of one drive's leg: frozen, hashable, complete. Times are monotonic seconds."""

from __future__ import annotations

from enum import StrEnum
from typing import Final, NamedTuple

from bridge.command.messages.request import Identity
from bridge.drive import DriveState
from bridge.text import Said


class Stage(StrEnum):
    """Stage of one drive's controller leg."""

    __hash__ = str.__hash__  # in C: it is looked up at every step

    CLOSED = "closed"
    INTERLOCKED = "interlocked"
    READY = "ready"
    ENABLED = "enabled"
    SETTLING = "settling"
    ASKING = "asking"
    PREPARED = "prepared"
    BLIND = "blind"
    BRAKING = "braking"
    LEAVING = "leaving"
    LEADING = "leading"
    RAMPING = "ramping"
    TRIPPED = "tripped"
    SILENCED = "silent"
    BURST = "burst"
    HELD = "held"
    LET_GO = "let go"

    @property
    def is_tripped(self) -> bool:
        return self in ANY_TRIP


MEANING: Final[dict[Stage, str]] = {
    Stage.CLOSED: "node not operational, process data overdue, or a needed position not known",
    Stage.INTERLOCKED: "a stop is in force until the owner sends a word that does not enable, or a start",
    Stage.READY: "the owner's word does not enable; the next one that does is forwarded",
    Stage.ENABLED: "the owner's enabling word is on the bus",
    Stage.SETTLING: "a stop was sent a moment ago: what the drive reports may be older than it",
    Stage.ASKING: "the drive has not reported since its node became operational: the bridge waits for it",
    Stage.PREPARED: "no report for 1 s: the drive gets READY, the word that makes it ready",
    Stage.BLIND: "none for another second: it gets the enabling word, and has to report that it is enabled",
    Stage.BRAKING: "the drive is in its quick stop, and gets 1 s to end it",
    Stage.LEAVING: "the quick stop has not ended by itself: disable voltage ends it",
    Stage.LEADING: "each report of the drive is answered with the next word on the way to enabled",
    Stage.RAMPING: "the reaction's ramp goes on until the drive is at rest, for 10 s at most",
    Stage.TRIPPED: "the reaction's stop is sent",
    Stage.SILENCED: "nothing is sent; disable voltage where that would not stop the drive",
    Stage.BURST: "a stop that somebody has asked for breaks the silence for 0.1 s",
    Stage.HELD: "what was sent before the trip is still sent",
    Stage.LET_GO: "a stop has replaced what was held",
}
NORMAL: Final = (Stage.CLOSED, Stage.INTERLOCKED, Stage.READY, Stage.ENABLED)
"""Neither tripped nor in a start."""

STARTING: Final = frozenset(
    (
        Stage.SETTLING,
        Stage.ASKING,
        Stage.PREPARED,
        Stage.BLIND,
        Stage.BRAKING,
        Stage.LEAVING,
        Stage.LEADING,
    )
)
UNHEARD: Final = frozenset((Stage.ASKING, Stage.PREPARED, Stage.BLIND))
AWAITS_REPORT: Final = UNHEARD | {Stage.SETTLING}
"""Stages in which the next report counts, also where it says nothing new."""
MUTE: Final = frozenset((Stage.SILENCED, Stage.BURST))
"""Silence stops the drive, where it does."""
REACTING: Final = MUTE | {Stage.RAMPING, Stage.TRIPPED}
ANY_TRIP: Final = REACTING | {Stage.HELD, Stage.LET_GO}
WANTS_STOP_WORD: Final = ANY_TRIP | {Stage.CLOSED, Stage.INTERLOCKED}
"""The owner has to send a word that does not enable before one that does goes to the drive."""
BLOCKED: Final = frozenset((Stage.CLOSED, Stage.INTERLOCKED, Stage.LET_GO))
"""A word of the owner's that enables is replaced by the stop that is in force."""


class Motion(StrEnum):
    """Motion of the drive by its reports since the last word that enabled it."""

    __hash__ = str.__hash__

    EXPECTED = "the drive has reported no motion since"
    SEEN = "the drive has reported motion since"
    ENDED = "the drive has reported motion and then that it is not enabled"
    FAULTED = "the drive has reported no motion since, but a fault"


RESTS: Final = frozenset((Motion.ENDED, Motion.FAULTED))
"""The drive stands: a stop that would hold the motor is not needed."""
MAY_FOLLOW_LATE: Final = frozenset((Motion.EXPECTED, Motion.FAULTED))


class RpdoWords(NamedTuple):
    """Words of the RPDO, the control word first; ``silent``: send nothing at all."""

    words: tuple[int, ...]
    silent: bool = False


class Timer(NamedTuple):
    """The watchdog's: ``timeout_ms`` 0 is off. ``is_overdue``: the time-out has passed since the owner's last
    telegram."""

    timeout_ms: int
    heard_at: float | None = None
    deadline: float | None = None
    is_overdue: bool = False


class Owner(NamedTuple):
    """``identity`` is one connection; without its name it is whichever the same user comes by next.

    Where no watchdog says so: ``absent_until``: it has no connection any more; ``stopped_until``: somebody
    else has stopped its drive and it has sent nothing since. From then on it is gone. ``quiet_until``: until
    then it has been heard recently enough to keep out other connections of its own user."""

    identity: Identity | None = None
    lease_s: float = 0.0
    lease_until: float | None = None
    absent_until: float | None = None
    stopped_until: float | None = None
    quiet_until: float | None = None
    alive_until: float | None = None
    """Time until which its telegrams count, where the drive asks for a life sign."""


class Edges(NamedTuple):
    """The acknowledge bit of the owner's last control word, None where it has written none since it owns the
    drive; and whose last telegram had 1 in the acknowledge register, kept after the owner has gone."""

    bit: bool | None = None
    pressed_by: Identity | None = None


class StartProgress(NamedTuple):
    """``word`` is the one that enables. Until ``settles_at`` a report may describe the time before a stop;
    at ``believed_at`` the last report is accepted although no new one came; at ``leaves_at`` a quick stop is
    left; at ``until`` the start is given up."""

    word: int
    until: float
    settles_at: float | None = None
    believed_at: float | None = None
    leaves_at: float | None = None
    is_late: bool = False
    """The drive may still follow the last enabling word, after the stop that came since."""


class Trip(NamedTuple):
    """Times of a trip: when the reaction's ramp ends at the latest, when nothing is sent any
    more, and when a stop that breaks the silence ends."""

    ramps_until: float | None = None
    silent_from: float | None = None
    burst_until: float | None = None
    burst: int | None = None
    """Control word by which the silence was broken."""


class Order(NamedTuple):
    """A position to be handed over with a handshake (``bridge.command.leg.order``)."""

    is_waiting: bool = False
    is_raised: bool = False
    was_commanded: bool = False
    taken: tuple[int, ...] | None = None
    """The words that the drive has, or gets now."""
    deadline: float | None = None
    rises_at: float | None = None


class Way(NamedTuple):
    """Reachability of the drive. ``is_open``: enabling words may go to it as far as its link is
    concerned, ``why`` else not. ``why_unplaced``: why the drive's own position is not known, empty where it
    is. ``is_heard``: it has reported since its node is operational. ``why_unsent``: why no words to it are on
    the bus at all, empty where they are."""

    is_open: bool
    why: Said
    why_unplaced: Said = ""
    is_heard: bool = False
    why_unsent: Said = ""


class LegState(NamedTuple):
    """State of one leg; defaults are those of a bridge that starts: nobody owns the drive."""

    way: Way
    timer: Timer
    word: int
    """The owner's control word, as it would like it, or what was led or stopped with since."""
    sent: RpdoWords
    setpoints: tuple[int, ...]
    rest: tuple[int, ...]
    """The setpoints of a drive that nobody commands."""
    stage: Stage = Stage.CLOSED
    owner: Owner = Owner()
    edges: Edges = Edges()
    is_ours: bool = True
    """``word`` is a stop by the bridge, not the owner's."""
    is_asked: bool = False
    """The stop in force is one that somebody has asked for: it stays as it is."""
    drive: DriveState = DriveState.UNKNOWN
    is_acknowledged: bool = False
    """The drive's status word has the bit "set-point acknowledge"."""
    motion: Motion = Motion.SEEN
    start: StartProgress | None = None
    trip: Trip = Trip()
    order: Order = Order()
    pulse_until: float | None = None
    """Time until which an acknowledge bit of the bridge's own is sent."""
    silence_stops: bool = True
    """The drive stops by itself without its RPDOs. Where it does not, or nobody knows, it gets disable
    voltage in place of silence."""
