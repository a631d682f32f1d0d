"""Our own frames that come back through the kernel, told from those of other processes of this host. Sans-IO.

A frame from the wire carries no mark of a local sender and is certainly somebody else's. One with the mark
may be ours: a socket receives what every other socket of the host sends, our broadcast manager's included. It
is ours if we have told the kernel to send exactly that, now or a moment ago, and if it does not come more
often than we can have sent it. No frame of ours is ever taken for another's. So a stranger that repeats our
own frames is found late, or never if it does so less often than we do; but then it says nothing that we do
not say.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from bridge.canopen.frame import Frame

LINGER_S: Final = 1.0
"""For this long after it was replaced a frame may still come out of the queues below us."""
_SPARE: Final = 64
"""Frames that may come in a bunch: what waited in those queues, and what was sent beside the rhythm."""
_FASTER: Final = 1.1
"""Factor by which the allowance grows faster than we use it up, so that it recovers after an intruder."""
_MOST_PAST: Final = 256


class _FrameBudget:
    """Number of our own frames that may come: ``left`` now, ``rate`` a second more, and those sent beside
    that.

    What was sent within ``LINGER_S`` may come at once, after the bus was busy, also at a rate that is over.
    """

    def __init__(self) -> None:
        self.rate = 0.0
        self.left = float(_SPARE)
        self._at = float("-inf")
        self._beside = self._before = 0
        """Frames beside the rhythm since ``_since``, and in the time of the same length before."""
        self._since = float("-inf")
        self._past_rate = 0.0
        self._past_until = float("-inf")

    def repeat(self, rate: float, now: float) -> None:
        """So many come a second from now on."""
        self._advance(now)
        self._past_rate = self._highest_rate(now)
        self._past_until = now + LINGER_S
        self.left += LINGER_S * max(0.0, rate - self.rate)
        self.rate = rate

    def add(self, now: float) -> None:
        """One more is on its way."""
        if now >= self._since + LINGER_S:
            self._before = self._beside if now < self._since + 2 * LINGER_S else 0
            self._beside, self._since = 0, now
        self._beside += 1
        self.left += 1

    def fill(self, now: float) -> None:
        self.left = self._most(now)

    def _highest_rate(self, at: float) -> float:
        return max(self.rate, self._past_rate) if at <= self._past_until else self.rate

    def _most(self, at: float) -> float:
        return _SPARE + LINGER_S * self._highest_rate(at) + self._beside + self._before

    def _advance(self, at: float) -> None:
        if at > self._at:
            if self._at > float("-inf"):
                self.left = min(self.left + self.rate * (at - self._at), self._most(at))
            self._at = at

    def take(self, at: float) -> bool:
        """One has arrived; False if it is one too many."""
        self._advance(at)
        if self.left < 1.0:
            return False
        self.left -= 1.0
        return True


@dataclass(slots=True)
class _Stream:
    """Frames that we send on one identifier."""

    current: frozenset[bytes] = frozenset()
    frames: tuple[Frame, ...] = ()
    past: dict[bytes, float] = field(default_factory=dict[bytes, float])
    """Data that is no longer in force, and until when it may still come."""
    most_past: int = _MOST_PAST
    count: _FrameBudget = field(default_factory=_FrameBudget)

    def retire(self, data: Iterable[bytes], now: float) -> None:
        for one in data:
            self.past[one] = now + LINGER_S
        if len(self.past) > self.most_past:
            self.past = {one: until for one, until in self.past.items() if until >= now}
            self.most_past = max(_MOST_PAST, 2 * len(self.past))


class OwnFrames:
    """Times are monotonic seconds; those of frames are when the kernel saw them."""

    def __init__(self) -> None:
        self._streams: dict[int, _Stream] = {}
        self._is_stalled = False

    def told(self, frames: tuple[Frame, ...], now: float, period_s: float, *, at_once: bool) -> None:
        """The kernel has been told to repeat these from now on, in place of what it repeated."""
        stream = self._stream(frames[0].can_id)
        rate = _FASTER / period_s
        if rate != stream.count.rate:
            stream.count.repeat(rate, now)
        if at_once:
            stream.count.add(now)
        if frames == stream.frames:
            return
        current = frozenset(frame.data for frame in frames)
        stream.retire(stream.current - current, now)
        stream.frames, stream.current = frames, current

    def sent(self, frame: Frame, now: float) -> None:
        """A single frame has been handed over, or waits for room."""
        stream = self._stream(frame.can_id)
        stream.count.add(now)
        stream.retire((frame.data,), now)

    def silenced(self, can_id: int, now: float) -> None:
        """Note that the burst on this identifier has been ended."""
        stream = self._streams.get(can_id)
        if stream is not None:
            stream.retire(stream.current, now)
            stream.frames, stream.current = (), frozenset()

    def silenced_all(self, now: float) -> None:
        for can_id in self._streams:
            self.silenced(can_id, now)

    def stalled(self, now: float, *, is_stalled: bool) -> None:
        """Frames are stuck below us as long as nobody acknowledges them: then none is too old, and recent
        ones may come out together when somebody does."""
        if is_stalled == self._is_stalled:
            return
        self._is_stalled = is_stalled
        for stream in self._streams.values():
            stream.count.fill(now)
            stream.retire(list(stream.past), now)

    def is_own(self, can_id: int, data: bytes, at: float) -> bool:
        """Whether a frame with a local sender's mark, seen by the kernel at this time, may be ours."""
        stream = self._streams.get(can_id)
        if stream is None:
            return False
        if data not in stream.current:
            until = stream.past.get(data)
            if until is None or (at > until and not self._is_stalled):
                return False
        return stream.count.take(at)

    def _stream(self, can_id: int) -> _Stream:
        stream = self._streams.get(can_id)
        if stream is None:
            stream = self._streams[can_id] = _Stream()
        return stream
