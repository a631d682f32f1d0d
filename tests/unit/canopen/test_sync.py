"""SYNC with its counter, its period and its window (CiA 301 §7.2.5)."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.canopen.frame import Frame
from bridge.canopen.sync import SyncWindow, sync_frames
from tests.support.bench import Bench, write_site

SYNC, TPDO1 = 0x080, 0x185


def test_a_sync_counter_goes_round_from_1(tmp_path: Path) -> None:
    """CiA 301 §7.2.5.2.3: one byte, 1 … 1019h."""
    bench = Bench(write_site(tmp_path, bus="sync_counter = 3\nsync_period_ms = 10"))
    bench.run(1.0)
    numbers = [frame.data[0] for frame in bench.sent(SYNC)]
    assert len(numbers) >= 99
    assert numbers == [place % 3 + 1 for place in range(len(numbers))]


def test_sync_without_a_counter_has_no_data() -> None:
    assert sync_frames(0) == (Frame(SYNC),)


@pytest.mark.landing(3)
@pytest.mark.parametrize("period_ms", [1, 250, 1000])
def test_sync_comes_with_its_period(tmp_path: Path, period_ms: int) -> None:
    bench = Bench(write_site(tmp_path, bus=f"sync_period_ms = {period_ms}\nrpdo_period_ms = 20"))
    bench.run(2.5)
    times = [frame.time for frame in bench.sent(SYNC)]
    pauses = [after - before for before, after in pairwise(times)]
    assert pauses
    assert pauses == pytest.approx([period_ms / 1000] * len(pauses), abs=1e-6)


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ("sync_counter = 1", "must be 0 (SYNC without a counter) or 2…240"),
        ("sync_counter = 241", "must be 0 (SYNC without a counter) or 2…240"),
        ("sync_period_ms = 10\nsync_window_us = 10001", "10001 µs is longer than the SYNC period"),
        ("time_period_s = 90000", "1…86400 s"),
    ],
)
def test_what_cannot_be_is_named_with_its_key(tmp_path: Path, keys: str, sentence: str) -> None:
    with pytest.raises(FileFaults) as caught:
        write_site(tmp_path, bus=keys)
    assert sentence in str(caught.value)


def test_tpdos_after_the_window_are_counted() -> None:
    window = SyncWindow(0.25)
    window.on_tpdo(Frame(TPDO1, b"", 1.0))
    window.on_sync(Frame(SYNC, b"", 2.0))
    for time in (2.001, 2.25, 2.5):
        window.on_tpdo(Frame(TPDO1, b"", time))
    assert window.misses == 1, "at its end is in time"
    window.reset()
    window.on_tpdo(Frame(TPDO1, b"", 2.9))
    assert window.misses == 1


def test_the_window_is_judged_by_the_sync_on_the_wire(tmp_path: Path) -> None:
    site = "sync_period_ms = 100\nrpdo_period_ms = 20\ndeadman_ms = 400\nsync_window_us = 5000"
    bench = Bench(write_site(tmp_path, bus=site, drive="tpdo = { transmission_type = 1 }"))
    bench.run(1.5)
    assert SYNC in bench.bus.accepted
    assert bench.value("bus/can0/sync_window_misses") == 0
    bench.run(bench.sent(SYNC)[-1].time + 0.110 - bench.now)
    word = bench.sent(TPDO1)[-1].data
    bench.receive(Frame(TPDO1, word))
    bench.run(0.2)
    assert bench.value("bus/can0/sync_window_misses") == 1
