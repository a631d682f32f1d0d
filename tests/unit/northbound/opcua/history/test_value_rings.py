"""Rings of past values: the newest of each chosen point, in their order; no server."""

from __future__ import annotations

import sys
import tracemalloc
from typing import Any

import pytest
from asyncua import ua
from hypothesis import given
from hypothesis import strategies as st

from bridge.config import OpcUaHistoryTable
from bridge.image import DataType, Image, Point, Quality
from bridge.northbound.opcua.history.value_rings import ValueRing, ValueRings, chosen
from bridge.uaserver.history.history import date_time

Codes, Kind = ua.StatusCodes, ua.VariantType
SECOND = 1_000_000


def rings_of(image: Image, *patterns: str, **settings: int) -> ValueRings:
    table = OpcUaHistoryTable(points=list(patterns), **settings)
    return ValueRings(image, lambda at: round(at * 1e9), table)


def held(ring: ValueRing) -> list[tuple[int, Any, Quality]]:
    numbers = range(ring.first, ring.end)
    return [(ring.time_us(one), ring.value(one), ring.quality(one)) for one in numbers]


@given(
    st.lists(st.tuples(st.integers(0, 5), st.floats(allow_nan=False), st.sampled_from(Quality))),
    st.integers(1, 8),
)
def test_a_ring_holds_the_newest(steps: list[tuple[int, float, Quality]], capacity: int) -> None:
    ring = ValueRing(DataType.FLOAT, capacity)
    time, expected = 0, []
    for step, value, quality in steps:
        time += step
        ring.append(time, value, quality)
        expected.append((time, value, quality))
    assert held(ring) == expected[-capacity:]
    assert (ring.first, ring.end) == (max(0, len(steps) - capacity), len(steps))


@given(st.integers(0, 30), st.integers(1, 8), st.integers(-1, 31), st.integers(-1, 31))
def test_a_part_has_what_lies_in_it_and_what_was_before(
    count: int, capacity: int, start: int, end: int
) -> None:
    ring = ValueRing(DataType.UINT32, capacity)
    for time in range(count):
        ring.append(time, 10 * time, Quality.GOOD)
    kept = range(count)[-capacity:]
    expected = [time for time in kept if start <= time <= end]
    earlier = [time for time in kept if time < start]
    if start <= end:
        found = list(ring.part(start, end).samples())
        assert found == [(time, 10 * time) for time in earlier[-1:] + expected]


@pytest.mark.parametrize(
    ("data_type", "value", "kind"),
    [
        (DataType.BOOL, True, Kind.Boolean),
        (DataType.UINT8, 255, Kind.Byte),
        (DataType.UINT16, 0xFFFF, Kind.UInt16),
        (DataType.UINT32, 0xFFFF_FFFF, Kind.UInt32),
        (DataType.INT16, -0x8000, Kind.Int16),
        (DataType.INT32, -0x8000_0000, Kind.Int32),
        (DataType.FLOAT, 10.3, Kind.Double),
        (DataType.STRING, "Überstrom", Kind.String),
    ],
)
def test_a_sample_is_what_a_client_was_told(data_type: DataType, value: Any, kind: Kind) -> None:
    ring = ValueRing(data_type, 2)
    ring.append(5 * SECOND + 1, value, Quality.GOOD)
    ring.append(6 * SECOND, value, Quality.LOST)
    ring.append(7 * SECOND, value, Quality.DEAD)
    ring.append(8 * SECOND, value, Quality.STALE)
    assert (ring.first, ring.end) == (2, 4)
    dead, stale = ring.sample(2), ring.sample(3)
    assert (dead.Value.Value, dead.StatusCode.value) == (None, Codes.BadNoCommunication)
    assert (stale.Value, stale.StatusCode.value) == (ua.Variant(value, kind), Codes.UncertainLastUsableValue)
    assert type(stale.Value.Value) is type(value)
    assert stale.SourceTimestamp == date_time(8 * SECOND)


