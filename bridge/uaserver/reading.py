"""Part of an attribute that a client reads: range of the value, and time stamps."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Final

from bridge.uaserver import ranges
from bridge.uaserver.library import (
    AttributeIds,
    ServiceError,
    StatusCodes,
    data_value,
    get,
    status,
    ua,
    variant,
)

_SOURCE: Final = (ua.TimestampsToReturn.Source, ua.TimestampsToReturn.Both)
_SERVER: Final = (ua.TimestampsToReturn.Server, ua.TimestampsToReturn.Both)
_BOOLEANS: Final = (False, True)
_NO_DATA: Final = status(StatusCodes.BadIndexRangeNoData)
_NOTHING: Final = variant(None, ua.VariantType.Null)


@dataclass(frozen=True, slots=True)
class Window:
    """``source`` and ``server`` are the times that are wanted."""

    ranges: ranges.Ranges
    source: bool
    server: bool

    def part(self, value: ua.DataValue) -> ua.DataValue:
        """``value`` with nothing but the part that is wanted. A status without a value stays."""
        if not self.ranges or _is_bad(value):
            return value
        taken = ranges.part(self.ranges, value.Value)
        code = value.StatusCode if taken is not None else _NO_DATA
        return data_value(taken or _NOTHING, code, value.SourceTimestamp, value.ServerTimestamp)

    def timed(self, value: ua.DataValue) -> ua.DataValue:
        """``value`` with the times that are wanted and no others."""
        source = value.SourceTimestamp if self.source else None
        server = (value.ServerTimestamp or datetime.now(UTC)) if self.server else None
        if source is value.SourceTimestamp and server is value.ServerTimestamp:
            return value
        return data_value(value.Value, value.StatusCode, source, server)


_WHOLE: Final = {(source, server): Window((), source, server) for source in _BOOLEANS for server in _BOOLEANS}


def window(wanted: ua.ReadValueId, times: ua.TimestampsToReturn) -> Window:
    """Raises ServiceError for a range that is none."""
    try:
        found = ranges.parse(get(wanted, "IndexRange"))
    except ValueError:
        raise ServiceError(StatusCodes.BadIndexRangeInvalid) from None
    return window_of(found, get(wanted, "AttributeId"), times)


def window_of(found: ranges.Ranges, attribute: AttributeIds, times: ua.TimestampsToReturn) -> Window:
    # Part 4 §7.11: only values have a source time.
    source = times in _SOURCE and attribute == AttributeIds.Value
    server = times in _SERVER
    return Window(found, source, server) if found else _WHOLE[source, server]


def checked_times(params: object) -> ua.TimestampsToReturn:
    """``TimestampsToReturn`` of a request. Raises ServiceError for one that says nothing."""
    times: ua.TimestampsToReturn = get(params, "TimestampsToReturn")
    if times is ua.TimestampsToReturn.Invalid:
        raise ServiceError(StatusCodes.BadTimestampsToReturnInvalid)
    return times


def _is_bad(value: ua.DataValue) -> bool:
    return value.StatusCode is not None and value.StatusCode.is_bad()
