"""State of a CAN controller and of its bus, as points and events. Sans-IO."""

from __future__ import annotations

from typing import Final

from bridge.base.ratelimit import RateLimit
from bridge.can.interface import BusStatus
from bridge.command import BusSide, Event, EventKind
from bridge.config import BusTable
from bridge.text import Text

_LOAD_PERIOD_S: Final = 1.0
_ERRORS_EVERY_S: Final = 10.0
"""Shortest time in seconds between reports of error frames: a broken wire gives thousands a second."""


class BusPoints:
    def __init__(self, bus: BusTable, side: BusSide) -> None:
        self._bus = bus
        self._image = side.image
        self._events = side.events
        self._measured: tuple[float, int] | None = None
        self._errors_told = 0
        self._error_limit = RateLimit(1, _ERRORS_EVERY_S)

    def refresh(self, status: BusStatus, now: float) -> None:
        """Show the state; called a few times a second."""
        values = {
            "state": int(status.state),
            "tx_errors": status.tx_errors,
            "rx_errors": status.rx_errors,
            "frames_lost": status.frames_lost,
            "frames_expired": status.frames_expired,
            "error_frames": status.error_frames,
        }
        for leaf, value in values.items():
            self._image.put(f"bus/{self._bus.name}/{leaf}", value, now)
        self._image.say(self._image.index[f"bus/{self._bus.name}/last_error"], status.last_error, now)
        self._show_load(status, now)
        self._tell_errors(status, now)

    def _show_load(self, status: BusStatus, now: float) -> None:
        bits = status.bits
        if self._measured is None:
            self._measured = now, bits
            return
        since, before = self._measured
        if now >= since + _LOAD_PERIOD_S:
            load = 100 * (bits - before) / (now - since) / self._bus.bitrate
            self._image.put(f"bus/{self._bus.name}/load", round(min(100.0, load), 1), now)
            self._measured = now, bits

    def _tell_errors(self, status: BusStatus, now: float) -> None:
        """Report the error frames since the last time, in one event."""
        number = status.error_frames - self._errors_told
        if number and self._error_limit.allows(now):
            self._errors_told = status.error_frames
            error = status.last_error
            said = Text.of("bus.error_frames", number=number, error=error)
            if number == 1:
                said = Text.of("bus.error_frame", error=error)
            self._events.report(Event(now, EventKind.BUS, self._bus.name, 500, said))
