"""The bridge's own worst delays: an event where one exceeds what the published times allow for."""

from __future__ import annotations

from typing import Final

from bridge.base.ratelimit import RateLimit
from bridge.command import Event, EventKind, EventQueue
from bridge.command.worst_case import REACTION_BOUND_MS
from bridge.image import Image
from bridge.text import Text

HANG_MS: Final = 100
"""Delay in ms from which the bus process counts as too slow to have noticed what went on."""
_EVENTS: Final = 3
_EVENT_EVERY_S: Final = 60.0
_SEVERITY_ROUND, _SEVERITY_TRIP = 500, 700


class Lateness:
    """Worst delays: of a trip from its deadline until its stop was handed to the bus, of a round from its due
    time. Times are monotonic seconds."""

    def __init__(self, image: Image, events: EventQueue) -> None:
        self._image = image
        self._events = events
        self._trip_ms = 0.0
        self._round_ms = 0.0
        self._hangs = 0
        self._last_hang_ms = 0
        self._hung_until = float("-inf")
        self._trip_limit = RateLimit(_EVENTS, _EVENT_EVERY_S)
        self._round_limit = RateLimit(_EVENTS, _EVENT_EVERY_S)

    def on_hang(self, began: float, now: float) -> None:
        """Count a hang: the bus process did not run in between, though something was due. It counts once,
        however many notice it."""
        hang_ms = 1000 * (now - began)
        if hang_ms < HANG_MS or began < self._hung_until:
            return
        self._hangs += 1
        self._last_hang_ms = round(hang_ms)
        self._hung_until = now

    def on_round(self, due: float, now: float) -> None:
        self.on_hang(due, now)
        late_ms = 1000 * (now - due)
        self._round_ms = max(self._round_ms, late_ms)
        if late_ms > REACTION_BOUND_MS and self._round_limit.allows(now):
            said = Text.of("bridge.round_late", late_ms=late_ms, allowed_ms=REACTION_BOUND_MS)
            self._tell(said, _SEVERITY_ROUND, now)

    def on_stop(self, due: float, now: float) -> None:
        late_ms = 1000 * (now - due)
        self._trip_ms = max(self._trip_ms, late_ms)
        if late_ms > REACTION_BOUND_MS and self._trip_limit.allows(now):
            said = Text.of("bridge.stop_late", late_ms=late_ms, allowed_ms=REACTION_BOUND_MS)
            self._tell(said, _SEVERITY_TRIP, now)

    def _tell(self, said: Text, severity: int, now: float) -> None:
        self._events.report(Event(now, EventKind.WATCHDOG, "bridge", severity, said))

    def refresh(self, now: float) -> None:
        self._image.put("bridge/hangs", self._hangs, now)
        self._image.put("bridge/last_hang_ms", self._last_hang_ms, now)
        self._image.put("bridge/worst_trip_lateness_ms", round(self._trip_ms, 1), now)
        self._image.put("bridge/worst_round_lateness_ms", round(self._round_ms, 1), now)
