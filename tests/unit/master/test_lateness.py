"""The bridge knows how late it was, and that the machine was suspended."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.master.master import Master
from bridge.master.suspend import SuspendWatch
from tests.support.bench import Bench, write_site

TRIP, ROUND = "bridge/worst_trip_lateness_ms", "bridge/worst_round_lateness_ms"


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    bench = Bench(write_site(tmp_path))
    bench.run(1.0)
    bench.write(control_word=0x047E)
    bench.keep_writing(1.0, control_word=0x047F, setpoint_1=0x2000)
    bench.events.clear()
    return bench


def late(bench: Bench) -> list[str]:
    return [event.message for event in bench.events if "late" in event.message]


def test_a_bridge_that_is_in_time_says_so(bench: Bench) -> None:
    bench.run(1.0)
    assert bench.value("conveyor/fu1/supervision/trips") == 1
    assert bench.value(TRIP) == bench.value(ROUND) == 0.0
    assert not late(bench)


def test_a_trip_that_is_late_is_known_and_an_event(bench: Bench) -> None:
    bench.write(control_word=0x047F)
    bench.run(0.19)
    bench.hang(0.06)
    bench.run(0.5)
    assert bench.value(TRIP) == pytest.approx(50.0, abs=0.2)
    [told] = [message for message in late(bench) if "stop" in message]
    assert "handed over 50 ms late; 20 ms are allowed for" in told


def test_a_round_that_is_late_is_known_and_an_event(bench: Bench) -> None:
    bench.hang(0.07)
    bench.run(0.2)
    worst = bench.value(ROUND)
    assert isinstance(worst, float) and 30.0 < worst <= 70.0
    assert len(late(bench)) == 1
    bench.hang(0.03)
    bench.run(0.2)
    assert bench.value(ROUND) == worst, "the worst since the start"


def test_lateness_again_and_again_is_told_a_few_times(bench: Bench) -> None:
    for _ in range(50):
        bench.hang(0.07)
        bench.write(control_word=0x047F)
        bench.run(0.1)
    assert 1 <= len(late(bench)) <= 4


def test_a_machine_that_was_suspended_starts_all_drives_anew(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    offset = [0.0]
    bench.master = Master(
        [(bench.bus, bench.network)],
        bench.plant,
        bench.clock,
        slept=SuspendWatch(lambda: (offset[0], offset[0] + 0.001)).take,
    )
    bench.master.attach(lambda at: setattr(bench, "wake_at", at))
    bench.run(1.0)
    bench.write(control_word=0x047E)
    bench.keep_writing(1.0, control_word=0x047F, setpoint_1=0x2000)
    assert bench.value("conveyor/fu1/supervision/sent_control_word") == 0x047F
    offset[0] = 3600.0
    bench.run(0.05)
    assert bench.value("conveyor/fu1/supervision/sent_control_word") != 0x047F
    assert bench.value("conveyor/fu1/supervision/owner") == ""
    assert any("the machine was suspended for 3600.0 s" in event.message for event in bench.events)
    bench.keep_writing(0.5, control_word=0x047F)
    assert bench.value("conveyor/fu1/supervision/sent_control_word") != 0x047F, "restart interlock"


@given(
    st.lists(
        st.tuples(st.floats(0, 2), st.floats(0, 2), st.sampled_from([0.0, 0.0, 0.0, 5.0, 1000.0])), min_size=1
    )
)
def test_no_hold_up_between_two_clocks_is_taken_for_a_suspend(
    looks: list[tuple[float, float, float]],
) -> None:
    """Each look is held up before and after it reads the second clock."""
    offset = 100.0
    bounds = (100.0, 100.0)
    watch = SuspendWatch(lambda: bounds)
    for before, after, slept in looks:
        offset += slept
        bounds = (offset - after, offset + before)
        found = watch.take()
        assert found <= slept + 1e-9 or (slept == 0.0 and found == 0.0)
        if slept > 4.0:
            assert found > 0


HANGS, LAST_HANG = "bridge/hangs", "bridge/last_hang_ms"


def test_a_bus_process_that_stood_still_counts_it_once(bench: Bench) -> None:
    bench.hang(0.6)
    bench.run(0.5)
    assert (bench.value(HANGS), bench.value(LAST_HANG)) == (1, 600)
    bench.hang(0.05)
    bench.run(0.5)
    assert (bench.value(HANGS), bench.value(LAST_HANG)) == (1, 600), "that is not worth a word"
