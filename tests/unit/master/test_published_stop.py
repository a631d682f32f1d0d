"""Nothing keeps a drive enabled for longer than the published time after its owner's last telegram, wherever
the bridge pauses or dies; and no stop is there sooner than the owner's time-out.

The judge sits at the drive: what was handed to the bus comes up to ``before_ms`` later, and a synchronous
RPDO counts when SYNC takes it over.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from pathlib import Path
from typing import get_args

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from bridge.can.burstend import MOST_FRAMES
from bridge.canopen import cobid
from bridge.canopen.frame import Frame
from bridge.canopen.sync import LAST_SYNCHRONOUS, burst_length
from bridge.command.worst_case import REACTION_BOUND_MS, Wire
from bridge.config import Reaction, Site, load_site
from bridge.node.process.held import held_s
from tests.support import sites
from tests.support.broadcast_manager import LATE_S
from tests.support.nightly import examples
from tests.support.pausing_bench import MAPPING, DeadError, Pause, PausingBench

RPDO1, RPDO2, HEARTBEAT = 0x205, 0x305, 0x77F
OPERATIONAL = 5
EXAMPLES = examples(80)
POINT = "conveyor/fu1/supervision/worst_case_stop_ms"
DEADMEN_MS = [10, 40, 100, 101, 250, 400, 1000, 10_000]
ON_ITS_WAY_S = 0.001
"""A burst that took longer to the kernel is handed over a second time (``kernelbursts.py``)."""


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
    """Seconds from the owner's last telegram; the last one may be for ever."""
    second_type: int = 255
    """Of the RPDO with a setpoint of its own."""
    sync_counter: int = 0
    heartbeat_ms: int = 0
    before_ms: float = 0.0
    """What may go first on the bus."""
    shares: tuple[float, ...] = (0.0,)
    """How much of that the frames wait for, in turn."""

    def site(self) -> Site:
        drive = (
            f'name = "fu1"\n{sites.SCALED}\non_expiry = "{self.reaction}"\n'
            f"rpdo = [{{ number = 1, transmission_type = {self.transmission_type} }}, "
            f"{{ number = 2, transmission_type = {self.second_type} }}]"
        )
        bus = (
            f"sync_period_ms = {self.sync_ms}\nrpdo_period_ms = {self.period_ms}\n"
            f"deadman_ms = {self.deadman_ms}\nheartbeat_ms = {self.heartbeat_ms}\n"
            f"sync_counter = {self.sync_counter}"
        )
        node = sites.node(sites.drive("drive", "modbus", self.timeout_ms, drive), mapping=MAPPING)
        with tempfile.TemporaryDirectory() as folder:
            file = sites.write(Path(folder), sites.bus(node, more=bus), sites.modbus(), name="bench")
            return load_site(file)

    @cached_property
    def held_s(self) -> float:
        return held_s(self.site().bus[0], self.transmission_type)

    @property
    def frames(self) -> int:
        """In the kernel without the bridge, at most."""
        return min(burst_length(self.period_ms / 1000, self.deadman_ms), MOST_FRAMES)

    @property
    def lateness_s(self) -> float:
        """What of ``reaction_ms`` the model of the kernel uses; the bridge itself is never late here."""
        return ON_ITS_WAY_S + LATE_S * (self.frames + self.transmission_type)

    @property
    def is_stopped_by_words(self) -> bool:
        """The bridge is there after ``held_s`` before the deadline, or it is back at the deadline."""
        deadline_s = self.timeout_ms / 1000
        held_from_s = deadline_s - self.held_s
        if self.held_s:
            return all(pause.at_s > held_from_s or pause.end_s < deadline_s for pause in self.pauses)
        return all(pause.end_s < deadline_s for pause in self.pauses)


def enables(frame: Frame) -> bool:
    return frame.data[0] & 0x0F == 0x0F


