"""Rings of the values of chosen points: what each has been lately, in memory.

A sample is a time, a quality and a value, each in an array of its kind: 17 bytes for a number of 8. A text
takes another eight, and the words themselves once, however often they come.
"""

from __future__ import annotations

import math
import sys
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from bridge.base.guard import Guard
from bridge.config import OpcUaHistoryTable, fits
from bridge.image import DataType, Image, Point, Quality, Value
from bridge.northbound.opcua.space.data_values import EpochNs, epoch_us, past_value
from bridge.uaserver.history.history import raw
from bridge.uaserver.library import ua

_TYPES: Final = {
    DataType.BOOL: "B",
    DataType.UINT8: "B",
    DataType.UINT16: "H",
    DataType.UINT32: "I",
    DataType.INT16: "h",
    DataType.INT32: "i",
    DataType.FLOAT: "d",
}
_HEAD_BYTES: Final = 9
"""Bytes of the time and the quality of a sample."""
_TEXT_BYTES: Final = 64
"""Bytes that a text counts for; few are longer, and most come again."""
_MB: Final = 1_000_000
_SET_BACK_US: Final = 1_000_000


def chosen(points: Sequence[Point], patterns: Sequence[str]) -> list[int]:
    """Places of the points with a name that fits one of ``patterns``."""
    return [place for place, point in enumerate(points) if any(fits(point.name, one) for one in patterns)]


@dataclass(frozen=True, slots=True)
class RingPart:
    """Samples of a ring, copied out of it."""

    times: Sequence[int]
    qualities: Sequence[int]
    values: Sequence[Value]
    is_bool: bool

    def samples(self) -> Iterator[tuple[int, Value | None]]:
        """Times in µs with the values, None where there is none."""
        for time_us, quality, value in zip(self.times, self.qualities, self.values, strict=True):
            has_value = Quality(quality).has_value
            yield time_us, (bool(value) if self.is_bool else value) if has_value else None


class ValueRing:
    """The newest samples of a point, ``capacity`` at most. A time that is a little earlier than the one
    before counts as that; a clock that was set back begins the history anew."""

    stepped = True

    def __init__(self, data_type: DataType, capacity: int) -> None:
        self.first = 0
        self.end = 0
        self.taken_at = -math.inf
        """Time of the latest sample as the image has it."""
        self._data_type = data_type
        self._capacity = capacity
        self._latest_us = 0
        self._times = array("q")
        self._qualities = array("B")
        code = _TYPES.get(data_type)
        self._values: array[int] | array[float] | list[Value] = array(code) if code else []

    def append(self, time_us: int, value: Value, quality: Quality) -> None:
        """Add a sample. Raises TypeError or OverflowError for a value that is not of the point's type."""
        if time_us < self._latest_us:
            if time_us < self._latest_us - _SET_BACK_US:
                self.first = self.end
            else:
                time_us = self._latest_us
        if isinstance(value, str):
            value = sys.intern(value)
        place = self.end % self._capacity
        if place < len(self._times):
            self._values[place] = value  # pyright: ignore[reportArgumentType, reportCallIssue]
            self._times[place] = time_us
            self._qualities[place] = quality
        else:
            self._values.append(value)  # pyright: ignore[reportArgumentType]
            self._times.append(time_us)
            self._qualities.append(quality)
        self._latest_us = time_us
        self.end += 1
        self.first = max(self.first, self.end - self._capacity)

    def is_latest(self, value: Value, quality: Quality) -> bool:
        return self.end > 0 and self.value(self.end - 1) == value and self.quality(self.end - 1) is quality

    def time_us(self, number: int) -> int:
        return self._times[number % self._capacity]

    def quality(self, number: int) -> Quality:
        return Quality(self._qualities[number % self._capacity])

    def value(self, number: int) -> Value:
        value = self._values[number % self._capacity]
        return bool(value) if self._data_type is DataType.BOOL else value

    def part(self, start_us: int, end_us: int) -> RingPart:
        """Samples from ``start_us`` to ``end_us``, and the one before them."""
        rest = raw(self, start_us, end_us + 1, bounds=False)
        at, stop = max(rest.at - 1, self.first), rest.stop
        low, high = at % self._capacity, at % self._capacity + max(stop - at, 0)
        # Behind the last place the ring goes on at its first.
        over = max(high - self._capacity, 0)
        times = self._times[low:high] + self._times[:over]
        qualities = self._qualities[low:high] + self._qualities[:over]
        values = [*self._values[low:high], *self._values[:over]]
        return RingPart(times, qualities, values, self._data_type is DataType.BOOL)

    def sample(self, number: int) -> ua.DataValue:
        value, quality = self.value(number), self.quality(number)
        return past_value(value, quality, self._data_type, self.time_us(number))


class ValueRings:
    """``rings`` by the places of their points in the image."""

    def __init__(self, image: Image, epoch_ns: EpochNs, settings: OpcUaHistoryTable) -> None:
        self._image = image
        self._epoch_ns = epoch_ns
        self._guard = Guard("OPC UA history")
        places = chosen(image.points, settings.points)
        types = {place: image.points[place].data_type for place in places}
        sample_bytes = sum(map(_sample_bytes, types.values())) or 1
        capacity = max(1, min(settings.samples_per_point, settings.size_mb * _MB // sample_bytes))
        self.rings: Mapping[int, ValueRing] = {
            place: ValueRing(kind, capacity) for place, kind in types.items()
        }

    def record(self, places: Sequence[int]) -> None:
        """Add the present values of these points, as far as they are chosen."""
        rings, image, epoch_ns = self.rings, self._image, self._epoch_ns
        # What changes together has the same time.
        known_at, time_us = -math.inf, 0
        for place in places:
            ring = rings.get(place)
            if ring is None:
                continue
            value, quality, time, _ = image[place]
            # What was there at the start is told as the first change once more.
            if time == ring.taken_at and ring.is_latest(value, quality):
                continue
            # Before the first value there is nothing, not even a time.
            if quality is not Quality.WAITING or ring.end:
                ring.taken_at = time
                if time != known_at:
                    known_at, time_us = time, epoch_us(epoch_ns(time))
                try:
                    ring.append(time_us, value, quality)
                except (TypeError, OverflowError) as error:
                    self._guard.note(error)


def _sample_bytes(kind: DataType) -> int:
    code = _TYPES.get(kind)
    return _HEAD_BYTES + (array(code).itemsize if code else _TEXT_BYTES)
