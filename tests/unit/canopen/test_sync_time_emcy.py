"""SYNC with its counter and window, TIME, emergencies of a node that babbles, a bus with errors."""

from __future__ import annotations

import datetime
import json
import re
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.base.errors import FileFaults
from bridge.can.interface import ControllerState
from bridge.canopen import time_stamp
from bridge.canopen.emcy import Emergency
from bridge.canopen.frame import Frame
from bridge.canopen.sync import SyncWindow, sync_frames
from bridge.canopen.time_stamp import TimeProducer
from bridge.command import Kind
from bridge.node.emergency_log import EmergencyLog
from tests.support.bench import NOON_NS, Bench, write_site

SYNC, TPDO1, EMCY = 0x080, 0x185, 0x085


# SYNC


def test_a_sync_counter_goes_round_from_1(tmp_path: Path) -> None:
    """CiA 301 §7.2.5.2.3: one byte, 1 … 1019h."""
    bench = Bench(write_site(tmp_path, bus="sync_counter = 3\nsync_period_ms = 10"))
    bench.run(1.0)
    numbers = [frame.data[0] for frame in bench.sent(SYNC)]
    assert len(numbers) >= 99
    assert numbers == [place % 3 + 1 for place in range(len(numbers))]


def test_sync_without_a_counter_has_no_data() -> None:
    assert sync_frames(0) == (Frame(SYNC),)


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


# TIME


@pytest.mark.parametrize(
    ("moment", "data"),
    [
        (datetime.datetime(1984, 1, 1, tzinfo=datetime.UTC), "000000000000"),
        (datetime.datetime(1984, 1, 1, 0, 0, 1, tzinfo=datetime.UTC), "E80300000000"),
        (datetime.datetime(1984, 1, 2, 0, 0, 1, tzinfo=datetime.UTC), "E80300000100"),
        (datetime.datetime(2026, 11, 21, 12, tzinfo=datetime.UTC), "002E9302313D"),
        (datetime.datetime(1970, 1, 1, tzinfo=datetime.UTC), "000000000000"),
        (datetime.datetime(1983, 12, 31, 12, tzinfo=datetime.UTC), "000000000000"),
        (datetime.datetime(2163, 6, 6, 12, tzinfo=datetime.UTC), "002E9302FFFF"),
        (datetime.datetime(2163, 6, 7, tzinfo=datetime.UTC), "FF5B2605FFFF"),
        (datetime.datetime(2200, 1, 1, tzinfo=datetime.UTC), "FF5B2605FFFF"),
    ],
)
def test_time_of_day(moment: datetime.datetime, data: str) -> None:
    """CiA 301 §7.1.6.5: ms after midnight, days since 1984-01-01, of which two bytes can say the first 65536.
    Before and after them it is the first and the last moment."""
    assert time_stamp.encode(int(moment.timestamp()) * 1_000_000_000).hex().upper() == data


@given(st.integers(441_763_200_000, 6_104_073_599_999))
def test_a_time_read_back_is_the_same_to_the_millisecond(epoch_ms: int) -> None:
    assert time_stamp.decode(time_stamp.encode(epoch_ms * 1_000_000)) == epoch_ms


def test_the_four_bits_beside_the_milliseconds_say_nothing() -> None:
    assert time_stamp.decode(bytes.fromhex("002E93F2313D")) == 1_795_262_400_000


@given(st.binary(max_size=8), st.integers(-(2**70), 2**70))
def test_no_time_raises(data: bytes, epoch_ns: int) -> None:
    time_stamp.decode(data)
    assert len(time_stamp.encode(epoch_ns)) == 6


def test_time_is_sent_with_its_period_and_never_in_bunches(tmp_path: Path) -> None:
    site = write_site(tmp_path, bus="time_period_s = 1")
    bench = Bench(site)
    bench.run(2.5)
    bench.hang(5.0)
    bench.run(0.5)
    stamps = bench.sent(0x100)
    assert [round(frame.time - 1000, 3) for frame in stamps] == [0.0, 1.0, 2.0, 7.5]
    assert [time_stamp.decode(frame.data) for frame in stamps] == [
        NOON_NS // 1_000_000 + ms for ms in (0, 1000, 2000, 7500)
    ]


