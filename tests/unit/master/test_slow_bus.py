"""No frame that enables a drive comes after its stop, however long the bridge takes for each of its messages
to the bus: the kernel goes on with its bursts meanwhile."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from bridge.canopen.frame import Frame
from bridge.command import Action
from bridge.config import load_site
from tests.support import sites
from tests.support.nightly import by_night
from tests.support.pausing_bench import MAPPING, KernelBus, PausingBench

RPDO = 0x205
STOPPED, ENABLED = 0x047E, 0x047F
MESSAGE_S = 0.003
"""A user-mode kernel under load needs as much."""
PHASES = 7


class SlowBus(KernelBus):
    """Each message to the kernel takes a while."""

    def __init__(self, bench: SlowBench) -> None:
        super().__init__(bench)
        self._bench = bench

    def _wait(self) -> None:
        if self._bench.is_slow:
            self._bench.stand_still(MESSAGE_S)

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        super().send(frame, now, deadline)
        self._wait()

    def burst(self, *burst: Any, **options: Any) -> None:
        super().burst(*burst, **options)
        self._wait()

    def end_burst(self, can_id: int) -> None:
        super().end_burst(can_id)
        self._wait()


class SlowBench(PausingBench):
    is_slow = False

    def make_bus(self) -> SlowBus:
        return SlowBus(self)


def restart(bench: SlowBench) -> None:
    bench.node.start(bench.now)


def leave(bench: SlowBench) -> None:
    bench.ask(Action.RELEASE_CONTROL)


def end(bench: SlowBench) -> None:
    bench.master.halt(bench.now)


WAYS: dict[str, Callable[[SlowBench], None]] = {
    "the node restarts": restart,
    "the owner releases": leave,
    "the service ends": end,
    "the owner is silent": lambda bench: None,
}
WAYS |= {
    f"{action} of the node": lambda bench, action=action: bench.ask(action, "conveyor")
    for action in (
        Action.RESET,
        Action.RESET_COMMUNICATION,
        Action.STOP_NODE,
        Action.ENTER_PRE_OPERATIONAL,
        Action.DISABLE,
    )
}
WAYS |= {
    f"{action} of the drive": lambda bench, action=action: bench.ask(action)
    for action in (Action.STOP, Action.QUICK_STOP, Action.DISABLE_VOLTAGE)
}


@pytest.mark.landing(18)
@pytest.mark.parametrize(("way", "phase"), by_night(itertools.product(WAYS, range(PHASES)), 4))
def test_nothing_enables_a_drive_after_its_stop(way: str, phase: int, tmp_path: Path) -> None:
    node = sites.node(sites.drive("drive", "modbus", 500, f'name = "fu1"\n{sites.SCALED}'), mapping=MAPPING)
    bench = SlowBench(load_site(sites.write(tmp_path, sites.bus(node), sites.modbus(), name="bench")))
    bench.run(3.0)
    for word in (STOPPED, ENABLED):
        assert bench.write(control_word=word, setpoint_1=0x2000).ok
        bench.run(0.2 + phase * 0.01 / PHASES)
    words = [frame.data[0] for frame in bench.sent(RPDO)]
    assert words[-1] == ENABLED & 0xFF
    bench.is_slow = True
    bench.log.clear()
    WAYS[way](bench)
    bench.run(1.5)
    enables = [frame.data[0] & 0x0F == 0x0F for frame in bench.sent(RPDO)]
    assert False in enables, "it is stopped"
    assert True not in enables[enables.index(False) :]
