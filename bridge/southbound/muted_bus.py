"""A bus that can be muted: the master goes on listening, and nothing of it is sent any more."""

from __future__ import annotations

from collections.abc import Callable

from bridge.southbound.bus.frame import Frame
from bridge.southbound.bus.interface import Bus, BusStatus


class MutableBus:
    """Stands in for ``bus``. ``last_sent`` is when the last frame of ours was on the bus, as far as the bus
    tells: bursts come back with their time stamps. ``heard`` is called with every frame of others.
    """

    def __init__(self, bus: Bus, heard: Callable[[Frame], None]) -> None:
        self._bus = bus
        self._heard = heard
        self._accepted: list[int] = []
        self._beating: set[int] = set()
        self.is_muted = False
        self.last_sent = float("-inf")

    @property
    def name(self) -> str:
        return self._bus.name

    @property
    def status(self) -> BusStatus:
        return self._bus.status

    def open(self, wake: Callable[[], None]) -> None:
        self._bus.open(wake)

    def accept(self, can_ids: list[int]) -> None:
        self._accepted = can_ids
        self._bus.accept([*can_ids, *self._beating.difference(can_ids)])

    def drain(self, now: float) -> list[Frame]:
        frames = self._bus.drain(now)
        for frame in frames:
            if frame.can_id in self._beating:
                self.last_sent = max(self.last_sent, frame.time)
            else:
                self._heard(frame)
        return frames

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        if not self.is_muted:
            self.last_sent = max(self.last_sent, now)
            self._bus.send(frame, now, deadline)

    def beat(
        self, frames: tuple[Frame, ...], now: float, period_s: float, count: int, *, at_once: bool = False
    ) -> None:
        if self.is_muted:
            return
        can_id = frames[0].can_id
        if can_id not in self._beating:
            self._beating.add(can_id)
            self.accept(self._accepted)
        self._bus.beat(frames, now, period_s, count, at_once=at_once)

    def silence(self, can_id: int) -> None:
        self._bus.silence(can_id)

    def mute(self) -> None:
        """From now on nothing is sent: no SYNC, no RPDO, no heartbeat, no guarding, no SDO."""
        self.is_muted = True
        for can_id in self._beating:
            self._bus.silence(can_id)

    def unmute(self) -> None:
        self.is_muted = False

    def next_deadline(self) -> float | None:
        return self._bus.next_deadline()

    def on_time(self, now: float) -> None:
        self._bus.on_time(now)

    def close(self) -> None:
        self._bus.close()
