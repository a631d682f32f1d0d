"""Readings as DataValues, values of clients as values of points, outcomes as status codes."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from functools import lru_cache
from typing import Any, Final

from bridge.command import Rejection
from bridge.command.messages.request import Code, Identity, Outcome
from bridge.image import DataType, Image, Point, Quality, Reading, Value
from bridge.text import Text
from bridge.uaserver.history.history import date_time
from bridge.uaserver.library import GOOD, StatusCodes, status, ua, variant

EpochNs = Callable[[float], int]

# The contract's table. A Bad status has no value in OPC UA; the Uncertain ones keep the last one.
QUALITY_STATUS: Final = {
    Quality.WAITING: status(StatusCodes.BadWaitingForInitialData),
    Quality.GOOD: GOOD,
    Quality.STALE: status(StatusCodes.UncertainLastUsableValue),
    Quality.LOST: status(StatusCodes.UncertainNoCommunicationLastUsableValue),
    Quality.DEAD: status(StatusCodes.BadNoCommunication),
    Quality.DEVICE_FAULT: status(StatusCodes.BadDeviceFailure),
    Quality.DISABLED: status(StatusCodes.BadOutOfService),
    Quality.CONFIG_ERROR: status(StatusCodes.BadConfigurationError),
}

OUTCOME_STATUS: Final = {
    Code.OK: StatusCodes.Good,
    Code.UNKNOWN_TARGET: StatusCodes.BadNodeIdUnknown,
    Code.UNKNOWN_POINT: StatusCodes.BadNodeIdUnknown,
    Code.READ_ONLY: StatusCodes.BadNotWritable,
    Code.OUT_OF_RANGE: StatusCodes.BadOutOfRange,
    Code.NOT_VALID: StatusCodes.BadOutOfRange,
    Code.NOT_ALLOWED: StatusCodes.BadUserAccessDenied,
    Code.ACKNOWLEDGE_FIRST: StatusCodes.BadInvalidState,
    Code.NOT_READY: StatusCodes.BadNoCommunication,
    Code.NOT_CONFIGURED: StatusCodes.BadConfigurationError,
    Code.STALE: StatusCodes.BadTimeout,
    Code.TIMED_OUT: StatusCodes.BadTimeout,
    Code.CANCELLED: StatusCodes.BadRequestCancelledByRequest,
    Code.UNKNOWN_PARAMETER: StatusCodes.BadNodeIdUnknown,
    Code.WRITE_ONLY: StatusCodes.BadNotReadable,
    Code.BUSY: StatusCodes.BadResourceUnavailable,
    Code.OTHER_VALUE: StatusCodes.BadInvalidState,
    Code.TOO_OFTEN: StatusCodes.BadRequestNotAllowed,
    Code.REFUSED_BY_DRIVE: StatusCodes.BadDeviceFailure,
}

_REJECTION_CODE: Final = {
    StatusCodes.BadNodeIdUnknown: Code.UNKNOWN_POINT,
    StatusCodes.BadAttributeIdInvalid: Code.UNKNOWN_POINT,
    StatusCodes.BadMethodInvalid: Code.UNKNOWN_POINT,
    StatusCodes.BadNotWritable: Code.READ_ONLY,
    StatusCodes.BadNotExecutable: Code.NOT_CONFIGURED,
    StatusCodes.BadOutOfRange: Code.OUT_OF_RANGE,
    StatusCodes.BadUserAccessDenied: Code.NOT_ALLOWED,
}
"""Outcomes for what the server itself refuses, by status code; every other code is ``NOT_VALID``."""
_LONGEST: Final = 200

VARIANT_TYPE: Final = {
    DataType.BOOL: ua.VariantType.Boolean,
    DataType.UINT8: ua.VariantType.Byte,
    DataType.UINT16: ua.VariantType.UInt16,
    DataType.UINT32: ua.VariantType.UInt32,
    DataType.INT16: ua.VariantType.Int16,
    DataType.INT32: ua.VariantType.Int32,
    # Double: fault numbers such as 10.3 would read 10.300000190734863 as Float.
    DataType.FLOAT: ua.VariantType.Double,
    DataType.STRING: ua.VariantType.String,
}

INTEGER_TYPES: Final = frozenset(
    (
        ua.VariantType.SByte,
        ua.VariantType.Byte,
        ua.VariantType.Int16,
        ua.VariantType.UInt16,
        ua.VariantType.Int32,
        ua.VariantType.UInt32,
        ua.VariantType.Int64,
        ua.VariantType.UInt64,
    )
)
_NUMBER_TYPES: Final = INTEGER_TYPES | {ua.VariantType.Float, ua.VariantType.Double}
_new: Final = object.__new__
_NO_VALUE: Final = variant(None, ua.VariantType.Null)
_BITS: Final = (
    variant(False, ua.VariantType.Boolean),
    variant(True, ua.VariantType.Boolean),
)


ABORT_STATUS: Final = {
    0x0601_0001: StatusCodes.BadNotReadable,
    0x0601_0002: StatusCodes.BadNotWritable,
    0x0602_0000: StatusCodes.BadNotFound,
    0x0609_0011: StatusCodes.BadNotFound,
    0x0609_0030: StatusCodes.BadOutOfRange,
    0x0609_0031: StatusCodes.BadOutOfRange,
    0x0609_0032: StatusCodes.BadOutOfRange,
    0x0800_0021: StatusCodes.BadInvalidState,
    0x0800_0022: StatusCodes.BadInvalidState,
}
"""Status codes by SDO abort code, where OPC UA has one that fits."""


def outcome_status(outcome: Outcome) -> ua.StatusCode:
    code = OUTCOME_STATUS[outcome.code]
    if outcome.code is Code.REFUSED_BY_DRIVE:
        code = ABORT_STATUS.get(outcome.abort_code, code)
    return status(code)


def rejection(
    identity: Identity, target: str, action: str, code: int, values: Mapping[str, Value]
) -> Rejection:
    """Entry of the audit log: a write or call that the server has answered with ``code`` by itself. Names and
    texts, which are the client's, are cut."""
    ending = _REJECTION_CODE.get(code, Code.NOT_VALID)
    shown = {name[:_LONGEST]: _cut(value) for name, value in values.items()}
    return Rejection(identity, target[:_LONGEST], action, ending, Text.plain(status(code).name), shown)


