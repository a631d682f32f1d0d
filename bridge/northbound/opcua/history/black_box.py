"""Black box of a drive: its values around a trip, as a table for people and their spreadsheets."""

from __future__ import annotations

import csv
import io
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import groupby
from typing import Final

from bridge.command import Event, EventKind
from bridge.image import Point, Value
from bridge.northbound.opcua.history.value_rings import RingPart
from bridge.uaserver.history.history import date_time

_TRIPS: Final = {EventKind.WATCHDOG: 700, EventKind.EMERGENCY: 500, EventKind.NODE_LOST: 800}
"""Least severity of the events that are trips, by their kind. Where a bus goes down its nodes are lost."""
_MOST_WAITING: Final = 1000
_MOST_ROWS: Final = 50_000
_FORMULA: Final = ("=", "+", "-", "@", "\t", "\r")
"""Beginnings of what a spreadsheet would take for a formula."""


@dataclass(frozen=True, slots=True)
class Trip:
    """A trip of a drive, of which the black box is due at ``due`` on the clock of the process."""

    drive: str
    time_us: int
    due: float


class TripWatch:
    """Trips of ``drives`` that wait for what comes ``after_s`` after them. Of a drive whose black box is not
    closed yet, another trip is part of that."""

    def __init__(self, drives: Sequence[str], after_s: float) -> None:
        self._drives = drives
        self._after_s = after_s
        self._waiting: deque[Trip] = deque(maxlen=_MOST_WAITING)

    def on_event(self, event: Event, time_us: int, now: float) -> None:
        least = _TRIPS.get(event.kind)
        if least is None or event.severity < least:
            return
        waiting = {trip.drive for trip in self._waiting}
        for drive in self._drives:
            is_meant = drive == event.source or drive.startswith(f"{event.source}/")
            if is_meant and drive not in waiting:
                self._waiting.append(Trip(drive, time_us, now + self._after_s))

    def due(self, now: float) -> Trip | None:
        """The next trip whose time has come."""
        if self._waiting and self._waiting[0].due <= now:
            return self._waiting.popleft()
        return None

    def rest(self) -> list[Trip]:
        """All that wait, whether their time has come or not."""
        left = list(self._waiting)
        self._waiting.clear()
        return left


@dataclass(frozen=True, slots=True)
class Column:
    """Samples of one point."""

    point: Point
    part: RingPart

    @property
    def title(self) -> str:
        return f"{self.point.name} [{self.point.unit}]" if self.point.unit else self.point.name


def table(columns: Sequence[Column], trip_us: int, start_us: int) -> bytes:
    """CSV (RFC 4180) in UTF-8 with a byte order mark, without which Excel takes it for something else: a row
    for each time at which something has changed, with all values that there are then."""
    out = io.StringIO(newline="")
    writer = csv.writer(out)
    writer.writerow(["time", "seconds_from_trip", *(column.title for column in columns)])
    writer.writerows(deque(_rows(columns, trip_us, start_us), maxlen=_MOST_ROWS))
    return out.getvalue().encode("utf-8-sig")


def _rows(columns: Sequence[Column], trip_us: int, start_us: int) -> Iterator[list[object]]:
    row: list[object] = [""] * len(columns)
    for time_us, changes in groupby(_changes(columns, start_us), key=lambda change: change[0]):
        for _, place, value in changes:
            row[place] = "" if value is None else _cell(value)
        yield [iso(date_time(time_us)), f"{(time_us - trip_us) / 1e6:.3f}", *row]


def _changes(columns: Sequence[Column], start_us: int) -> list[tuple[int, int, Value | None]]:
    """Times, places and values of all columns in the order of time; what was so before ``start_us`` has that
    time."""
    found = [
        (max(time_us, start_us), place, value)
        for place, column in enumerate(columns)
        for time_us, value in column.part.samples()
    ]
    return sorted(found, key=lambda change: change[0])


def _cell(value: Value) -> object:
    if isinstance(value, bool):
        return int(value)
    if isinstance(value, str) and value.startswith(_FORMULA):
        return f"'{value}"
    return value


def iso(time: datetime) -> str:
    """ISO 8601, UTC, with milliseconds."""
    return f"{time:%Y-%m-%dT%H:%M:%S}.{time.microsecond // 1000:03d}Z"


def places_by_drive(
    points: Sequence[Point], places: Sequence[int], drives: Sequence[str]
) -> Mapping[str, list[int]]:
    """The ``places`` of each drive's points, by its name."""
    found: dict[str, list[int]] = {drive: [] for drive in drives}
    for place in places:
        drive = "/".join(points[place].path[:2])
        if drive in found:
            found[drive].append(place)
    return found