def test_a_clock_that_is_set_back_begins_the_history_anew() -> None:
    ring = ValueRing(DataType.UINT8, 10)
    for time in (10 * SECOND, 10 * SECOND - 1):
        ring.append(time, 1, Quality.GOOD)
    assert [time for time, *_ in held(ring)] == [10 * SECOND, 10 * SECOND]
    ring.append(5 * SECOND, 2, Quality.GOOD)
    ring.append(6 * SECOND, 3, Quality.GOOD)
    assert held(ring) == [(5 * SECOND, 2, Quality.GOOD), (6 * SECOND, 3, Quality.GOOD)]
    assert (ring.first, ring.end) == (2, 4)


def image() -> Image:
    return Image(
        [
            Point(name="conveyor/fu1/actual/frequency", data_type=DataType.FLOAT),
            Point(name="conveyor/fu1/actual/value_1", data_type=DataType.UINT16),
            Point(name="conveyor/fu1/status/fault_text", data_type=DataType.STRING),
            Point(name="conveyor/node/nmt_state", data_type=DataType.UINT8),
            Point(name="bus/can0/load", data_type=DataType.FLOAT),
        ]
    )


@pytest.mark.parametrize(
    ("patterns", "places"),
    [
        (["*/*/actual/*"], [0, 1]),
        (["conveyor/fu?/actual/frequency", "bus/*/load"], [0, 4]),
        (["*/*"], []),
        (["*/*/nmt_state"], [3]),
        ([], []),
    ],
)
def test_a_star_stands_for_what_is_between_two_slashes(patterns: list[str], places: list[int]) -> None:
    assert chosen(image().points, patterns) == places


def test_changes_of_chosen_points_are_kept_from_the_first_value_on() -> None:
    points = image()
    rings = rings_of(points, "*/*/actual/frequency", "bus/*/load")
    every = list(range(5))
    rings.record(every)
    for place in every:
        points.set(place, points.points[place].data_type.zero, 2.0)
    rings.record([0, 1])
    rings.record(every[:2])  # as at the start: what is there, and then that it has changed
    points.judge([0], Quality.LOST, 3.0)
    rings.record([0])
    points.judge([0], Quality.WAITING, 4.0)
    rings.record([0])
    assert sorted(rings.rings) == [0, 4]
    assert held(rings.rings[0]) == [
        (2 * SECOND, 0.0, Quality.GOOD),
        (3 * SECOND, 0.0, Quality.LOST),
        (4 * SECOND, 0.0, Quality.WAITING),
    ]
    assert held(rings.rings[4]) == []


def test_a_value_of_another_type_spoils_no_other(caplog: pytest.LogCaptureFixture) -> None:
    points = image()
    rings = rings_of(points, "*/*/actual/*")
    points.set(1, "nonsense", 1.0)
    points.set(0, 5.0, 1.0)
    rings.record([1, 0])
    assert held(rings.rings[1]) == []
    assert held(rings.rings[0]) == [(SECOND, 5.0, Quality.GOOD)]
    assert "OPC UA history" in caplog.text


def test_all_rings_together_stay_within_their_size() -> None:
    names = [f"n/d{number}/actual/value" for number in range(100)]
    points = Image([Point(name=name, data_type=DataType.FLOAT) for name in names])
    rings = rings_of(points, "*/*/actual/*", samples_per_point=1_000_000, size_mb=1)
    tracemalloc.start()
    for number in range(3000):
        for ring in rings.rings.values():
            ring.append(number, float(number), Quality.GOOD)
    size, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    (capacity,) = {ring.end - ring.first for ring in rings.rings.values()}
    assert capacity == 1_000_000 // 100 // 17
    assert size < 1.25 * 1_000_000
    assert rings_of(points, "*/*/actual/*", samples_per_point=10).rings.keys() == rings.rings.keys()


def test_a_text_that_comes_again_takes_no_more_room() -> None:
    ring = ValueRing(DataType.STRING, 100)
    for time in range(2):
        ring.append(time, "".join(["over", "current"]), Quality.GOOD)
    assert ring.value(0) is ring.value(1)
    assert sys.getrefcount(ring.value(0)) > 2