def _cut(value: Value) -> Value:
    return value[:_LONGEST] if isinstance(value, str) else value


@lru_cache(maxsize=256)
def source_time(epoch_ns: int) -> datetime:
    """A time in ns since 1970 as OPC UA's DateTime, to the microsecond. What changes together has the
    same."""
    return date_time(epoch_us(epoch_ns))


def epoch_us(epoch_ns: int) -> int:
    """A time in ns since 1970 in µs."""
    return (epoch_ns + 500) // 1000


@lru_cache(maxsize=2)
def _server_time(epoch_ms: int) -> datetime:
    """A time that all have which are looked at together."""
    return datetime.fromtimestamp(epoch_ms / 1000, UTC)


def _scalar(value: object, kind: ua.VariantType) -> ua.Variant:
    """A single value of this type. asyncua's constructor, which finds out what it is given, takes as long as
    all else that is done for a value that has changed."""
    made = _new(ua.Variant)
    made.Value, made.VariantType, made.is_array, made.Dimensions = value, kind, False, None
    return made


def _stamped(
    value: ua.Variant, code: ua.StatusCode, source: datetime | None, server: datetime | None
) -> ua.DataValue:
    """A DataValue, made as ``_scalar`` makes values."""
    made: Any = _new(ua.DataValue)
    made.Encoding, made.Value, made.StatusCode = 0, value, code
    made.SourceTimestamp, made.ServerTimestamp = source, server
    made.SourcePicoseconds = made.ServerPicoseconds = None
    return made


def reading_value(
    reading: Reading, variant_type: ua.VariantType, epoch_ns: int, bit: int | None = None
) -> ua.DataValue:
    """``reading`` for a client, or with ``bit`` that bit of it. The server's time is now, in milliseconds."""
    quality = reading.quality
    code = QUALITY_STATUS[quality]
    if code.is_bad():
        value = _NO_VALUE
    elif bit is None:
        value = _scalar(reading.value, variant_type)
    else:
        value = _BITS[int(reading.value) >> bit & 1]
    # A point that has never had a value has no source time either.
    stamp = None if quality is Quality.WAITING else source_time(epoch_ns)
    return _stamped(value, code, stamp, _server_time(int(time.time() * 1000)))


def past_value(value: Value, quality: Quality, data_type: DataType, time_us: int) -> ua.DataValue:
    """A former value of a point of this type, as ``reading_value`` tells the present one; without a server's
    time."""
    code = QUALITY_STATUS[quality]
    held = _NO_VALUE if code.is_bad() else _scalar(value, VARIANT_TYPE[data_type])
    return _stamped(held, code, date_time(time_us), None)


def present_value(
    image: Image, index: int, variant_type: ua.VariantType, epoch_ns: EpochNs, bit: int | None = None
) -> ua.DataValue:
    """The present reading of a point."""
    reading = image[index]
    return reading_value(reading, variant_type, epoch_ns(reading.time), bit)


def point_value(point: Point, written: ua.Variant) -> Value:
    """Value of a point for what a client wrote.

    Raises TypeError for a type that does not fit, ValueError for a number that is none (NaN, infinity).

    Any integer type is taken for an integer point and any number for a float point; whether the
    number is in range is for the drive's channel to say.
    """
    kind = written.VariantType
    value = written.Value
    if written.is_array or written.Dimensions or value is None:
        raise TypeError(f"{point.name} takes a single value")
    if point.data_type is DataType.STRING:
        fits = kind is ua.VariantType.String
    elif point.data_type is DataType.BOOL:
        fits = kind is ua.VariantType.Boolean
    elif point.data_type is DataType.FLOAT:
        fits = kind in _NUMBER_TYPES
    else:
        fits = kind in INTEGER_TYPES
    if not fits:
        raise TypeError(f"{point.name} does not take {kind.name} {value}")
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{point.name} does not take {value}")
    return value


def plain_value(written: ua.Variant) -> Value:
    """A single number, text, true or false, of whatever type. Raises TypeError for anything else."""
    kind, value = written.VariantType, written.Value
    fits = kind in _NUMBER_TYPES or kind in (ua.VariantType.String, ua.VariantType.Boolean)
    if written.is_array or written.Dimensions or value is None or not fits:
        raise TypeError("takes a single number, text, true or false")
    return value


def plain_variant(value: Value) -> ua.Variant:
    """The value of a parameter: Boolean, Int64, Double or String."""
    if isinstance(value, bool):
        return variant(value, ua.VariantType.Boolean)
    if isinstance(value, int):
        return variant(value, ua.VariantType.Int64)
    return variant(value, ua.VariantType.Double if isinstance(value, float) else ua.VariantType.String)