@dataclass(frozen=True)
class Seen:
    """What was on the bus, in seconds from the owner's last telegram."""

    setting: Setting
    frames: tuple[Frame, ...]
    terms: dict[str, float]
    died_s: float
    gaps: int

    def sum_s(self, *without: str) -> float:
        """The published sum; here a telegram has no way and the bridge is not late by itself."""
        left_out = {"way_ms", "reaction_ms", *without}
        sum_ms = sum(ms for name, ms in self.terms.items() if name not in left_out)
        return sum_ms / 1000 + self.setting.lateness_s

    @property
    def arrivals(self) -> list[Frame]:
        """As the drive gets them: in their order, each up to ``before_ms`` late."""
        shares, at, found = self.setting.shares, -inf, list[Frame]()
        for number, frame in enumerate(self.frames):
            wait_s = self.setting.before_ms / 1000 * shares[number % len(shares)]
            at = max(at, frame.time + wait_s)
            found.append(frame._replace(time=at))
        return found

    def stopped_at(self) -> float:
        """When the drive has taken the stop over."""
        kind = self.setting.transmission_type
        syncs = 0 if kind > LAST_SYNCHRONOUS else max(1, kind)
        is_there = False
        for frame in self.arrivals:
            if frame.can_id == RPDO1 and frame.time > 0.0:
                is_there = is_there or not enables(frame)
            elif frame.can_id == cobid.SYNC and is_there:
                syncs -= 1
            if is_there and not syncs:
                return frame.time
        return inf

    def of(self, can_id: int) -> list[Frame]:
        return [frame for frame in self.frames if frame.can_id == can_id]


def see(setting: Setting) -> Seen:
    bench = PausingBench(setting.site())
    for _ in range(50):
        bench.run(0.1)
        if bench.value("conveyor/node/nmt_state") == OPERATIONAL:
            break
    drive = bench.plant.drives["conveyor/fu1"]
    drive.on_wire(Wire(0.0, setting.before_ms), bench.now)
    timeout_s = setting.timeout_ms / 1000
    begin = bench.now
    for number, word in enumerate([0x047E] * 3 + [0x047F] * 6):
        begin = bench.now if number == 3 else begin
        assert bench.write(control_word=word, setpoint_1=0x2000, setpoint_4=0x1111).ok
        bench.run(timeout_s / setting.writes_per_timeout)
    last = bench.now
    stop = drive.stop_time()
    bench.horizon_s = (stop.ms + 1.1 * setting.deadman_ms) / 1000 + 0.2
    try:
        bench.write(control_word=0x047F, setpoint_1=0x2000, setpoint_4=0x1111)
        bench.pauses = [replace(pause, at_s=last + max(pause.at_s, 0.0)) for pause in setting.pauses]
        drive.refresh(bench.now)
        bench.run(stop.ms / 1000 + sum(pause.seconds for pause in setting.pauses if pause.seconds < inf))
    except DeadError:
        pass
    else:
        assert bench.plant.image.read(POINT).value == stop.ms
    frames = [frame._replace(time=frame.time - last) for frame in bench.log if frame.time > begin]
    terms = {term.name: term.ms for term in stop.terms}
    assert terms["reaction_ms"] == REACTION_BOUND_MS
    return Seen(setting, tuple(frames), terms, bench.died_at - last, bench.master.gaps)


def judge(seen: Seen) -> None:
    setting, timeout_s = seen.setting, seen.setting.timeout_ms / 1000
    enabling = [frame.time for frame in seen.of(RPDO1) if enables(frame)]
    setpoints = [frame.time for frame in seen.of(RPDO2) if any(frame.data)]
    assert enabling and setpoints, "it ran"
    off_the_bus = ("before_ms", "sync_ms", "sync_late_ms", "own_ms")
    ends_s = seen.sum_s("period_ms", *off_the_bus)
    assert max(enabling) <= ends_s
    assert max(setpoints) <= ends_s
    stops = [frame.time for frame in seen.of(RPDO1) if not enables(frame)]
    if not seen.gaps:  # which is a stop of its own
        assert all(at >= timeout_s - 1e-6 for at in stops), "the owner is there"
    periods_ms = {RPDO1: setting.period_ms, RPDO2: setting.period_ms, cobid.SYNC: setting.sync_ms}
    for can_id, period_ms in (periods_ms | {HEARTBEAT: setting.heartbeat_ms or 1}).items():
        late_s = LATE_S * burst_length(period_ms / 1000, setting.deadman_ms)
        last_s = max((frame.time for frame in seen.of(can_id)), default=-inf)
        goes_on_s = max(setting.deadman_ms, period_ms if can_id == HEARTBEAT else 0) / 1000
        assert last_s <= seen.died_s + goes_on_s + late_s, "the dead are silent"
    if setting.reaction == "silence":
        assert not stops or seen.gaps
        assert seen.terms["own_ms"], "the drive does the rest"
    elif setting.is_stopped_by_words:
        assert min(stops, default=inf) <= seen.sum_s(*off_the_bus)
        assert seen.stopped_at() <= seen.sum_s()


