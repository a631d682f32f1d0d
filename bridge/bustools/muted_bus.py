"""Bus that can be muted: the master goes on listening, and nothing of it is sent any more."""

from __future__ import annotations

from collections.abc import Callable

from bridge.can.burstend import Burst
from bridge.can.interface import Bus, BusStatus
from bridge.canopen.frame import Frame


class MutableBus:
    """Stands in for ``bus``. ``heard`` is called with every frame of others."""

    def __init__(self, bus: Bus, heard: Callable[[Frame], None]) -> None:
        self._bus = bus
        self._heard = heard
        self._accepted: list[int] = []
        self._bursting: set[int] = set()
        self._muted: frozenset[int] | None = None
        """Muted identifiers; None for all."""
        self._sent_at: dict[int, float] = {}
        self.is_muted = False

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
        self._bus.accept([*can_ids, *self._bursting.difference(can_ids)])

    def watch(self, can_ids: frozenset[int]) -> None:
        self._bus.watch(can_ids)

    def take_foreign(self, now: float, *, at_once: bool = False) -> list[Frame]:
        return self._bus.take_foreign(now, at_once=at_once)

    def drain(self, now: float) -> list[Frame]:
        frames = self._bus.drain(now)
        for frame in frames:
            if frame.can_id in self._bursting:
                self._note(frame.can_id, frame.time)
            else:
                self._heard(frame)
        return frames

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        if self._mutes(frame.can_id):
            return
        self._note(frame.can_id, now)
        self._bus.send(frame, now, deadline)

    def _note(self, can_id: int, at: float) -> None:
        self._sent_at[can_id] = max(self._sent_at.get(can_id, at), at)

    @property
    def last_sent(self) -> float:
        """Time of the last muted frame of ours on the bus, as far as known: bursts come back with their time
        stamps."""
        muted = self._muted
        return max(
            (at for can_id, at in self._sent_at.items() if muted is None or can_id in muted),
            default=float("-inf"),
        )

    def burst(self, burst: Burst, now: float, *, at_once: bool = False) -> None:
        if self._mutes(burst.can_id):
            return
        if burst.can_id not in self._bursting:
            self._bursting.add(burst.can_id)
            self.accept(self._accepted)
        self._bus.burst(burst, now, at_once=at_once)

    def end_burst(self, can_id: int) -> None:
        self._bus.end_burst(can_id)

    def mute(self, only: frozenset[int] | None = None) -> None:
        """Send nothing from now on: no SYNC, no RPDO, no heartbeat, no guarding, no SDO; or nothing on the
        identifiers in ``only``."""
        self.is_muted, self._muted = True, only
        for can_id in self._bursting:
            if self._mutes(can_id):
                self._bus.end_burst(can_id)

    def unmute(self) -> None:
        self.is_muted = False

    def _mutes(self, can_id: int) -> bool:
        return self.is_muted and (self._muted is None or can_id in self._muted)

    def next_deadline(self) -> float | None:
        return self._bus.next_deadline()

    def on_time(self, now: float) -> None:
        self._bus.on_time(now)

    def close(self) -> None:
        self._bus.close()
