"""Every request of OPC UA with every of its strings, one at a time, as no honest client would send it.

Made from asyncua's classes, so that a service or a field that comes with another version is among them.
"""

from __future__ import annotations

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

_HONEST: Final = "conveyor/fu1"
_Next = Callable[[], str]


def requests() -> list[type]:
    """All requests with a header, as classes."""
    found = [getattr(ua, name) for name in dir(ua) if name.endswith("Request") and name != "ServiceRequest"]
    return [
        kind
        for kind in found
        if is_dataclass(kind) and {"TypeId", "RequestHeader"} <= {field.name for field in fields(kind)}
    ]


def with_each_string(kind: type, hostile: str) -> Iterator[Any]:
    """Requests of this kind, each with ``hostile`` in another one of its strings."""
    count = 0

    def take(at: int) -> _Next:
        nonlocal count
        count = 0

        def next_text() -> str:
            nonlocal count
            count += 1
            return hostile if count - 1 == at else _HONEST

        return next_text

    at = 0
    while True:
        made = _request(kind, take(at))
        if at >= count:
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


def _request(kind: type, text: _Next) -> Any:
    made = kind()
    hints = get_safe_type_hints(kind, {"ua": ua})
    for field in fields(kind):
        if field.name not in ("TypeId", "RequestHeader"):
            setattr(made, field.name, _filled(hints[field.name], field.name, text, 0))
    return made


_EXTENSIONS: Final[dict[str, Callable[[], type]]] = {
    "UserIdentityToken": lambda: ua.UserNameIdentityToken,
    "Filter": lambda: ua.EventFilter,
    "FilterOperands": lambda: ua.SimpleAttributeOperand,
    "NodeAttributes": lambda: ua.VariableAttributes,
    "HistoryReadDetails": lambda: ua.ReadRawModifiedDetails,
    "HistoryUpdateDetails": lambda: ua.DeleteRawModifiedDetails,
}


def _filled(kind: Any, name: str, text: _Next, depth: int) -> Any:
    """A value of this type with something in each of its fields."""
    origin = typing.get_origin(kind)
    if origin in (typing.Union, UnionType):
        (inner, *_) = [one for one in typing.get_args(kind) if one is not NoneType]
        return _filled(inner, name, text, depth)
    if origin is list:
        return [_filled(typing.get_args(kind)[0], name, text, depth)]
    if kind in (Any, ua.ExtensionObject) or not isinstance(kind, type):
        extension = _EXTENSIONS.get(name)
        return _filled(extension(), name, text, depth + 1) if extension else ua.ExtensionObject()
    if issubclass(kind, ua.NodeId):
        return kind(text(), 2, ua.NodeIdType.String)
    if issubclass(kind, ua.DataValue):
        return ua.DataValue(ua.Variant(text(), ua.VariantType.String))
    if issubclass(kind, ua.Variant):
        return ua.Variant([text(), text()], ua.VariantType.String)
    return _plain(kind, text, depth)


def _plain(kind: type, text: _Next, depth: int) -> Any:
    if issubclass(kind, Enum):
        return next(iter(kind))
    for base, make in _SCALARS.items():
        if issubclass(kind, base):
            return make(text)
    if not is_dataclass(kind):  # asyncua's Boolean
        return True
    made = kind()
    if depth > 6:
        return made
    hints = get_safe_type_hints(kind, {"ua": ua})
    for field in fields(kind):
        if field.name not in ("Encoding", "data_type"):
            setattr(made, field.name, _filled(hints[field.name], field.name, text, depth + 1))
    return made


_SCALARS: Final[dict[type, Callable[[_Next], Any]]] = {
    str: lambda text: text(),
    bytes: lambda text: b"1",
    int: lambda text: 1,
    float: lambda text: 50.0,
    datetime: lambda text: datetime.now(UTC),
    UUID: lambda text: UUID(int=1),
}
