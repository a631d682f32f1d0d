"""Fields of an event as a line of JSON, and back.

NodeIds, and names of fields that are not the standard's, are written with the URI of their namespace, whose
index may be another one after a restart; a text in all languages, so that who reads it gets their own.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final

from bridge.uaserver.history.history import date_time, time_us
from bridge.uaserver.languages import Spoken
from bridge.uaserver.library import node_id, text, ua, variant

Fields = Mapping[str, ua.Variant]

_Kind = ua.VariantType
_URI: Final = "nsu="
"""Beginning of a name with the URI of its namespace, as in Part 6 §5.3.1.10."""
_PLAIN: Final = frozenset(
    (
        _Kind.Boolean,
        _Kind.SByte,
        _Kind.Byte,
        _Kind.Int16,
        _Kind.UInt16,
        _Kind.Int32,
        _Kind.UInt32,
        _Kind.Int64,
        _Kind.UInt64,
        _Kind.Float,
        _Kind.Double,
        _Kind.String,
    )
)


@dataclass(frozen=True, slots=True)
class EventRecord:
    """An event that is kept. ``source`` is the name of what it is about; ``line`` has its fields, and ends
    with the only line feed in it."""

    time_us: int
    source: str
    line: bytes


@dataclass(frozen=True, slots=True)
class EventCodec:
    """``namespaces`` are the URIs of the server, in the order of their indices."""

    namespaces: Sequence[str]

    def record(self, time_us: int, source: str, fields: Fields) -> EventRecord:
        """``fields`` without those of types that are not kept: arrays and structures."""
        kept = {self._written_name(name): self._body(one) for name, one in fields.items() if _is_kept(one)}
        content = {"time_us": time_us, "source": source, "fields": kept}
        line = json.dumps(content, ensure_ascii=False, separators=(",", ":")) + "\n"
        return EventRecord(time_us, source, line.encode())

    def fields(self, record: EventRecord) -> Fields:
        found: dict[str, Any] = json.loads(record.line)["fields"]
        read = {
            self._read_name(name): self._variant(_Kind(kind), body) for name, (kind, body) in found.items()
        }
        read.pop("", None)
        return read

    def _written_name(self, name: str) -> str:
        index, colon, rest = name.partition(":")
        if colon and index.isdecimal() and int(index) < len(self.namespaces):
            return f"{_URI}{self.namespaces[int(index)]};{rest}"
        return name

    def _read_name(self, written: str) -> str:
        """Empty for one of a namespace that there is no more."""
        if not written.startswith(_URI):
            return written
        uri, _, name = written.removeprefix(_URI).rpartition(";")
        return f"{self.namespaces.index(uri)}:{name}" if uri in self.namespaces else ""

    def _body(self, held: ua.Variant) -> tuple[int, object]:
        kind, value = held.VariantType, held.Value
        if value is None or kind is _Kind.Null:
            return _Kind.Null.value, None
        return kind.value, value if kind in _PLAIN else _WRITERS[kind](self, value)

    def _variant(self, kind: ua.VariantType, body: Any) -> ua.Variant:
        value = _READERS[kind](self, body) if kind in _READERS else body
        return variant(None, _Kind.Null) if value is None else variant(value, kind)

    def written_id(self, where: ua.NodeId) -> list[object]:
        namespace = where.NamespaceIndex
        uri = self.namespaces[namespace] if namespace < len(self.namespaces) else ""
        return [uri, where.Identifier if isinstance(where.Identifier, int | str) else str(where.Identifier)]

    def read_id(self, body: Any) -> ua.NodeId | None:
        """None for one of a namespace that there is no more."""
        uri, identifier = body
        return node_id(identifier, self.namespaces.index(uri)) if uri in self.namespaces else None


def _is_kept(held: ua.Variant) -> bool:
    kind = held.VariantType
    return held.Value is None or (not held.is_array and (kind in _PLAIN or kind in _WRITERS))


def _words(said: ua.LocalizedText) -> Mapping[str, str]:
    return dict(said.words) if isinstance(said, Spoken) else {said.Locale or "en": said.Text or ""}


def _spoken(words: Mapping[str, str]) -> ua.LocalizedText:
    return Spoken(words) if len(words) > 1 else text(next(iter(words.values()), ""))


_WRITERS: Final[Mapping[ua.VariantType, Callable[[EventCodec, Any], object]]] = {
    _Kind.NodeId: EventCodec.written_id,
    _Kind.ByteString: lambda _, value: value.hex(),
    _Kind.DateTime: lambda _, value: time_us(value),
    _Kind.LocalizedText: lambda _, value: _words(value),
    _Kind.StatusCode: lambda _, value: value.value,
}
_READERS: Final[Mapping[ua.VariantType, Callable[[EventCodec, Any], object]]] = {
    _Kind.NodeId: EventCodec.read_id,
    _Kind.ByteString: lambda _, body: bytes.fromhex(body),
    _Kind.DateTime: lambda _, body: _date(body),
    _Kind.LocalizedText: lambda _, body: _spoken(body),
    _Kind.StatusCode: lambda _, body: ua.StatusCode(body),
}


def _date(us: int | None) -> datetime | None:
    return None if us is None else date_time(us)


def read_record(line: bytes) -> EventRecord | None:
    """The record of a line; None for what is none, such as a line that was torn off."""
    try:
        content = json.loads(line)
        time, source, fields = content["time_us"], content["source"], content["fields"]
    except (ValueError, TypeError, KeyError):
        return None
    if not (isinstance(time, int) and isinstance(source, str) and isinstance(fields, dict)):
        return None
    return EventRecord(time, source, line) if line.endswith(b"\n") else None
