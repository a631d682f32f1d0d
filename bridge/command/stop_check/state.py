"""State of the judge of one drive's stops: whether the drive does what the last one asked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, StrEnum
from math import inf
from typing import Final, NamedTuple

from bridge.catalogue.codes import LastStop as LastStop
from bridge.command.stop_check.sums import IgnoredTime, Unfollowed


class Sent(Enum):
    """Meaning of the control word that the bridge has on the bus for the drive."""

    ENABLES = "enables"
    RAMP = "stops, perhaps on a ramp"
    OFF = "takes the voltage"
    SILENT = "nothing: its own supervision has to stop it"


class Says(Enum):
    """Meaning of the drive's status word."""

    NOTHING = "nothing that is known"
    ENABLED = "operation enabled"
    STOPPING = "on the ramp of a stop or a fault"
    HOLDING = "enabled, and holds the motor at standstill"
    AT_REST = "not enabled"


class StopPlace(StrEnum):
    """Place of the stop in force on its way to the drive."""

    ENABLED = "enabled"
    AWAY = "away"
    TO_SEND = "to send"
    ON_BUS = "on the bus"
    CHANGING = "changing"

    __hash__ = str.__hash__  # as that of the leg's stages


PLACES: Final[Mapping[StopPlace, str]] = {
    StopPlace.ENABLED: "no stop is in force: the last word enables",
    StopPlace.AWAY: "a stop is in force, and the drive's node is not in operation",
    StopPlace.TO_SEND: "a stop is in force that has not been handed to the bus",
    StopPlace.ON_BUS: "the stop has been handed to the bus: the drive is judged",
    StopPlace.CHANGING: "it has, and another stop is to be sent: the drive is judged by the first",
}


_JUDGED: Final = (StopPlace.ON_BUS, StopPlace.CHANGING)
_AWAITS_SENDING: Final = (StopPlace.TO_SEND, StopPlace.CHANGING)


@dataclass(frozen=True, slots=True)
class Bounds:
    """Longest time for which a drive may say that it is enabled, in seconds: after a word that takes the
    voltage, after any other stop, and after the bridge has fallen silent (None: that is not known)."""

    off_s: float
    ramp_s: float
    silence_s: float | None = None
    seen_off_s: float = inf
    """After a word that takes the voltage the drive has said so by then, unless telegrams were lost."""
    seen_s: float = inf
    """After any stop the drive's telegrams tell of its ramp by then."""

    def of(self, sent: Sent) -> float:
        """The bound of a stop; infinite where there is none, or it is not known."""
        silence_s = inf if self.silence_s is None else self.silence_s
        return {Sent.OFF: self.off_s, Sent.RAMP: self.ramp_s, Sent.SILENT: silence_s}.get(sent, inf)


@dataclass(frozen=True, slots=True)
class StopVerdict:
    """End of a stop in ``outcome``, after ``before``. ``since`` is when it was handed to the bus, ``at`` when
    the drive's report decided it; ``again``: since it ignored a stop it has followed none."""

    outcome: LastStop
    before: LastStop
    since: float
    at: float
    again: bool = False
    is_cut_off: bool = False
    """The bridge had taken the drive's node out of operation, and it has said nothing else since."""
    summed: IgnoredTime | None = None
    """Stops that it ignores together, each of them too short to be judged by itself."""


class StopState(NamedTuple):
    """State of one drive's judge. Times are monotonic seconds. Defaults are those of a bridge that starts."""

    place: StopPlace = StopPlace.AWAY
    last_stop: LastStop = LastStop.NONE
    follows: bool = True
    """The drive has not ignored a stop since it last followed one; kept while it is not heard."""
    is_there: bool = False
    """Its node is in operation."""
    is_cut_off: bool = False
    """The bridge has taken the node out of operation, and the drive was not known to stop before."""
    sent: Sent = Sent.OFF
    """Meaning of the word that is to be on the bus."""
    on_bus: Sent = Sent.OFF
    """Meaning of the last stop that was handed over."""
    bounds: Bounds = Bounds(inf, inf)
    says: Says = Says.NOTHING
    is_doubted: bool = False
    """The drive said that it is not enabled before it had the word that enabled it, or had taken that over;
    and it will not say more: it has been cut off."""
    was_enabled: bool = False
    """The stop came after a word that enabled the drive."""
    has_risen: bool = False
    """The drive has reported since that word that it is enabled, or on a ramp."""
    since: float = inf
    """Time at which the stop was handed to the bus; infinite where it was not."""
    until: float = inf
    """Time from which a telegram that says *enabled* is an ignored stop."""
    off_since: float = inf
    """Time at which a word that takes the voltage was handed over; infinite where the last one does not."""
    stopping_since: float = -inf
    has_rested: bool = False
    """The drive has reported since the stop that it is not enabled."""
    is_graced: bool = False
    """It was enabled again after that, under a word that leaves the voltage on: that is granted once."""
    follows_since: float = inf
    """Time at which a drive that ignored its stop has begun to obey; infinite while it does not."""
    look_at: float = -inf
    """Time before which a look would find nothing new."""
    sums: Unfollowed = Unfollowed()
    untold: tuple[StopVerdict, ...] = ()
    """Verdicts that the next ``TimePassed`` gives, unless the stop is over by then."""

    def summed(self, sums: Unfollowed) -> StopState:
        """State with other ``sums``. As ``_replace`` at a third of its cost: this is done with each telegram
        of a drive that goes on in spite of its stop."""
        return StopState._make((*self[:_SUMS], sums, *self[_SUMS + 1 :]))

    @property
    def is_on_bus(self) -> bool:
        return self.place in _JUDGED

    @property
    def is_judged(self) -> bool:
        """A stop is on the bus, and the drive's node is in operation."""
        return self.is_there and self.place in _JUDGED

    @property
    def awaits_sending(self) -> bool:
        """Another stop is to be sent, and has not been handed to the bus yet."""
        return self.place in _AWAITS_SENDING

    @property
    def is_informed(self) -> bool:
        """The drive has said something since its node is in operation."""
        return self.says is not Says.NOTHING

    @property
    def may_rise(self) -> bool:
        """The drive may not have had the word yet that enabled it before the stop."""
        return self.was_enabled and not self.has_risen

    @property
    def may_be_enabled(self) -> bool:
        """The drive was enabled, and has not reported anything else since it was told to stop."""
        return self.was_enabled and self.last_stop is LastStop.FORWARDED

    @property
    def stopping_limit(self) -> float:
        """Time until which the drive may be on a ramp, though the voltage is to be taken."""
        return max(self.off_since, self.stopping_since) + self.bounds.ramp_s

    def obeys(self, at: float) -> bool:
        """Whether the drive does what it was told, by a telegram received ``at``."""
        match self.says:
            case Says.ENABLED:
                return False
            case Says.HOLDING:
                return self.on_bus is not Sent.OFF
            case Says.STOPPING:
                return at < self.stopping_limit
            case _:
                return not self.is_doubted

    def sent_for_s(self, now: float) -> float:
        """Time in seconds for which the stop in force has been on the bus; 0 where it is not."""
        return max(0.0, now - self.since) if self.place is StopPlace.ON_BUS else 0.0


_SUMS: Final = StopState._fields.index("sums")
