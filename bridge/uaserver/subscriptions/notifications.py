"""Notifications of changed values on the wire (OPC 10000-4 §7.25.2, OPC 10000-6 §5.2).

asyncua's encoder asks each structure for its fields. Of all that the server tells, values that change are
most, and nearly all are single numbers: these are packed at once. Whatever else there is, asyncua encodes.
"""

# asyncua's encoder has no types:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from functools import cache, lru_cache
from typing import Final

from asyncua.ua.ua_binary import struct_to_binary

from bridge.uaserver.encoding import UNSENDABLE
from bridge.uaserver.library import (
    ObjectIds,
    StatusCodes,
    data_value,
    extension,
    node_id,
    notification,
    status,
    ua,
)

_CHANGES: Final = node_id(ObjectIds.DataChangeNotification_Encoding_DefaultBinary)
_LENGTH: Final = struct.Struct("<i")
_NO_DIAGNOSTICS: Final = _LENGTH.pack(0)

_FORMATS: Final = {
    ua.VariantType.Boolean: "?",
    ua.VariantType.SByte: "b",
    ua.VariantType.Byte: "B",
    ua.VariantType.Int16: "h",
    ua.VariantType.UInt16: "H",
    ua.VariantType.Int32: "i",
    ua.VariantType.UInt32: "I",
    ua.VariantType.Int64: "q",
    ua.VariantType.UInt64: "Q",
    ua.VariantType.Float: "f",
    ua.VariantType.Double: "d",
}
_HAS_VALUE, _HAS_STATUS, _HAS_SOURCE, _HAS_SERVER = 0x01, 0x02, 0x04, 0x08
_FIELDS: Final = ((_HAS_STATUS, "I"), (_HAS_SOURCE, "q"), (_HAS_SERVER, "q"))
_ticks: Final = lru_cache(maxsize=64)(ua.datetime_to_win_epoch)
"""DateTime of a time (Part 6 §5.2.2.5). What changes together has the same."""
_UNSENDABLE: Final = status(StatusCodes.BadEncodingError)


def changes(told: Sequence[bytes]) -> ua.ExtensionObject:
    """A DataChangeNotification with these changes, each by ``change``."""
    return extension(_CHANGES, b"".join((_LENGTH.pack(len(told)), *told, _NO_DIAGNOSTICS)))


def change(client_handle: int, value: ua.DataValue) -> bytes:
    """A MonitoredItemNotification, encoded. A value that cannot be encoded is told as BadEncodingError."""
    try:
        return _packed(client_handle, value) or struct_to_binary(notification(client_handle, value))
    except UNSENDABLE:
        bad = data_value(None, _UNSENDABLE, value.SourceTimestamp, value.ServerTimestamp)
        return struct_to_binary(notification(client_handle, bad))


def _packed(client_handle: int, value: ua.DataValue) -> bytes:
    """Empty for what is no single number."""
    held, code = value.Value, value.StatusCode
    if held is None or held.is_array or held.VariantType not in _FORMATS or value.SourcePicoseconds:
        return b""
    mask, fields = _HAS_VALUE, list[int]()
    if code is not None and code.value:
        mask |= _HAS_STATUS
        fields.append(code.value)
    if value.SourceTimestamp is not None:
        mask |= _HAS_SOURCE
        fields.append(_ticks(value.SourceTimestamp))
    if value.ServerTimestamp is not None:
        mask |= _HAS_SERVER
        fields.append(_ticks(value.ServerTimestamp))
    kind = held.VariantType
    return _packer(mask, kind)(client_handle, mask, kind, held.Value, *fields)


@cache
def _packer(mask: int, kind: ua.VariantType) -> Callable[..., bytes]:
    rest = "".join(field for bit, field in _FIELDS if mask & bit)
    return struct.Struct(f"<IBB{_FORMATS[kind]}{rest}").pack
