"""A bus at 100 % load, to the bit: what the user sees and what still works."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.canopen import abort
from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtState
from bridge.canopen.sdo import Result, SdoError
from bridge.command import EventKind
from bridge.command.drive_link import NodeState
from tests.support.bench import write_site
from tests.support.busy_bench import BusyBench

LAST = Frame(0x7FF, bytes.fromhex("A5A5A5A5A5A5A5A5"))
"""Loses against everybody: fills what the others leave."""
FIRST = Frame(0x001, bytes.fromhex("A5A5A5A5A5A5A5A5"))
"""Wins against everybody but NMT."""
RPDO1 = 0x205
BIT_RATE = 250_000
FRAME_S = 135 / BIT_RATE
"""The longest frame."""


@pytest.fixture
def bench(tmp_path: Path) -> BusyBench:
    bench = BusyBench(write_site(tmp_path))
    bench.run(1.5)
    assert bench.network.nodes[0].state is NodeState.OPERATIONAL
    bench.write(control_word=0x047E, setpoint_1=0)
    bench.run(0.1)
    bench.events.clear()
    return bench


def load(bench: BusyBench) -> float:
    value = bench.value("bus/can0/load")
    assert isinstance(value, float)
    return value


def keep_running(bench: BusyBench, seconds: float) -> None:
    bench.keep_writing(seconds, control_word=0x047F, setpoint_1=0x2000)


def moves(frame: Frame) -> bool:
    return frame.data[0] & 0x0F == 0x0F


def test_without_a_babbling_node_the_load_is_small(bench: BusyBench) -> None:
    bench.run(2.2)
    assert 5 < load(bench) < 60


@pytest.mark.landing
def test_the_load_is_shown_as_what_it_is(bench: BusyBench) -> None:
    bench.babble = LAST
    keep_running(bench, 2.2)
    assert load(bench) == pytest.approx(100.0, abs=0.5)


@pytest.mark.landing
def test_where_the_others_frames_are_less_urgent_everything_goes_on(bench: BusyBench) -> None:
    bench.babble = LAST
    keep_running(bench, 3.0)
    assert bench.value("conveyor/node/nmt_state") == NmtState.OPERATIONAL
    assert [event for event in bench.events if event.kind in (EventKind.NODE_LOST, EventKind.WATCHDOG)] == []
    assert bench.bus.status.frames_expired == 0
    assert any(moves(frame) for frame in bench.sent(RPDO1))
    results: list[Result] = []
    core = bench.network.nodes[0]
    core.wire.sdo[1].read(0x1018, 1, bench.now, results.append)
    bench.network.touched(core)
    bench.run(0.1)
    assert isinstance(results[0], bytes)


@pytest.mark.landing
def test_a_stop_waits_for_one_frame_and_for_no_more(bench: BusyBench) -> None:
    bench.babble = LAST
    keep_running(bench, 1.0)
    stopped = bench.now
    bench.write(control_word=0x047E, setpoint_1=0)
    bench.run(0.02)
    first = next(frame for frame in bench.sent(RPDO1) if frame.time > stopped and not moves(frame))
    # One frame that is on the wire already, its own, and what is more urgent: SYNC and a heartbeat's worth.
    assert first.time - stopped < 5 * FRAME_S + 0.002


@pytest.mark.landing
def test_where_nothing_gets_through_the_node_is_told_lost_and_is_not_forgotten(bench: BusyBench) -> None:
    keep_running(bench, 1.0)
    assert bench.plant.drives["conveyor/fu1"].quality.label == "good"
    bench.babble, began = FIRST, bench.now
    keep_running(bench, 0.5)
    lost = [event for event in bench.events if event.kind is EventKind.NODE_LOST]
    assert lost
    assert lost[0].time - began < 0.2 + 0.1, "supervision_ms, and a frame that was on its way"
    assert "no heartbeat for 200 ms" in str(bench.value("conveyor/node/boot_status"))
    keep_running(bench, 1.7)
    assert load(bench) == pytest.approx(100.0, abs=0.5)

    bench.run(60.0)
    assert len(bench.events) < 60, "a full bus fills no log"
    assert bench.network.waiting < 100
    assert len(bench.waiting) < 100

    bench.babble, again = None, bench.now
    bench.run(12.0)
    assert bench.network.nodes[0].state is NodeState.OPERATIONAL
    assert not [f for f in bench.sent(RPDO1) if f.time > again and moves(f)], "nothing moves by itself"


def test_where_nothing_gets_through_commands_end_with_a_time_out(tmp_path: Path) -> None:
    bench = BusyBench(write_site(tmp_path, node='supervision = "none"'))
    bench.run(1.5)
    bench.babble = FIRST
    bench.run(0.05)
    results: list[Result] = []
    began = bench.now
    core = bench.network.nodes[0]
    core.wire.sdo[1].read(0x1018, 1, bench.now, results.append)
    bench.network.touched(core)
    while not results and bench.now < began + 10:
        bench.run(0.01)
    assert isinstance(results[0], SdoError)
    assert results[0].code == abort.TIMED_OUT
    assert bench.now - began == pytest.approx(2 * 0.5, abs=0.1), "sdo_timeout_ms, and once more"
    bench.run(0.2)
    assert bench.number("bus/can0/frames_expired") > 0, "the user sees that what was to be sent was not"
