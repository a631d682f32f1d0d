"""A bench whose bus can be muted, for the drop test."""

from __future__ import annotations

from typing import Any

from bridge.bustools.drop_test import DropTest, Phase
from bridge.bustools.muted_bus import MutableBus
from bridge.canopen.frame import Frame
from tests.support.bench import Bench, ClockBus


class HearingBus(MutableBus):
    """A bus of the bench that can be muted."""

    def __init__(self, bus: ClockBus, bench: MutableBench) -> None:
        super().__init__(bus, lambda frame: bench.heard(frame))
        self._clock_bus = bus

    @property
    def accepted(self) -> frozenset[int]:
        return self._clock_bus.accepted

    @property
    def inbox(self) -> list[Frame]:
        return self._clock_bus.inbox

    @property
    def ours(self) -> frozenset[int]:
        return self._clock_bus.ours

    @property
    def foreign(self) -> list[Frame]:
        return self._clock_bus.foreign


class MutableBench(Bench):
    def make_bus(self) -> Any:
        self.heard = lambda frame: None
        return HearingBus(super().make_bus(), self)


def drop(bench: MutableBench) -> DropTest:
    """The drop test of the one node of the bench, to its end."""
    (node,) = bench.plant.nodes.values()
    ended: list[bool] = []
    bus: Any = bench.bus
    test = DropTest(bench.network, bench.plant, node, bus, lambda: ended.append(True))
    bench.heard = test.on_frame
    for _ in range(6000):
        bench.run(0.01)
        test.on_round(bench.now)
        if ended:
            assert test.phase is Phase.DONE
            return test
    raise AssertionError(f"still {test.phase}")
