"""Does a drive do what its last stop asked? The judgement, without a drive.

docs/explanation/dead-man-chain.md, "A stop that is not followed". What follows an ignored stop may halt a
plant, so nothing is called ignored that may be something else:

- The bound begins when the stop has been handed to the bus, not when it was decided.
- What counts is when the drive's telegram was received. A drive ignores its stop by a telegram received after
  the bound, never by mere time: a late process must not make a drive look bad. Only a drive that sends on
  change alone is judged by the time, once the bus has been drained.
- A drive that was not heard for longer than its TPDO's deadline may not have heard us: its bound restarts.
- A word that takes the voltage has a short bound; any other stop may be a ramp, with a long one. The bound of
  the weaker word holds as long as the drive may still have that word.
- A drive that reports that it is not enabled has ended its ramp: enabled again, it has until the short
  bound. One that has not said since the enabling word that it was enabled has perhaps not had it yet.
- Where the word leaves the voltage on, a drive may hold the motor, and be enabled on its way there.
- A drive that the bridge itself cuts off, by an NMT stop of its node, is judged by its last report.
- Stops that are shorter than their bound are summed until the drive obeys (``unfollowed.py``).
- The ramp of a fault may come at any time, and has its bound from then.
- A status word that fits no state of the family says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum
from math import inf
from typing import Final

from bridge.command.unfollowed import StopTime, Unfollowed

_LOOK_AGAIN_S: Final = 1.0
"""How often a drive that is no longer heard is looked at."""
_SOON_S: Final = 0.001


class Sent(Enum):
    """What the bridge has on the bus for the drive."""

    ENABLES = "enables"
    RAMP = "stops, perhaps on a ramp"
    OFF = "takes the voltage"
    SILENT = "nothing: its own supervision has to stop it"


class Says(Enum):
    """What the drive's status word says."""

    NOTHING = "nothing that is known"
    ENABLED = "operation enabled"
    STOPPING = "on the ramp of a stop or a fault"
    HOLDING = "enabled, and holds the motor at standstill"
    AT_REST = "not enabled"


class LastStop(IntEnum):
    """How the last stop has ended."""

    NONE = 0
    FORWARDED = 1
    FOLLOWED = 2
    IGNORED = 3

    @property
    def label(self) -> str:
        return self.name.lower()


LAST_STOPS: Final = tuple((state.value, state.label) for state in LastStop)


@dataclass(frozen=True, slots=True)
class Bounds:
    """How long a drive may say that it is enabled: after a word that takes the voltage, after any other
    stop, and after we have fallen silent (None: that is not known)."""

    off_s: float
    ramp_s: float
    silence_s: float | None = None
    seen_off_s: float = inf
    """After a word that takes the voltage the drive has said so by then, unless telegrams were lost."""
    seen_s: float = inf
    """After any stop the drive's telegrams tell of its ramp by then."""

    def of(self, sent: Sent) -> float | None:
        return {Sent.OFF: self.off_s, Sent.RAMP: self.ramp_s, Sent.SILENT: self.silence_s}.get(sent)


@dataclass(frozen=True, slots=True)
class Verdict:
    """The last stop has ended in ``outcome``, after ``before``. ``since`` is when it was handed to the bus,
    ``at`` when the drive said what this is about; ``again``: since it ignored a stop it has followed none."""

    outcome: LastStop
    before: LastStop
    since: float
    at: float
    again: bool = False
    is_cut_off: bool = False
    """The bridge had taken the drive's node out of operation, and it has said nothing else since."""
    summed: StopTime | None = None
    """Stops that it ignores together, each of them too short to be judged by itself."""


