"""Points and events of a bus with errors: shown at once, told now and then."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from bridge.can.interface import ControllerState
from bridge.command import EventKind
from tests.support.bench import Bench, write_site


@pytest.mark.landing
def test_error_frames_are_shown_at_once_and_told_every_ten_seconds(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    bench.run(1.0)
    bench.events.clear()
    for _ in range(3000):
        bench.bus.status.error_frames += 5
        bench.bus.status.note_error((0x2000_0020, bytes(8)))
        bench.run(0.01)
    bench.run(0.2)
    assert "no acknowledge" in str(bench.value("bus/can0/last_error"))
    assert bench.value("bus/can0/error_frames") == 15_000
    told = [event.message for event in bench.events if event.kind is EventKind.BUS]
    assert 3 <= len(told) <= 4
    assert re.match(r"50\d\d error frames: no acknowledge", told[1])


@pytest.mark.landing
def test_a_bus_that_flaps_is_told_now_and_then_and_its_last_state_always(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    bench.run(1.0)
    bench.events.clear()
    for number in range(400):
        bench.bus.status.state = (ControllerState.WARNING, ControllerState.OK)[number % 2]
        bench.run(0.05)
    bench.bus.status.state = ControllerState.PASSIVE
    bench.run(6.0)
    told = [event.message for event in bench.events if event.kind is EventKind.BUS]
    assert 10 <= len(told) <= 16
    assert told[-1].startswith("bus can0 is passive")
