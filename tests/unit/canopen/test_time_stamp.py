"""TIME messages: the time of day on the wire (CiA 301 §7.1.6.5), and when they are due."""

from __future__ import annotations

import datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.canopen import time_stamp
from bridge.canopen.time_stamp import TimeProducer
from tests.support.bench import NOON_NS, Bench, write_site


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