class Follow:
    """One drive. Times are monotonic seconds; ``follows`` is kept while the drive is not heard."""

    def __init__(self) -> None:
        self.state = LastStop.NONE
        self.follows = True
        self.awaits_sending = False
        """What is to be sent has changed, and has not been handed to the bus yet."""
        self._bounds = Bounds(inf, inf)
        self._sent = Sent.OFF
        self._on_bus = Sent.OFF
        self._is_there = False
        self._is_cut_off = False
        """The bridge has taken the node out of operation, and the drive was not known to stop before."""
        self._was_enabled = False
        """The stop came after a word that enabled the drive."""
        self._rose = False
        """The drive has reported since that word that it is enabled, or on a ramp."""
        self._says = Says.NOTHING
        self._since: float | None = None
        """When the stop was handed to the bus; None where there is none, or the drive is not there."""
        self._until = inf
        """A telegram from then on that says *enabled* is an ignored stop."""
        self._off_since = inf
        self._stopping_since = -inf
        self._rested = False
        self._graced = False
        self._disobeyed_at = -inf
        self._look_at = -inf
        self._unfollowed = Unfollowed()
        self._verdicts: list[Verdict] = []

    @property
    def is_judged(self) -> bool:
        """A stop is on the bus, and the drive's node is in operation."""
        return self._since is not None and self._is_there

    def told_for_s(self, now: float) -> float:
        """For how long the stop has been on the bus; 0 where it is not, or not judged."""
        return 0.0 if self._since is None or self.awaits_sending else max(0.0, now - self._since)

    @property
    def is_informed(self) -> bool:
        """The drive has said something since its node is in operation."""
        return self._says is not Says.NOTHING

    # what we do

    def on_output(self, sent: Sent) -> None:
        """What is to be on the bus from now on."""
        if sent is self._sent:
            return
        before, self._sent = self._sent, sent
        if sent is Sent.ENABLES:
            self._forget()
            self.state = LastStop.NONE
            self.follows = True
        elif before is Sent.ENABLES:
            self._begin()
            self._was_enabled = True
        else:
            self.awaits_sending = self._is_there

    def on_handed_over(self, now: float, bounds: Bounds) -> None:
        """What was to be sent has been handed to the bus by ``now``."""
        if not self.awaits_sending:
            return
        self.awaits_sending = False
        self._bounds = bounds
        sent = self._on_bus = self._sent
        bound = bounds.of(sent)
        until = now + (inf if bound is None else bound)
        if self._since is None:
            self._since, self._until = now, until
        elif sent is Sent.OFF:
            is_on = self.state is LastStop.FOLLOWED and self._says in (Says.STOPPING, Says.HOLDING)
            self._until = until if is_on else min(self._until, until)
        elif sent is Sent.RAMP and not self._rested:
            # The word before it may have been replaced before the drive had it. Words that go to and fro
            # do not put the end off for ever.
            last = self._since + bounds.off_s + bounds.ramp_s
            self._until = until if self._until == inf else max(self._until, min(until, last))
        if sent is not Sent.SILENT:
            self._off_since = now if sent is Sent.OFF else inf
        self._begin_sums()

    def on_node(self, *, is_there: bool) -> None:
        """The node is in operation, or is not."""
        if is_there is self._is_there:
            return
        self._is_there = is_there
        if self._is_cut_off and not is_there:
            return
        self._forget()
        self._unfollowed = Unfollowed()
        self._says = Says.NOTHING
        if is_there and self._sent is not Sent.ENABLES:
            self._begin()

    def on_cut_off(self, now: float, bounds: Bounds) -> None:
        """The bridge takes the node out of operation, and its stop is on the bus: most drives will not say
        any more whether they follow. To be told before ``on_node``."""
        if not self._is_there or self._sent is Sent.ENABLES or self._says is Says.NOTHING:
            return
        if self.state is LastStop.IGNORED or (self._obeys(now) and not self._may_be_enabled):
            return
        self.on_handed_over(now, bounds)
        self._is_cut_off = True
        if self._says is Says.AT_REST:
            # It said so before it had the word that enabled it, or had taken that over.
            self._says = Says.ENABLED
        if self._until == inf:
            self._until = now + bounds.ramp_s

    @property
    def _may_be_enabled(self) -> bool:
        """It was enabled, and has not reported anything since it was told to stop."""
        return self._was_enabled and self.state is LastStop.FORWARDED

    def on_node_stopped(self, now: float) -> None:
        """The node has said that it is in a state in which its drives do not run."""
        if self._is_cut_off and self.state is not LastStop.IGNORED:
            self._says = Says.AT_REST
            self._judge(now)

    def on_restart(self) -> None:
        """The node has started anew."""
        if self._is_cut_off:
            self._forget()

    def _begin(self) -> None:
        """A stop; whatever was before it has been forgotten."""
        self.state = LastStop.FORWARDED
        self.awaits_sending = self._is_there

    def _forget(self) -> None:
        self.awaits_sending = False
        self._since = None
        self._until = self._off_since = inf
        self._rested = self._graced = False
        self._is_cut_off = self._was_enabled = self._rose = False
        self._look_at = -inf
        self._unfollowed = self._unfollowed.end()
        self._verdicts.clear()

    def _begin_sums(self) -> None:
        if self._since is not None:
            on_from = self._off_since + self._bounds.seen_off_s
            self._unfollowed = self._unfollowed.begin(on_from, self._since + self._bounds.seen_s)

    # what the drive does

    def on_pause(self, at: float) -> None:
        """A telegram of the drive after a pause longer than its deadline; what it says comes after this."""
        if self._since is None:
            return
        bound = self._bounds.off_s if self._rested else self._bounds.of(self._on_bus)
        self._since, self._until = at, at + (inf if bound is None else bound)
        self._off_since = at if self._on_bus is Sent.OFF else inf
        self._stopping_since = at
        self._look_at = -inf
        self._begin_sums()

    def on_telegram(self, at: float, speed: float | None) -> None:
        """Any telegram, of which ``on_report`` knows already; ``speed`` is None where it tells none."""
        is_late = self._since is not None and at < self._since
        if is_late or self._says is not Says.ENABLED or self._sent is Sent.SILENT:
            return
        off_s, ramp_s = self._bounds.off_s, self._bounds.ramp_s
        found = self._unfollowed.seen(at, speed, off_s=off_s, ramp_s=ramp_s)
        self._unfollowed, summed = found
        if summed is not None and self.state is not LastStop.IGNORED:
            self._disobeyed_at = at
            self._conclude(LastStop.IGNORED, at, summed)

    def on_report(self, says: Says, at: float) -> None:
        """The drive's status word is another one now, by a telegram received ``at``."""
        before, self._says = self._says, says
        self._rose |= says not in (Says.AT_REST, Says.NOTHING)
        if says is Says.STOPPING and before is not says:
            self._stopping_since = at
        if says in (Says.STOPPING, Says.AT_REST) or (says is Says.HOLDING and self._on_bus is not Sent.OFF):
            # Also where the next word enables already.
            self._unfollowed = self._unfollowed.obeyed()
        if self._since is None or at < self._since or says is Says.NOTHING:
            return
        obeys = self._obeys(at)
        if not obeys and self.state is LastStop.FOLLOWED and self._on_bus is Sent.RAMP:
            self._grace(before, at)
        if not obeys or self.state is not LastStop.IGNORED:
            self._judge(at)
        elif not self._obeyed(before, at):
            self._disobeyed_at = at

    def _grace(self, before: Says, at: float) -> None:
        """Enabled again under a word that leaves the voltage on."""
        if before is Says.HOLDING:
            self._until = at + self._bounds.ramp_s
        elif not self._graced:
            self._graced = True
            self._until = max(self._until, at + self._bounds.off_s)

    def _obeys(self, at: float) -> bool:
        return self._obeyed(self._says, at)

    def _obeyed(self, says: Says, at: float) -> bool:
        """Whether this is what the drive was told, said by a telegram received ``at``."""
        match says:
            case Says.ENABLED:
                return False
            case Says.HOLDING:
                return self._on_bus is not Sent.OFF
            case Says.STOPPING:
                return at < self._stopping_limit
            case _:
                return True

    @property
    def _stopping_limit(self) -> float:
        """Until when the drive may be on a ramp, though the voltage is to be taken."""
        return max(self._off_since, self._stopping_since) + self._bounds.ramp_s

    def _judge(self, at: float) -> None:
        """By a telegram received ``at``, which says what is known of the drive."""
        if not self._obeys(at):
            self._disobeyed_at = at
            if at >= self._until and self.state is not LastStop.IGNORED:
                self._conclude(LastStop.IGNORED, at)
            return
        may_rise = self._was_enabled and not self._rose
        if self._says is Says.AT_REST and not self._rested and not may_rise and self._since is not None:
            self._rested = True
            self._until = min(self._until, self._since + self._bounds.off_s)
        if self.state is LastStop.FORWARDED:
            self._conclude(LastStop.FOLLOWED, at)

    def _conclude(self, outcome: LastStop, at: float, summed: StopTime | None = None) -> None:
        since = at if self._since is None else self._since
        again = not self.follows
        self._verdicts.append(Verdict(outcome, self.state, since, at, again, self._is_cut_off, summed))
        self.state = outcome
        self.follows = outcome is LastStop.FOLLOWED

    # time

    def on_time(self, now: float, heard_at: float | None, pause_s: float | None) -> list[Verdict]:
        """What has ended by ``now``. Call it when the bus has been drained.

        ``heard_at`` is when the drive's last telegram was received; ``pause_s`` is the longest regular
        pause between two, None where it sends changes alone: silence means that nothing has changed.
        """
        since = self._since
        if since is not None and self._says is not Says.NOTHING:
            # Of a drive that sends changes alone, what it said before the stop is true to the short bound.
            old = since + self._bounds.off_s if pause_s is None else since
            at = now if pause_s is None or self._is_cut_off else heard_at
            if at is not None and at >= old:
                self._judge(at)
            is_quiet = now >= self._disobeyed_at + self._bounds.off_s
            if self.state is LastStop.IGNORED and is_quiet and self._obeys(now):
                # Not at once: another master's words and ours may alternate.
                self._conclude(LastStop.FOLLOWED, now)
            if now >= self._next_look():
                self._look_at = self._next_telegram(now, heard_at, pause_s)
        verdicts, self._verdicts = self._verdicts, []
        return verdicts

    def _next_telegram(self, now: float, heard_at: float | None, pause_s: float | None) -> float:
        """When more will be known: nothing that the drive has said so far decides it."""
        if pause_s is None and self._since is not None:
            return max(self._since + self._bounds.off_s, now + _SOON_S)
        if pause_s is not None and heard_at is not None and now < heard_at + pause_s:
            return now + pause_s
        return now + _LOOK_AGAIN_S

    def next_deadline(self) -> float | None:
        """When ``on_time`` is to be called; a time that is over where something waits to be told."""
        at = self._verdicts[0].at if self._verdicts else self._next_look()
        return None if at == inf else at

    def _next_look(self) -> float:
        """When another outcome is due if the drive says nothing else."""
        if self._since is None or self._says is Says.NOTHING:
            return inf
        return max(self._due(self._since), self._look_at)

    def _due(self, since: float) -> float:
        obeys = self._obeys(self._disobeyed_at)
        if self.state is LastStop.IGNORED:
            return self._disobeyed_at + self._bounds.off_s if obeys else inf
        if not obeys:
            return self._until
        if self.state is LastStop.FORWARDED:
            return since
        if self._says is Says.STOPPING:
            return max(self._until, self._stopping_limit)
        return inf
