"""Nothing that enables a drive is on the bus later than the published time after its owner's last telegram,
wherever the bridge pauses; and no stop is there sooner than the owner's time-out."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bridge.command.freshness import GRAIN_MS
from bridge.config import Site, load_site
from bridge.southbound.bus.burstend import MOST_FRAMES, BurstEnd
from bridge.southbound.bus.frame import Frame
from bridge.southbound.bus.interface import ControllerState
from bridge.southbound.bus.kernelbeat import KernelBeat
from tests.support import sites
from tests.support.bench import Bench, ClockBus
from tests.support.broadcast_manager import BroadcastManager

RPDO1 = 0x205
OPERATIONAL = 5
EXAMPLES = 80
POINT = "conveyor/fu1/supervision/worst_case_stop_ms"


@dataclass(frozen=True)
class Pause:
    """The process stands still at its first look at the clock after ``at_s``."""

    at_s: float
    seconds: float


@dataclass(frozen=True)
class Setting:
    period_ms: int
    sync_ms: int
    deadman_ms: int
    timeout_ms: int
    reaction: str
    transmission_type: int
    writes_per_timeout: int
    pauses: tuple[Pause, ...]
    """Seconds from the owner's last telegram."""

    def site(self) -> Site:
        drive = (
            f'{sites.SCALED}\non_expiry = "{self.reaction}"\n'
            f"rpdo = {{ transmission_type = {self.transmission_type} }}"
        )
        bus = (
            f"sync_period_ms = {self.sync_ms}\nrpdo_period_ms = {self.period_ms}\n"
            f"deadman_ms = {self.deadman_ms}\nheartbeat_ms = 0"
        )
        fu1 = sites.drive("fu1", "modbus", self.timeout_ms, drive)
        with tempfile.TemporaryDirectory() as folder:
            return load_site(
                sites.write(Path(folder), sites.bus(sites.node(fu1), more=bus), sites.modbus(), name="bench")
            )


class KernelBus(ClockBus):
    """The real bursts above a model of the kernel."""

    def __init__(self, bench: PausingBench) -> None:
        super().__init__(bench.from_master)
        self.kernel = BroadcastManager(lambda: bench.now, bench.from_kernel)
        self.bursts = KernelBeat(bench.clock)
        self.bursts.open(self.kernel)

    def beat(
        self,
        frames: tuple[Frame, ...],
        now: float,
        period_s: float,
        count: int,
        *,
        at_once: bool = False,
        ending: BurstEnd | None = None,
    ) -> None:
        frame = self.bursts.beat(frames, now, period_s, count, at_once=at_once, ending=ending)
        if frame is not None and self.status.state is not ControllerState.DOWN:
            self.send(frame, now, now)

    def silence(self, can_id: int) -> None:
        self.bursts.silence(can_id, 0.0)

    def next_deadline(self) -> float | None:
        return self.bursts.next_deadline()

    def on_time(self, now: float) -> None:
        for frame in self.bursts.on_time(now):
            self.send(frame, now, now)


class PausingBench(Bench):
    """Its process pauses at looks at the clock; the kernel and the node go on meanwhile."""

    def __init__(self, site: Site) -> None:
        self.pauses: list[Pause] = []
        super().__init__(site)

    def make_bus(self) -> KernelBus:
        return KernelBus(self)

    @property
    def kernel(self) -> BroadcastManager:
        assert isinstance(self.bus, KernelBus)
        return self.bus.kernel

    def from_kernel(self, frame: Frame) -> None:
        """The node has no time-out of its own here: what the kernel repeats says nothing to it."""
        self.log.append(frame._replace(time=self.now))

    def from_master(self, frame: Frame) -> None:
        self._from_master(frame)

    def clock(self) -> float:
        seen = self.now
        if self.pauses and seen >= self.pauses[0].at_s:
            self.stand_still(self.pauses.pop(0).seconds)
        return seen

    def stand_still(self, seconds: float) -> None:
        end = self.now + seconds
        while (at := self.kernel.next_deadline()) is not None and at <= end:
            self.now = max(self.now, at)
            self.kernel.on_time()
        self.now = end

    def run(self, seconds: float) -> None:
        end = self.now + seconds
        while self.now < end:
            node_at = self.node.next_deadline()
            times = [self._wake_at, node_at, self.kernel.next_deadline()]
            self.now = max(self.now, min([end, *(time for time in times if time is not None)]))
            self.kernel.on_time()
            if node_at is not None and self.now >= node_at:
                self.node.on_time(self.now)
            if self._from_node() or self.now >= self._wake_at:
                self.master.pump()


