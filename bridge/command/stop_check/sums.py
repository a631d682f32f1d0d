"""Stop time in which a drive goes on as if nothing had been sent, summed over the stops of a jogging owner.

A stop that is shorter than its bound decides nothing by itself: the next enabling word ends it. But a drive
that obeys shows it in each of them, and a deaf one in none:

- Told to take the voltage off, it has said so ``seen_off_s`` later unless telegrams were lost.
- On a ramp it says *enabled* to the end, and may never come to rest between two words that enable. But it
  gets slower: from ``seen_s`` on its telegrams tell of the ramp, and what the slowest ramp loses in so much
  time is known, in one piece or in many. A quarter of that is demanded: an S-curve has lost an eighth
  of its speed after a quarter of its time.

The time counts that is covered by telegrams. A speed is compared with the one before in the same stop, or
with that of a drive that went on steadily before it: one that still speeds up when the stop comes gets no
slower at first, and is not to blame for that.
"""

from __future__ import annotations

from math import inf
from typing import Final, NamedTuple

_PART: Final = 4
"""Divisor: judged after this part of the slowest ramp, against this part of what that has lost then."""
_STEADY: Final = 1 / 64
"""Relative difference up to which two speeds are the same."""


class IgnoredTime(NamedTuple):
    """Sum over the ``stops`` since the drive last obeyed: ``time_s`` in which it was enabled, and the part
    ``lost`` of its speed (1 is all of it; 0 where no speed is known). Times are monotonic seconds."""

    time_s: float = 0.0
    lost: float = 0.0
    stops: int = 0
    begins_at: float = inf
    """Time from which telegrams tell of the stop in force; infinite where there is none."""
    seen_at: float | None = None
    speed: float = 0.0
    """Speed in the telegram received at ``seen_at``, the last one in this stop or in the run before it."""
    is_steady: bool = False
    """The telegram before it, in the same run, had the same speed."""
    has_counted: bool = False
    """The stop in force is one of ``stops``."""

    def begin(self, begins_at: float) -> IgnoredTime:
        seen_at = self.seen_at if self.is_steady else None
        return self._replace(begins_at=begins_at, seen_at=seen_at, has_counted=False, is_steady=False)

    def obeyed(self) -> IgnoredTime:
        return IgnoredTime(begins_at=self.begins_at)

    def seen(self, at: float, speed: float | None) -> IgnoredTime:
        """Add a telegram that says *enabled*; ``speed`` is in any unit, None where it is of no interest. A
        drive that stands, or turns round, obeys."""
        now = speed or 0.0
        if speed is not None and (not now or (self.seen_at is not None and now * self.speed < 0)):
            return self.obeyed()
        if self.is_steady and now == self.speed and self.begins_at == inf:
            return self
        if self.seen_at is None or at < self.begins_at:
            is_steady = self.seen_at is not None and abs(now - self.speed) <= _STEADY * abs(self.speed)
            return self._replace(seen_at=at, speed=now, is_steady=is_steady and self.begins_at == inf)
        before = self.speed
        # Not by _replace, which costs thrice as much with each telegram of a drive that goes on.
        return IgnoredTime(
            time_s=self.time_s + at - max(self.seen_at, self.begins_at),
            lost=self.lost + ((abs(before) - abs(now)) / max(abs(before), abs(now)) if now else 0.0),
            stops=self.stops + (not self.has_counted),
            begins_at=self.begins_at,
            seen_at=at,
            speed=now,
            is_steady=self.is_steady,
            has_counted=True,
        )


class Unfollowed(NamedTuple):
    """Both judgements: *enabled* after words that take the voltage, and no slower after any stop."""

    on: IgnoredTime = IgnoredTime()
    fast: IgnoredTime = IgnoredTime()

    def begin(self, on_from: float, fast_from: float) -> Unfollowed:
        """Begin with a stop, another word of it, or a drive that was not heard for a while. ``on_from`` is
        infinite where the word leaves the voltage on."""
        return Unfollowed(self.on.begin(on_from), self.fast.begin(fast_from))

    def end(self) -> Unfollowed:
        """End with a word that enables: the sums stay."""
        return self.begin(inf, inf)

    def obeyed(self) -> Unfollowed:
        return Unfollowed(self.on.obeyed(), self.fast.obeyed())

    def seen(
        self, at: float, speed: float | None, *, off_s: float, ramp_s: float
    ) -> tuple[Unfollowed, IgnoredTime | None]:
        """Add a telegram that says *enabled*; gives the time, too, that makes the stop an ignored one, or
        None. ``off_s`` and ``ramp_s`` are the bounds of a single stop; ``speed`` is None where unknown."""
        on = self.on.seen(at, None)
        fast = self.fast if speed is None else self.fast.seen(at, speed)
        if on.time_s >= off_s:
            return self.obeyed(), on
        if fast.time_s < max(off_s, ramp_s / _PART):
            return (self if on is self.on and fast is self.fast else Unfollowed(on, fast)), None
        has_kept = fast.lost < fast.time_s / ramp_s / _PART
        return Unfollowed(on, fast.obeyed()), fast if has_kept else None
