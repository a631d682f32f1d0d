"""A bench whose bridge pauses or dies at a look at the clock, above a model of the kernel that goes on.

Its node is a SK 54xE: two RPDOs, and P513 over its own process data.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from bridge.can.burstend import Burst
from bridge.can.interface import ControllerState
from bridge.can.kernelbursts import KernelBursts
from bridge.canopen.frame import Frame
from bridge.config import Site
from bridge.mapping import load_family
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_single_settings import RJ45_54X
from tests.support.bench import Bench, ClockBus
from tests.support.broadcast_manager import BroadcastManager

MAPPING = "nord/sk-54xe-rj45"
OWN_S = 100.0
"""P513: longer than any test, because what the kernel repeats does not reach the node here."""


class DeadError(BaseException):
    """The process is gone: nothing of it may catch this."""


@dataclass(frozen=True)
class Pause:
    """The process stands still at its first look at the clock after ``at_s``; for ever, it is dead."""

    at_s: float
    seconds: float

    @property
    def end_s(self) -> float:
        return self.at_s + self.seconds


class KernelBus(ClockBus):
    """The real bursts above a model of the kernel."""

    def __init__(self, bench: PausingBench) -> None:
        super().__init__(bench.from_master)
        self.kernel = BroadcastManager(lambda: bench.now, bench.from_kernel)
        self.bursts = KernelBursts(bench.clock)
        self.bursts.open(self.kernel)

    def burst(self, burst: Burst, now: float, *, at_once: bool = False) -> None:
        frame = self.bursts.start(burst, now, at_once=at_once)
        if frame is not None and self.status.state is not ControllerState.DOWN:
            self.send(frame, now, now)

    def end_burst(self, can_id: int) -> None:
        self.bursts.end(can_id, 0.0)

    def next_deadline(self) -> float | None:
        return self.bursts.next_deadline()

    def on_time(self, now: float) -> None:
        for frame in self.bursts.on_time(now):
            self.send(frame, now, now)


class PausingBench(Bench):
    """The kernel and the node go on while the process pauses. ``died_at`` is when it died; after that the
    kernel goes on for ``horizon_s``."""

    def __init__(self, site: Site) -> None:
        self.pauses: list[Pause] = []
        self.horizon_s = 3.0
        self.died_at = inf
        node = NordSingle(5, RJ45_54X, p513_s=OWN_S)
        super().__init__(site, family=load_family(MAPPING), mapping=MAPPING, node=node)

    def make_bus(self) -> KernelBus:
        return KernelBus(self)

    @property
    def kernel(self) -> BroadcastManager:
        assert isinstance(self.bus, KernelBus)
        return self.bus.kernel

    def from_kernel(self, frame: Frame) -> None:
        self.log.append(frame._replace(time=self.now))

    def from_master(self, frame: Frame) -> None:
        self._from_master(frame._replace(time=self.now))

    def clock(self) -> float:
        seen = self.now
        if self.pauses and seen >= self.pauses[0].at_s:
            self.stand_still(self.pauses.pop(0).seconds)
        return seen

    def stand_still(self, seconds: float) -> None:
        end = self.now + min(seconds, self.horizon_s)
        if seconds == inf:
            self.died_at = self.now
        while True:
            node_at = self.node.next_deadline() if seconds < inf else None
            at = min(
                (time for time in (self.kernel.next_deadline(), node_at) if time is not None), default=inf
            )
            if at > end:
                break
            self.now = max(self.now, at)
            self.kernel.on_time()
            if node_at is not None and self.now >= node_at:
                self.node.on_time(self.now)
                self._from_node()
        self.now = end
        if seconds == inf:
            raise DeadError

    def run(self, seconds: float) -> None:
        end = self.now + seconds
        while self.now < end:
            node_at = self.node.next_deadline()
            times = [self.wake_at, node_at, self.kernel.next_deadline()]
            self.now = max(self.now, min([end, *(time for time in times if time is not None)]))
            self.kernel.on_time()
            if node_at is not None and self.now >= node_at:
                self.node.on_time(self.now)
            if self._from_node() or self.now >= self.wake_at:
                self.master.pump()