def test_a_late_time_message_does_not_put_off_the_next_one() -> None:
    producer = TimeProducer(1.0, lambda now: NOON_NS)
    deadlines = []
    for now in (10.0, 11.0, 12.25, 13.5):
        assert producer.on_time(now)
        assert not producer.on_time(now), "once each time"
        deadlines.append(producer.next_deadline())
    assert deadlines == [11.0, 12.0, 13.0, 14.0]


@pytest.mark.parametrize("late_s", [1.0, 1.5, 4.0])
def test_missed_time_messages_are_skipped(late_s: float) -> None:
    producer = TimeProducer(1.0, lambda now: NOON_NS)
    assert producer.on_time(10.0)
    assert producer.on_time(11.0 + late_s)
    assert not producer.on_time(11.0 + late_s)
    assert producer.next_deadline() == 12.0 + late_s


# EMCY


def emergencies(bench: Bench) -> list[str]:
    return [event.message for event in bench.events if event.kind is Kind.EMERGENCY]


def test_the_last_eight_emergencies_can_be_read(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    bench.run(1.0)
    assert bench.value("conveyor/node/emcy_history") == "[]"
    for number in range(10):
        bench.receive(Frame(EMCY, bytes((number, 0x10, 0x11, 0, 0, 0, 0, 0))))
        bench.run(0.2)
    history = json.loads(str(bench.value("conveyor/node/emcy_history")))
    assert [entry["code"] for entry in history] == [f"10{number:02X}h" for number in range(9, 1, -1)]
    assert history[0]["register"] == "11h"
    assert history[0]["vendor"] == "0000000000"
    assert history[0]["text"]


def test_a_babbling_node_is_told_ten_times_a_second_and_its_last_word_arrives(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    bench.run(1.0)
    bench.events.clear()
    for number in range(5000):
        bench.receive(Frame(EMCY, bytes((number & 0xFF, 0x10, 0x11, 0, 0, 0, 0, 0))))
        bench.run(0.001)
    assert 16 <= len(emergencies(bench)) <= 16 + 52
    bench.receive(Frame(EMCY, bytes(8)))
    bench.run(0.5)
    assert bench.value("conveyor/fu1/status/emcy_code") == 0
    assert bench.number("conveyor/node/emcy_suppressed") > 4900


@given(st.integers(1, 40), st.integers(0, 120), st.floats(0, 0.05))
def test_every_emergency_is_told_or_counted(drives: int, number: int, pause_s: float) -> None:
    """A node may name drives that there are not: what waits is bounded, what is left out is counted."""
    log, now, told = EmergencyLog(), 0.0, 0
    arrivals = [place % drives for place in range(number)]
    for drive in arrivals:
        now += pause_s
        told += len(log.on_time(now))
        told += log.add(Emergency(0x1000, 0, b""), drive, now)
    while (due := log.next_deadline()) is not None:
        told += len(log.on_time(due))
    assert told + log.suppressed == len(arrivals)


@given(st.lists(st.tuples(st.floats(0, 0.3), st.sampled_from([None, 0, 1, 2, 99]), st.integers(0, 9))))
def test_the_newest_of_every_drive_is_told_in_the_end(arrivals: list[tuple[float, int | None, int]]) -> None:
    log, now = EmergencyLog(), 0.0
    told: dict[int | None, int] = {}
    for pause, number, code in arrivals:
        now += pause
        for emergency, about, _ in log.on_time(now):
            told[about] = emergency.code
        if log.add(Emergency(code, 0, b""), number, now):
            told[number] = code
    while (due := log.next_deadline()) is not None:
        now = max(now, due)
        for emergency, about, _ in log.on_time(now):
            told[about] = emergency.code
    assert told == {number: code for _, number, code in arrivals}


# the bus


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
    told = [event.message for event in bench.events if event.kind is Kind.BUS]
    assert 3 <= len(told) <= 4
    assert re.match(r"50\d\d error frames: no acknowledge", told[1])


def test_a_bus_that_flaps_is_told_now_and_then_and_its_last_state_always(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    bench.run(1.0)
    bench.events.clear()
    for number in range(400):
        bench.bus.status.state = (ControllerState.WARNING, ControllerState.OK)[number % 2]
        bench.run(0.05)
    bench.bus.status.state = ControllerState.PASSIVE
    bench.run(6.0)
    told = [event.message for event in bench.events if event.kind is Kind.BUS]
    assert 10 <= len(told) <= 16
    assert told[-1].startswith("bus can0 is passive")
