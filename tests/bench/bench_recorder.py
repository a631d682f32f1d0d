"""Cost of the flight recorder, and of a replay."""

from __future__ import annotations

import time
from pathlib import Path

from bridge.base.turns import Turn, Turns
from bridge.can.interface import BusStatus
from bridge.canopen.frame import Frame
from bridge.recorder.replay import Replay
from bridge.recorder.ring import Ring
from bridge.recorder.tape import RecordingTape, TapedBus
from tests.bench.figures import show
from tests.plant.plan import Plan
from tests.support.recorded import RecordedPlant

FRAMES_A_SECOND = 8000
_SECONDS = 5.0
_LOOK_S = 0.2
_PLANT_S = 30.0


class Source:
    """A bus on which ``frames`` have come at each look."""

    name = "can0"

    def __init__(self, frames: int) -> None:
        self.status = BusStatus()
        self._frames = frames
        self._count = 0

    def drain(self, now: float) -> list[Frame]:
        self._count += 1
        data = self._count.to_bytes(8, "little")
        return [Frame(0x180 + number, data, now) for number in range(self._frames)]

    def take_foreign(self, now: float, *, at_once: bool = False) -> list[Frame]:
        return []


def turns_of(bus: TapedBus | Source, turns: Turns, now: RecordingTape, count: int) -> None:
    """So many turns in which the master takes frames in, and does nothing with them."""

    def take_in() -> None:
        at = now.now()
        _ = bus.status
        bus.drain(at)
        bus.take_foreign(at)
        _ = bus.status
        now.now()

    for _ in range(count):
        with turns.begin(Turn.TAKE_IN):
            take_in()


def bench_recording(tmp_path: Path) -> None:
    """CPU that the recorder takes at 8,000 frames a second: noting, encoding, compressing, writing."""
    for frames in (1, 4):
        ring = Ring(tmp_path / f"ring{frames}", 100_000_000, tmp_path / "black_box", 1_000_000)
        ring.start()
        ring.begin(1)
        noted: list[bytes] = []
        tape = RecordingTape(noted.append, now=time.monotonic)
        source = Source(frames)  # type: ignore[arg-type]
        bus = TapedBus(source, tape)  # type: ignore[arg-type]
        spent: dict[bool, float] = {}
        for tape.is_on in (False, True):
            began = time.process_time()
            for _ in range(round(_SECONDS / _LOOK_S)):
                turns_of(bus, tape, tape, round(FRAMES_A_SECOND * _LOOK_S) // frames)
                if noted:
                    ring.put(list(noted))
                    noted.clear()
            spent[tape.is_on] = time.process_time() - began
        ring.close()
        cost = (time.process_time() - began - spent[False]) / _SECONDS
        size = (tmp_path / f"ring{frames}" / "000001.turns").stat().st_size / _SECONDS
        assert not ring.has_lost
        show(
            f"recorder, {FRAMES_A_SECOND} frames/s, {frames} in a turn",
            f"{100 * cost:.1f} % of a core, {size / 1000:.0f} kB/s on disk",
        )


def bench_replay(tmp_path: Path) -> None:
    """A replay of a plant of four drives, beside real time."""
    segment = RecordedPlant(tmp_path, Plan(1, _PLANT_S + 1, ())).record(_PLANT_S)
    began = time.process_time()
    replay = Replay(segment)
    while replay.step() is not None:
        pass
    spent = time.process_time() - began
    show("replay", f"{_PLANT_S / spent:.0f} times real time, {len(segment.turns) / _PLANT_S:.0f} turns/s")
