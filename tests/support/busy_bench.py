"""The bench on a wire with a bit rate: one frame at a time, the lowest identifier first, and somebody who
babbles."""

from __future__ import annotations

from functools import cache

from bridge.can.wirebits import exact_bits
from bridge.canopen.frame import Frame
from bridge.config import Site
from tests.support.bench import Bench, ClockBus

_STEP_S = 1e-3
_bits = cache(exact_bits)


class _WiredBus(ClockBus):
    """Bus on which the master's frames wait for their turn, and for no longer than they may."""

    def __init__(self, bench: BusyBench) -> None:
        super().__init__(lambda frame: None)
        self._bench = bench

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        self._bench.waiting.append((frame, deadline, True))

    def _send_of_burst(self, frame: Frame, now: float) -> None:
        self._bench.replace(frame, from_master=True)


class BusyBench(Bench):
    """``babble`` is a frame that somebody else sends whenever the wire is free, None: nobody does."""

    def __init__(self, site: Site) -> None:
        self.babble: Frame | None = None
        self.waiting: list[tuple[Frame, float, bool]] = []
        self.bits = 0
        self._bitrate = site.bus[0].bitrate
        self._on_wire: tuple[Frame, bool | None, float] | None = None
        self._node_at: float | None = 0.0
        super().__init__(site)

    def make_bus(self) -> ClockBus:
        return _WiredBus(self)

    def replace(self, frame: Frame, *, from_master: bool) -> None:
        """A mailbox keeps the newest frame of an identifier."""
        self.waiting = [item for item in self.waiting if item[0].can_id != frame.can_id]
        self.waiting.append((frame, float("inf"), from_master))

    def _from_node(self) -> bool:
        for frame in self.node.take_frames() if self.powered else []:
            self.replace(frame, from_master=False)
        return False

    def run(self, seconds: float) -> None:
        end = self.now + seconds
        while self.now < end - 1e-12:
            until = min(end, self.now + _STEP_S)
            ready = self._on_wire[2] if self._on_wire else None
            if ready is not None and ready < until:
                until = max(ready, self.now)
            self._pass(until)
            self.bus.status.bits = self.bits

    def _pass(self, until: float) -> None:
        """Pass the time to ``until``: what is on the wire arrives, everybody acts, and the next frame
        begins."""
        self.now = until
        if self._on_wire and self._on_wire[2] <= until:
            self._arrive(*self._on_wire[:2])
            self._on_wire = None
        if self._node_at is not None and self._node_at <= until:
            self.node.on_time(until)
            self._node_at = self.node.next_deadline()
        if self.wake_at <= until or self.bus.inbox:
            self.master.pump()
        self._from_node()
        if self._on_wire is None:
            self._begin(until)

    def _arrive(self, frame: Frame, from_master: bool | None) -> None:
        frame = frame._replace(time=self.now)
        self.log.append(frame)
        if from_master is not False and self.powered:
            self.node.on_frame(frame, self.now)
            self._node_at = self.now
        if not from_master:
            self.receive(frame)

    def _begin(self, now: float) -> None:
        kept = [item for item in self.waiting if item[1] >= now]
        self.bus.status.frames_expired += len(self.waiting) - len(kept)
        self.waiting = kept
        offers: list[tuple[int, Frame, bool | None]] = [
            (item[0].can_id & 0x7FF, item[0], item[2]) for item in kept
        ]
        if self.babble:
            offers.append((self.babble.can_id, self.babble, None))
        if not offers:
            return
        _, frame, origin = min(offers, key=lambda offer: offer[0])
        if origin is not None:
            self.waiting = [item for item in kept if item[0] is not frame]
        bits = _bits(frame)
        self.bits += bits
        self._on_wire = frame, origin, now + bits / self._bitrate
