"""Every request of OPC UA with each of its strings and Doubles, as no honest client would send it.

Made from asyncua's classes, so that a service or a field that comes with another version is among them.
"""

from __future__ import annotations

import math
import typing
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from datetime import UTC, datetime
from enum import Enum
from types import NoneType, UnionType
from typing import Any, Final
from uuid import UUID

from asyncua import ua
from asyncua.ua.ua_binary import get_safe_type_hints
from asyncua.ua.uaprotocol_auto import DataChangeFilter

NOT_UTF8: Final = "\udcff\udcfe"
"""asyncua's client sends the bytes FFh FEh for it."""
HOSTILE: Final = {
    "not UTF-8": NOT_UTF8,
    "half a character": "fu1\udce2\udc82",
    "a surrogate in UTF-8": "\udced\udca0\udc80",
    "an overlong slash": "\udcc0\udcaf",
    "NUL": "conveyor\0fu1",
    "a terminal's commands": "\x1b[2J\r\n\x1b]0;owned\x07",
    "too long": "x" * 100_000,
}
"""The first four cannot be decoded."""
UNDECODABLE: Final = tuple(HOSTILE)[:4]

DOUBLES: Final = (math.nan, math.inf, -math.inf, 1.7e308, -1.7e308, -1.0, -0.0, 5e-324)
_HONEST: Final = "conveyor/fu1"
_HONEST_DOUBLE: Final = 50.0


class _Fill:
    """Content of strings and Doubles: ``hostile`` at the place ``at`` of those that are of its type."""

    def __init__(self, at: int, hostile: str | float) -> None:
        self._at = at
        self._hostile = hostile
        self.count = 0
        self.filter = ua.EventFilter if isinstance(hostile, str) else DataChangeFilter

    def text(self) -> str:
        return self._next(_HONEST, str)

    def double(self) -> float:
        return self._next(_HONEST_DOUBLE, float)

    def value(self) -> ua.DataValue:
        if isinstance(self._hostile, str):
            return ua.DataValue(ua.Variant(self.text(), ua.VariantType.String))
        return ua.DataValue(ua.Variant(self.double(), ua.VariantType.Double))

    def _next(self, honest: Any, kind: type) -> Any:
        if not isinstance(self._hostile, kind):
            return honest
        self.count += 1
        return self._hostile if self.count - 1 == self._at else honest


def requests() -> list[type]:
    """All requests with a header, as classes."""
    found = [getattr(ua, name) for name in dir(ua) if name.endswith("Request") and name != "ServiceRequest"]
    return [
        kind
        for kind in found
        if is_dataclass(kind) and {"TypeId", "RequestHeader"} <= {field.name for field in fields(kind)}
    ]


def with_each(kind: type, hostile: str | float) -> Iterator[Any]:
    """Requests of this kind, each with ``hostile`` in another one of its strings or Doubles."""
    at = 0
    while True:
        fill = _Fill(at, hostile)
        made = _request(kind, fill)
        if at >= fill.count:
            return
        yield made
        at += 1


def without_arrays(made: Any) -> Any:
    """The same request with null in place of each of its arrays."""
    for field in fields(made):
        held = getattr(made, field.name)
        if isinstance(held, list):
            setattr(made, field.name, None)
        elif is_dataclass(held) and field.name not in ("TypeId", "RequestHeader"):
            without_arrays(held)
    return made


def _request(kind: type, fill: _Fill) -> Any:
    made = kind()
    hints = get_safe_type_hints(kind, {"ua": ua})
    for field in fields(kind):
        if field.name not in ("TypeId", "RequestHeader"):
            setattr(made, field.name, _filled(hints[field.name], field.name, fill, 0))
    return made


_EXTENSIONS: Final[dict[str, Callable[[_Fill], type]]] = {
    "UserIdentityToken": lambda fill: ua.UserNameIdentityToken,
    "Filter": lambda fill: fill.filter,
    "FilterOperands": lambda fill: ua.SimpleAttributeOperand,
    "NodeAttributes": lambda fill: ua.VariableAttributes,
    "HistoryReadDetails": lambda fill: ua.ReadRawModifiedDetails,
    "HistoryUpdateDetails": lambda fill: ua.DeleteRawModifiedDetails,
}


def _filled(kind: Any, name: str, fill: _Fill, depth: int) -> Any:
    """A value of this type with something in each of its fields."""
    origin = typing.get_origin(kind)
    if origin in (typing.Union, UnionType):
        (inner, *_) = [one for one in typing.get_args(kind) if one is not NoneType]
        return _filled(inner, name, fill, depth)
    if origin is list:
        return [_filled(typing.get_args(kind)[0], name, fill, depth)]
    if kind in (Any, ua.ExtensionObject) or not isinstance(kind, type):
        extension = _EXTENSIONS.get(name)
        return _filled(extension(fill), name, fill, depth + 1) if extension else ua.ExtensionObject()
    if issubclass(kind, ua.NodeId):
        return kind(fill.text(), 2, ua.NodeIdType.String)
    if issubclass(kind, ua.DataValue):
        return fill.value()
    if issubclass(kind, ua.Variant):
        return ua.Variant([fill.text(), fill.text()], ua.VariantType.String)
    return _plain(kind, fill, depth)


def _plain(kind: type, fill: _Fill, depth: int) -> Any:
    if issubclass(kind, Enum):
        return next(iter(kind))
    for base, make in _SCALARS.items():
        if issubclass(kind, base):
            return make(fill)
    if not is_dataclass(kind):  # asyncua's Boolean
        return True
    made = kind()
    if depth > 6:
        return made
    hints = get_safe_type_hints(kind, {"ua": ua})
    for field in fields(kind):
        if field.name not in ("Encoding", "data_type"):
            setattr(made, field.name, _filled(hints[field.name], field.name, fill, depth + 1))
    return made


_SCALARS: Final[dict[type, Callable[[_Fill], Any]]] = {
    str: lambda fill: fill.text(),
    bytes: lambda fill: b"1",
    int: lambda fill: 1,
    float: lambda fill: fill.double(),
    datetime: lambda fill: datetime.now(UTC),
    UUID: lambda fill: UUID(int=1),
}
