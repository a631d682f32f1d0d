"""Raw and interpolated reads of a history that is kept in order (OPC 10000-11 §6.4.3 and §6.4.5).

What is kept has numbers, in the order in which it came: a ring forgets from ``first`` on and grows at
``end``, and a read that goes on later still finds its place. Times are µs since 1970 UTC.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from typing import Final, Protocol

from bridge.uaserver.filters.eventfilter import Occurrence
from bridge.uaserver.library import ServiceError, StatusCodes, data_value, get, status, ua, variant

_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_NONE_BEFORE: Final = datetime(1601, 1, 2, tzinfo=UTC)
"""A DateTime of 0, which is the beginning of 1601, is none (Part 6 §5.2.2.5)."""
_US: Final = timedelta(microseconds=1)
_LATEST_US: Final = (datetime(9999, 12, 31, tzinfo=UTC) - _EPOCH) // _US
_SECOND_US: Final = 1_000_000

_INTERPOLATED: Final = 0x0402
"""InfoType DataValue and the bit Interpolated of a status code (Part 4 §7.39.1)."""
_SEVERITY: Final = 0xC000_0000
_FARTHEST: Final = 100
"""Samples that are looked through for a good one on either side of a time."""
_NOTHING: Final = variant(None, ua.VariantType.Null)


class Kept(Protocol):
    """History of one node. ``first`` is the number of the oldest, ``end`` that after the newest."""

    @property
    def first(self) -> int: ...

    @property
    def end(self) -> int: ...

    def time_us(self, number: int) -> int: ...


class ValueHistory(Kept, Protocol):
    """Samples of a variable, none earlier than the one before. ``stepped``: between two of them the value was
    that of the first; else it changed steadily."""

    @property
    def stepped(self) -> bool: ...

    def sample(self, number: int) -> ua.DataValue: ...


class EventHistory(Kept, Protocol):
    """Events told by one object and others, as they came. Their times are in order unless the clock was
    set."""

    def event(self, number: int) -> Occurrence | None:
        """The event; None where another object has told it."""
        ...


@dataclass(frozen=True, slots=True)
class Bound:
    """Bounding value that is asked for and not there."""

    time_us: int


@dataclass(frozen=True, slots=True)
class Rest:
    """Part of a history that is still to be read: the numbers from ``at`` by ``step`` (1 or -1) to ``stop``,
    which is not part of it. ``before`` and ``after`` are bounds that are not there."""

    at: int
    stop: int
    step: int
    before: Bound | None = None
    after: Bound | None = None

    @property
    def is_empty(self) -> bool:
        return self.before is None and self.after is None and not self.numbers

    @property
    def numbers(self) -> range:
        return range(self.at, self.stop, self.step)

    def take(self, most: int) -> tuple[list[int | Bound], Rest]:
        """At most this many, and what is left then."""
        if most <= 0:
            return [], self
        taken: list[int | Bound] = [self.before] if self.before else []
        numbers = self.numbers[: most - len(taken)]
        taken += numbers
        left = replace(self, at=self.at + len(numbers) * self.step, before=None)
        if left.after and not left.numbers and len(taken) < most:
            taken.append(left.after)
            left = replace(left, after=None)
        return taken, left

    def limited(self, most: int) -> Rest:
        """The first ``most``, at least one, and nothing after them."""
        count = min(len(self.numbers), most - (self.before is not None))
        has_room = count + (self.before is not None) < most
        return replace(self, stop=self.at + count * self.step, after=self.after if has_room else None)

    def within(self, kept: Kept) -> Rest:
        """The same without what is no longer kept. Raises ServiceError where what comes next is not."""
        if self.numbers and self.at < kept.first:
            raise ServiceError(StatusCodes.BadContinuationPointInvalid)
        if self.step < 0:
            return replace(self, stop=max(self.stop, kept.first - 1))
        return self


def time_us(time: datetime) -> int | None:
    """A time of a request; None for one that is not given."""
    if time.tzinfo is None:
        time = time.replace(tzinfo=UTC)
    return None if time < _NONE_BEFORE else (time - _EPOCH) // _US


def date_time(us: int) -> datetime:
    return _EPOCH + timedelta(microseconds=min(us, _LATEST_US))


def spanned(details: object) -> tuple[int | None, int | None]:
    """Start and end of a read. Raises ServiceError where too little is given to know what is meant."""
    start, end = time_us(get(details, "StartTime")), time_us(get(details, "EndTime"))
    missing = (start is None) + (end is None) + (get(details, "NumValuesPerNode") == 0)
    if missing > 1:
        raise ServiceError(StatusCodes.BadHistoryOperationInvalid)
    return start, end


def raw(kept: Kept, start: int | None, end: int | None, *, bounds: bool) -> Rest:
    """Samples from ``start`` on and before ``end``; backwards where the end is earlier, or there is no start.
    At least one of the two is given."""
    if start is None or (end is not None and end < start):
        origin, limit = (end, None) if start is None else (start, end)
        assert origin is not None
        return _backwards(kept, origin, limit, bounds=bounds)
    return _forwards(kept, start, end, bounds=bounds)


def _forwards(kept: Kept, start: int, end: int | None, *, bounds: bool) -> Rest:
    at = _earliest(kept, start)
    # Of an instant all that is there; of a time with an end what is before that.
    stop = kept.end if end is None else _earliest(kept, end + (start == end))
    if not bounds:
        return Rest(at, stop, 1)
    before = after = None
    if at == kept.end or kept.time_us(at) != start:
        before, at = (None, at - 1) if at > kept.first else (Bound(start), at)
    if end is None:
        latest = kept.time_us(kept.end - 1) if kept.end > kept.first else start
        after = Bound(max(latest, start) + _SECOND_US)
    elif not (start == end and stop > kept.first and kept.time_us(stop - 1) == end):
        after, stop = (None, stop + 1) if stop < kept.end else (Bound(end), stop)
    return Rest(at, stop, 1, before, after)


def _backwards(kept: Kept, start: int, end: int | None, *, bounds: bool) -> Rest:
    at = _earliest(kept, start + 1) - 1
    stop = kept.first - 1 if end is None else _earliest(kept, end + 1) - 1
    if not bounds:
        return Rest(at, stop, -1)
    before = after = None
    if at < kept.first or kept.time_us(at) != start:
        before, at = (None, at + 1) if at + 1 < kept.end else (Bound(start), at)
    if end is None:
        earliest = kept.time_us(kept.first) if kept.end > kept.first else start
        after = Bound(min(earliest, start) - _SECOND_US)
    else:
        after, stop = (None, stop - 1) if stop >= kept.first else (Bound(end), stop)
    return Rest(at, stop, -1, before, after)


def _earliest(kept: Kept, time: int) -> int:
    """Number of the first sample that is not before this time; ``end`` where all are."""
    low, high = kept.first, kept.end
    while low < high:
        middle = (low + high) // 2
        if kept.time_us(middle) < time:
            low = middle + 1
        else:
            high = middle
    return low


def value_of(kept: ValueHistory, one: int | Bound) -> ua.DataValue:
    if isinstance(one, Bound):
        return _empty(StatusCodes.BadBoundNotFound, one.time_us)
    return kept.sample(one)


def value_at(kept: ValueHistory, time: int, now_us: int, *, simple: bool) -> ua.DataValue:
    """The value at a time: that of the sample then, or what its neighbours come to (Part 13 §3.1).
    ``simple``: these are the nearest; else the nearest good ones, and UncertainDataSubNormal says that others
    lie between.

    After the newest sample the value is still the same; of times to come there is none.
    """
    after = _earliest(kept, time)
    if after < kept.end and kept.time_us(after) == time:
        return kept.sample(after)
    before, skipped = _good(kept, after - 1, -1, simple=simple)
    if before is None or time > now_us or _is_bad(before):
        return _empty(StatusCodes.BadNoData, time)
    code = StatusCodes.UncertainDataSubNormal if skipped or not _is_good(before) else StatusCodes.Good
    value = before.Value
    if after == kept.end:
        code = StatusCodes.UncertainDataSubNormal
    elif not kept.stepped:
        following, passed = _good(kept, after, 1, simple=simple)
        between = _between(before, following, time) if following else None
        if passed or between is None or not (following and _is_good(following)):
            code = StatusCodes.UncertainDataSubNormal
        value = between or value
    return data_value(value, status(code | _INTERPOLATED), date_time(time))


def _good(kept: ValueHistory, at: int, step: int, *, simple: bool) -> tuple[ua.DataValue | None, bool]:
    """The nearest sample from ``at`` on, or the nearest good one, and whether others were passed over."""
    for distance in range(1 if simple else _FARTHEST):
        number = at + distance * step
        if not kept.first <= number < kept.end:
            break
        found = kept.sample(number)
        if simple or _is_good(found):
            return found, distance > 0
    return None, False


def _between(before: ua.DataValue, after: ua.DataValue, time: int) -> ua.Variant | None:
    """On the straight line; None where one of them is no number."""
    first, second = before.Value, after.Value
    begin, finish = before.SourceTimestamp, after.SourceTimestamp
    if first is None or second is None or begin is None or finish is None or _is_bad(after):
        return None
    if not (_is_number(first.Value) and _is_number(second.Value)):
        return None
    part = (date_time(time) - begin) / (finish - begin)
    value = first.Value + part * (second.Value - first.Value)
    is_float = isinstance(first.Value, float)
    return variant(value if is_float else round(value), first.VariantType)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_good(value: ua.DataValue) -> bool:
    return not _code(value) & _SEVERITY


def _is_bad(value: ua.DataValue) -> bool:
    return value.StatusCode is not None and value.StatusCode.is_bad()


def _code(value: ua.DataValue) -> int:
    return value.StatusCode.value if value.StatusCode else StatusCodes.Good


def _empty(code: int, time: int) -> ua.DataValue:
    return data_value(_NOTHING, status(code), date_time(time))
