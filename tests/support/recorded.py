"""Recordings of plants on one clock."""

from __future__ import annotations

from pathlib import Path

from bridge.recorder import checkpoint
from bridge.recorder.recording import Header, Segment, State
from tests.plant.plan import Plan
from tests.plant.plant import Plant, project
from tests.plant.world import BEGIN_S

_LOOK_S = 0.2


class RecordedPlant:
    """A plant whose bridge is recorded, as ``bridge.recorder.recorder`` does."""

    def __init__(self, folder: Path, plan: Plan) -> None:
        self._turns: list[bytes] = []
        self.plant = Plant(project(folder), plan, records=self._turns.append)

    def run(self, until_s: float) -> None:
        """Run up to a time of the plan."""
        self.plant.world.run_until(BEGIN_S + until_s)

    def run_until_calm(self) -> None:
        """Run until no node is asked for anything."""
        while self.plant.bridge.master.asks:
            self.plant.world.run_until(self.plant.world.now + _LOOK_S)

    def core(self) -> bytes:
        """A checkpoint."""
        bridge = self.plant.bridge
        return checkpoint.save((bridge.master, bridge.view, bridge.plant))

    def record(self, seconds: float) -> Segment:
        """A segment of this length from now on, the last that happens."""
        bridge, world = self.plant.bridge, self.plant.world
        assert bridge.tape
        buses = {bus.name: list(bus.facts()) for bus in bridge.taped}
        state = State("", bridge.tape.count, buses, self.core())
        header = Header(version="0", site="plant", buses=tuple(buses), number=1, began=world.now, epoch_ns=0)
        tape, self._turns[:] = bridge.tape, []
        tape.is_on = True
        world.run_until(world.now + seconds)
        tape.is_on = False
        self.plant.close()
        return Segment(header, state, list(self._turns))