@st.composite
def all_settings(draw: st.DrawFn) -> Setting:
    period_ms = draw(st.sampled_from([2, 5, 10, 20, 50]))
    setting = Setting(
        period_ms,
        draw(st.sampled_from([2, 5, 7, 10, 20, 40])),
        draw(st.sampled_from([time for time in DEADMEN_MS if time >= 2 * period_ms])),
        draw(st.sampled_from([20, 50, 90, 100, 130, 200, 333, 700])),
        draw(st.sampled_from([one for one in get_args(Reaction) if one != "hold"])),
        draw(st.sampled_from([0, 1, 1, 2, 3, 7, 254, 255])),
        draw(st.integers(2, 6)),
        (),
        draw(st.sampled_from([0, 1, 255])),
        draw(st.sampled_from([0, 0, 0, 10])),
        draw(st.sampled_from([0, 20, 100])),
        draw(st.sampled_from([0.0, 0.6, 5.0, 19.0])),
        tuple(draw(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=7))),
    )
    return replace(setting, pauses=tuple(pauses_of(draw, setting)))


def pauses_of(draw: st.DrawFn, setting: Setting) -> list[Pause]:
    """Anywhere about the deadline, and where the bridge is just there for long enough."""
    timeout_s, deadman_s = setting.timeout_ms / 1000, setting.deadman_ms / 1000
    held_from_s = timeout_s - setting.held_s
    anywhere = st.floats(-0.02, timeout_s + 0.01)
    just_held = st.floats(0.0001, 0.004).map(lambda late: held_from_s + late)
    at_s = draw(st.one_of(anywhere, just_held))
    pauses: list[Pause] = []
    for _ in range(draw(st.integers(0, 2))):
        pauses.append(Pause(at_s, draw(st.floats(0.001, min(0.99 * deadman_s, 1.5)))))
        at_s = pauses[-1].end_s + draw(st.floats(0.002, 0.1))
    if not pauses or draw(st.booleans()):
        pauses.append(Pause(at_s, inf))
    return pauses


@settings(
    max_examples=EXAMPLES,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    phases=[Phase.generate],  # an example takes 0.1 s: to shrink one takes minutes
)
@given(setting=all_settings())
def test_nothing_enables_a_drive_longer_than_published(setting: Setting) -> None:
    judge(see(setting))


@pytest.mark.landing(5)
@pytest.mark.parametrize("kind", [0, 1, 2, 3, 255])
@pytest.mark.parametrize(
    ("sync_ms", "deadman_ms", "timeout_ms"), [(10, 100, 130), (5, 100, 50), (20, 250, 200), (40, 400, 1000)]
)
def test_the_kernel_stops_a_drive_whose_controller_and_bridge_die(
    kind: int, sync_ms: int, deadman_ms: int, timeout_ms: int
) -> None:
    setting = Setting(10, sync_ms, deadman_ms, timeout_ms, "disable_voltage", kind, 4, ())
    assert setting.held_s
    for late_s in (0.0001, 0.013):
        dies_s = max(0.0001, timeout_ms / 1000 - setting.held_s + late_s)
        seen = see(replace(setting, pauses=(Pause(dies_s, inf),)))
        assert seen.setting.is_stopped_by_words
        judge(seen)
