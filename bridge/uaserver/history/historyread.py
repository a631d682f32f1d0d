"""HistoryRead of one session, with its continuation points (OPC 10000-4 §5.10.3, OPC 10000-11 §6.4)."""

# asyncua's encoder has no types:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import asyncio
import secrets
import struct
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol

from asyncua.server.address_space import AddressSpace
from asyncua.ua.ua_binary import struct_to_binary

from bridge.uaserver import ranges
from bridge.uaserver.encoding import Results
from bridge.uaserver.filters.eventfilter import EventFilter, event_filter
from bridge.uaserver.hierarchy import EventTypes
from bridge.uaserver.history.history import (
    EventHistory,
    Rest,
    ValueHistory,
    raw,
    spanned,
    time_us,
    value_at,
    value_of,
)
from bridge.uaserver.library import (
    GOOD,
    ObjectIds,
    ServiceError,
    StatusCodes,
    extension,
    get,
    make,
    node_id,
    status,
    ua,
)
from bridge.uaserver.loop import loop_time
from bridge.uaserver.reading import Window, checked_times

MOST_NODES: Final = 100
MOST_CONTINUATION_POINTS: Final = 100
"""Limit for one session."""
MOST_VALUES: Final = 10_000
"""Values or events in one answer, of all its nodes together; the rest follows by continuation points."""

_TURN_S: Final = 0.002
_CHUNK: Final = 10
"""Values between two looks at the clock."""
_POINT_BYTES: Final = 8
_COUNT: Final = struct.Struct("<i")
_DATA: Final = node_id(ObjectIds.HistoryData_Encoding_DefaultBinary)
_EVENTS: Final = node_id(ObjectIds.HistoryEvent_Encoding_DefaultBinary)


class HistoryStore(Protocol):
    """Histories by their nodes."""

    def value_history(self, where: ua.NodeId) -> ValueHistory | None: ...

    def event_history(self, where: ua.NodeId) -> EventHistory | None: ...


@dataclass(frozen=True, slots=True)
class _Times:
    """Rest of a read of events: only those of these times."""

    rest: Rest
    low: int | None
    high: int | None

    def has(self, time: int) -> bool:
        return (self.low is None or time >= self.low) and (self.high is None or time < self.high)


@dataclass(frozen=True, slots=True)
class _ValuePoint:
    """Values of ``where`` that are still to be read, at most ``most`` in an answer (0: as many as fit)."""

    where: ua.NodeId
    rest: Rest
    most: int
    window: Window


@dataclass(frozen=True, slots=True)
class _EventPoint:
    """Events of ``where`` that are still to be read, at most ``most`` in an answer (0: as many as fit); with
    ``ends`` that is all of them."""

    where: ua.NodeId
    times: _Times
    most: int
    ends: bool
    filter: EventFilter


class _Pace:
    """Turns of one request: others have theirs where one has been long."""

    def __init__(self) -> None:
        self._turn_at = loop_time() + _TURN_S

    async def pause(self) -> None:
        if loop_time() >= self._turn_at:
            await asyncio.sleep(0)
            self._turn_at = loop_time() + _TURN_S


class _Share:
    """Part of an answer that one node may take: ``most`` values of about ``most_bytes``."""

    def __init__(self, most: int, most_bytes: int, pace: _Pace) -> None:
        self.encoded = bytearray()
        self.count = 0
        self.pause = pace.pause
        self._most = most
        self._most_bytes = most_bytes

    def left(self, limit: int) -> int:
        """Number of values that it still takes, of ``limit`` at most where that is not 0. It takes one in any
        case, so that every answer gets on."""
        if self.count and len(self.encoded) >= self._most_bytes:
            return 0
        return min(limit or self._most, self._most) - self.count

    def add(self, encoded: bytes) -> None:
        self.encoded += encoded
        self.count += 1

    def result(self, kind: ua.NodeId, point: bytes | None) -> ua.HistoryReadResult:
        body = _COUNT.pack(self.count) + self.encoded
        code = GOOD if self.count else status(StatusCodes.GoodNoData)
        held = extension(kind, body)
        return make(ua.HistoryReadResult, StatusCode=code, ContinuationPoint=point, HistoryData=held)