@st.composite
def all_settings(draw: st.DrawFn) -> Setting:
    period_ms = draw(st.sampled_from([2, 5, 10, 20, 50]))
    deadmen = [10, 40, 100, 101, 250, 400, 1000, 10_000]
    deadman_ms = draw(st.sampled_from([time for time in deadmen if time >= 2 * period_ms]))
    timeout_ms = draw(st.sampled_from([20, 50, 90, 100, 130, 200, 333, 700]))
    pauses: list[Pause] = []
    at_s = draw(st.floats(-0.02, 0.001 * timeout_ms + 0.01))
    for _ in range(draw(st.integers(1, 3))):
        seconds = draw(st.floats(0.001, 0.00099 * deadman_ms).filter(lambda s: s <= 1.5))
        pauses.append(Pause(at_s, seconds))
        at_s += seconds + draw(st.floats(0.002, 0.1))
    return Setting(
        period_ms,
        draw(st.sampled_from([5, 10, 40])),
        deadman_ms,
        timeout_ms,
        draw(st.sampled_from(["disable_voltage", "quick_stop", "stop"])),
        draw(st.sampled_from([0, 1, 3, 255])),
        draw(st.integers(2, 6)),
        tuple(pauses),
    )


def enables(frame: Frame) -> bool:
    return frame.data[0] & 0x0F == 0x0F


def play(setting: Setting) -> None:
    bench = PausingBench(setting.site())
    for _ in range(50):
        bench.run(0.1)
        if bench.value("conveyor/node/nmt_state") == OPERATIONAL:
            break
    timeout_s = setting.timeout_ms / 1000
    every_s = timeout_s / setting.writes_per_timeout
    telegrams: list[float] = []
    for word in [0x047E] * 3 + [0x047F] * 6:
        telegrams.append(bench.now)
        assert bench.write(control_word=word, setpoint_1=0x2000).ok
        bench.run(every_s)
    last = bench.now
    telegrams.append(last)
    bench.write(control_word=0x047F, setpoint_1=0x2000)
    begin = telegrams[3]
    bench.pauses = [Pause(last + max(pause.at_s, 0.0), pause.seconds) for pause in setting.pauses]
    bench.run(timeout_s + sum(pause.seconds for pause in setting.pauses) + 0.3)
    shown = bench.plant.image.read(POINT).value
    assert isinstance(shown, int)
    published = shown - GRAIN_MS  # here a telegram has no way
    frames = [frame for frame in bench.sent(RPDO1) if frame.time >= begin]
    enabling = [frame.time - last for frame in frames if enables(frame)]
    assert enabling, "it ran"
    assert max(enabling) <= published / 1000 + 1e-6
    stops = [frame.time for frame in frames if not enables(frame) and frame.time > begin]
    assert stops, "it was stopped"
    if not bench.master.gaps:  # which is a stop of its own
        assert stops[0] >= last + timeout_s - 1e-6, "the owner is there"
    reach_s = min(setting.deadman_ms, MOST_FRAMES * setting.period_ms) / 1000
    if all(pause.seconds <= reach_s * 2 / 3 - 3 * setting.period_ms / 1000 for pause in setting.pauses):
        assert stops[0] - last <= published / 1000 + 1e-6


@settings(max_examples=EXAMPLES, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(setting=all_settings())
def test_nothing_enables_a_drive_later_than_published(setting: Setting) -> None:
    play(setting)
