"""Trips, and the table around one; no server and no disk."""

from __future__ import annotations

import csv

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import Event, EventKind
from bridge.image import DataType, Point, Quality, Value
from bridge.northbound.opcua.history.black_box import Column, TripWatch, iso, places_by_drive, table
from bridge.northbound.opcua.history.value_rings import ValueRing
from bridge.uaserver.history.history import date_time

DRIVES = ("conveyor/fu1", "conveyor/fu2", "pump/drive")
SECOND = 1_000_000
NOON = 1_796_040_000 * SECOND


def event(kind: EventKind = EventKind.WATCHDOG, source: str = "conveyor/fu1", severity: int = 900) -> Event:
    return Event(0.0, kind, source, severity, "")


def due(watch: TripWatch, now: float) -> list[tuple[str, int]]:
    found: list[tuple[str, int]] = []
    while trip := watch.due(now):
        found.append((trip.drive, trip.time_us))
    return found


@pytest.mark.parametrize(
    ("told", "drives"),
    [
        (event(), ["conveyor/fu1"]),
        (event(severity=200), []),
        (event(EventKind.EMERGENCY, severity=700), ["conveyor/fu1"]),
        (event(EventKind.EMERGENCY, severity=100), []),
        (event(EventKind.NODE_LOST, "conveyor", 800), ["conveyor/fu1", "conveyor/fu2"]),
        (event(EventKind.NODE_BACK, "conveyor", 800), []),
        (event(EventKind.BUS, "can0", 900), []),
        (event(source="conv"), []),
        (event(source="bridge"), []),
    ],
)
def test_a_trip_is_of_a_drive_or_of_all_of_a_node(told: Event, drives: list[str]) -> None:
    watch = TripWatch(DRIVES, 5.0)
    watch.on_event(told, 7, 100.0)
    assert due(watch, 104.9) == []
    assert due(watch, 105.0) == [(drive, 7) for drive in drives]


def test_a_trip_that_follows_at_once_is_part_of_the_same_black_box() -> None:
    watch = TripWatch(DRIVES, 5.0)
    watch.on_event(event(), 1, 100.0)
    watch.on_event(event(), 2, 104.0)
    watch.on_event(event(source="pump/drive"), 3, 104.0)
    assert due(watch, 105.0) == [("conveyor/fu1", 1)]
    watch.on_event(event(), 4, 106.0)
    assert [trip.drive for trip in watch.rest()] == ["pump/drive", "conveyor/fu1"]
    assert watch.rest() == []


def column(name: str, data_type: DataType, samples: list[tuple[int, Value]], unit: str = "") -> Column:
    ring = ValueRing(data_type, 100)
    for time, value in samples:
        ring.append(time, value, Quality.DEAD if value == "dead" else Quality.GOOD)
    return Column(Point(name=name, data_type=data_type, unit=unit), ring.part(0, 10**18))


def read(content: bytes) -> list[dict[str, str]]:
    return list(csv.DictReader(content.decode("utf-8-sig").splitlines()))


def test_each_row_has_what_was_so_then() -> None:
    frequency = [(NOON - 9 * SECOND, 40.0), (NOON + 1500, 49.5)]
    text = [(NOON - SECOND, ""), (NOON + 1500, "Überstrom, 2 A"), (NOON + SECOND, "dead")]
    columns = [
        column("fu1/actual/frequency", DataType.FLOAT, frequency, "Hz"),
        column("fu1/status/fault_text", DataType.STRING, text),
        column("fu1/status/ready", DataType.BOOL, [(NOON - SECOND, True)]),
    ]
    rows = read(table(columns, NOON, NOON - 5 * SECOND))
    names = ["time", "seconds_from_trip", "fu1/actual/frequency [Hz]", "fu1/status/fault_text"]
    assert [[row[name] for name in names] for row in rows] == [
        ["2026-11-30T11:59:55.000Z", "-5.000", "40.0", ""],
        ["2026-11-30T11:59:59.000Z", "-1.000", "40.0", ""],
        ["2026-11-30T12:00:00.001Z", "0.002", "49.5", "Überstrom, 2 A"],
        ["2026-11-30T12:00:01.000Z", "1.000", "49.5", ""],
    ]
    assert [row["fu1/status/ready"] for row in rows] == ["", "1", "1", "1"]


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@SUM(A1)", "\tx"])
def test_no_text_of_a_drive_is_a_formula(text: str) -> None:
    (row,) = read(table([column("fault", DataType.STRING, [(NOON, text)])], NOON, NOON))
    assert row["fault"] == f"'{text}"


def test_a_number_below_zero_is_a_number() -> None:
    (row,) = read(table([column("torque", DataType.FLOAT, [(NOON, -1.5)])], NOON, NOON))
    assert row["torque"] == "-1.5"


def test_without_values_there_is_a_head() -> None:
    assert table([], NOON, NOON) == b"\xef\xbb\xbftime,seconds_from_trip\r\n"


@given(st.integers(0, 4 * 10**15))
def test_times_have_milliseconds(time_us: int) -> None:
    said = iso(date_time(time_us))
    assert said[-5:-1] == f".{time_us // 1000 % 1000:03d}"[-4:]
    assert len(said) == len("2026-11-29T18:10:00.123Z")


def test_points_are_those_of_their_drives() -> None:
    names = ("conveyor/fu1/a/x", "conveyor/fu2/a/x", "bus/can0/load", "conveyor/fu1/b/y")
    points = [Point(name=name, data_type=DataType.FLOAT) for name in names]
    found = places_by_drive(points, [0, 1, 2, 3], DRIVES)
    assert found == {"conveyor/fu1": [0, 3], "conveyor/fu2": [1], "pump/drive": []}