class HistoryReader:
    """HistoryRead for one session. ``types`` are the event types of its server."""

    def __init__(self, space: AddressSpace, types: EventTypes) -> None:
        self._space = space
        self._types = types
        self._points: dict[bytes, _ValuePoint | _EventPoint] = {}

    async def read(self, params: ua.HistoryReadParameters, store: HistoryStore, results: Results) -> None:
        """Raises ServiceError for what is wrong with the whole request."""
        wanted: list[ua.HistoryReadValueId] = get(params, "NodesToRead")
        if get(params, "ReleaseContinuationPoints"):
            for one in wanted:
                self._points.pop(get(one, "ContinuationPoint") or b"", None)
                await results.add(ua.HistoryReadResult())
            return
        read = _Read(get(params, "HistoryReadDetails"), checked_times(params), store, self._types)
        read.check(len(wanted))
        most = max(1, MOST_VALUES // len(wanted))
        most_bytes = results.most_bytes // 2 // len(wanted)
        pace = _Pace()
        for one in wanted:
            share = _Share(most, most_bytes, pace)
            try:
                result = await self._one(one, read, share)
            except ServiceError as error:
                result = make(ua.HistoryReadResult, StatusCode=status(int(error.code)))
            await results.add(result)

    async def _one(self, wanted: ua.HistoryReadValueId, read: _Read, share: _Share) -> ua.HistoryReadResult:
        where: ua.NodeId = get(wanted, "NodeId")
        given: bytes | None = get(wanted, "ContinuationPoint")
        if where not in self._space:
            raise ServiceError(StatusCodes.BadNodeIdUnknown)
        if isinstance(read.details, ua.ReadAtTimeDetails):
            await read.at_times(wanted, share)
            return share.result(_DATA, None)
        if given:
            begun = self._points.pop(given, None)
            if begun is None or begun.where != where:
                raise ServiceError(StatusCodes.BadContinuationPointInvalid)
        else:
            begun = read.begin(wanted)
        if isinstance(begun, _ValuePoint):
            kind, left = _DATA, await read.values(begun, share)
        else:
            kind, left = _EVENTS, await read.events(begun, share)
        return share.result(kind, self._keep(left) if left else None)

    def _keep(self, left: _ValuePoint | _EventPoint) -> bytes:
        if len(self._points) >= MOST_CONTINUATION_POINTS:
            raise ServiceError(StatusCodes.BadNoContinuationPoints)
        point = secrets.token_bytes(_POINT_BYTES)
        self._points[point] = left
        return point


@dataclass(frozen=True, slots=True)
class _Read:
    """One request: its details, and where they are carried out."""

    details: object
    times: ua.TimestampsToReturn
    store: HistoryStore
    types: EventTypes

    def check(self, nodes: int) -> None:
        """Raises ServiceError where no node could be read."""
        if self.times is ua.TimestampsToReturn.Neither:
            raise ServiceError(StatusCodes.BadTimestampsToReturnInvalid)
        at: Sequence[object] = getattr(self.details, "ReqTimes", None) or ()
        if nodes * len(at) > MOST_VALUES:
            raise ServiceError(StatusCodes.BadTooManyOperations)

    def begin(self, wanted: ua.HistoryReadValueId) -> _ValuePoint | _EventPoint:
        """Whole read of one node. From one time on it is a number, and ends with it (Part 11 §6.5.3.2)."""
        where: ua.NodeId = get(wanted, "NodeId")
        details = self.details
        if isinstance(details, ua.ReadRawModifiedDetails) and not get(details, "IsReadModified"):
            kept, window = self._values_of(wanted)
            start, end = spanned(details)
            rest = raw(kept, start, end, bounds=get(details, "ReturnBounds"))
            most = get(details, "NumValuesPerNode")
            if start is None or end is None:
                rest = rest.limited(most)
            return _ValuePoint(where, rest, most, window)
        if isinstance(details, ua.ReadEventDetails):
            kept = self._events_of(where)
            filter_ = event_filter(get(details, "Filter"), self.types)
            start, end = spanned(details)
            times = _event_times(kept, start, end)
            ends = start is None or end is None
            return _EventPoint(where, times, get(details, "NumValuesPerNode"), ends, filter_)
        raise ServiceError(StatusCodes.BadHistoryOperationUnsupported)

    async def values(self, begun: _ValuePoint, share: _Share) -> _ValuePoint | None:
        """Encode the next values; what is left then."""
        kept = self.store.value_history(begun.where)
        if kept is None:
            raise ServiceError(StatusCodes.BadHistoryOperationUnsupported)
        rest = begun.rest
        while not rest.is_empty and share.left(begun.most):
            taken, rest = rest.within(kept).take(min(_CHUNK, share.left(begun.most)))
            for one in taken:
                share.add(_encoded(begun.window, value_of(kept, one)))
            await share.pause()
        return None if rest.is_empty else replace(begun, rest=rest)

    async def events(self, begun: _EventPoint, share: _Share) -> _EventPoint | None:
        """Encode the next events that pass the filter; what is left then begins with one that does."""
        kept, times = self._events_of(begun.where), begun.times
        for number in times.rest.within(kept).numbers:
            await share.pause()
            # It may have been forgotten meanwhile.
            if number < kept.first or not times.has(kept.time_us(number)):
                continue
            found = kept.event(number)
            if found is None or not begun.filter.passes(found):
                continue
            if not share.left(begun.most):
                most = begun.most - share.count if begun.ends else begun.most
                if begun.ends and not most:
                    return None
                return replace(begun, times=replace(times, rest=replace(times.rest, at=number)), most=most)
            fields = make(ua.HistoryEventFieldList, EventFields=begun.filter.fields(found))
            share.add(struct_to_binary(fields))
        return None

    async def at_times(self, wanted: ua.HistoryReadValueId, share: _Share) -> None:
        kept, window = self._values_of(wanted)
        simple: bool = get(self.details, "UseSimpleBounds")
        now_us = time.time_ns() // 1000
        asked: list[Any] = get(self.details, "ReqTimes") or []
        if not asked:
            raise ServiceError(StatusCodes.BadHistoryOperationInvalid)
        for one in asked:
            at = time_us(one)
            if at is None:
                raise ServiceError(StatusCodes.BadInvalidTimestamp)
            share.add(_encoded(window, value_at(kept, at, now_us, simple=simple)))
            await share.pause()

    def _values_of(self, wanted: ua.HistoryReadValueId) -> tuple[ValueHistory, Window]:
        kept = self.store.value_history(get(wanted, "NodeId"))
        if kept is None:
            raise ServiceError(StatusCodes.BadHistoryOperationUnsupported)
        if self.times is ua.TimestampsToReturn.Server:
            raise ServiceError(StatusCodes.BadTimestampNotSupported)
        try:
            found = ranges.parse(get(wanted, "IndexRange"))
        except ValueError:
            raise ServiceError(StatusCodes.BadIndexRangeInvalid) from None
        return kept, Window(found, source=True, server=False)

    def _events_of(self, where: ua.NodeId) -> EventHistory:
        kept = self.store.event_history(where)
        if kept is None:
            raise ServiceError(StatusCodes.BadHistoryOperationUnsupported)
        return kept


def _event_times(kept: EventHistory, start: int | None, end: int | None) -> _Times:
    if start is None or (end is not None and end < start):
        rest = Rest(kept.end - 1, kept.first - 1, -1)
        # From the one time down to the other, which is not part of it.
        low = None if end is None or start is None else end + 1
        high = end if start is None else start
        return _Times(rest, low, None if high is None else high + 1)
    return _Times(Rest(kept.first, kept.end, 1), start, end if end != start else start + 1)


def _encoded(window: Window, value: ua.DataValue) -> bytes:
    return struct_to_binary(window.timed(window.part(value)))
