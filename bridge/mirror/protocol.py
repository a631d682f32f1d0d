"""What goes over the link between the bus process and its fronts, in MessagePack. Pure.

Times are ns since 1970 UTC (in an ``Outcome`` seconds), except those in ``RequestMessage``, ``Request`` and
``Rejected``, which are in seconds of the monotonic clock: both ends run on one machine, and a stepped wall
clock must not make a request old.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple, TypeVar, cast

import msgspec

from bridge.command import Action, Do, Event, Identity, Kind, Outcome, Rejection, Request
from bridge.command.points import CONNECTION_COUNTS
from bridge.command.request import COMMANDS
from bridge.image import Point, Quality, Reading, Value

SNAPSHOT: Final = "mirror/snapshot"
DELTA: Final = "mirror/delta"
EVENT: Final = "mirror/event"
REQUEST: Final = "mirror/request"
REJECTED: Final = "mirror/rejected"
COUNTED: Final = "mirror/counted"
TOKEN: Final = "mirror/@/bus"

_LEAST_INT: Final = -(2**63)
_MOST_INT: Final = 2**64 - 1
_Model = TypeVar("_Model")


class Malformed(ValueError):
    """A message that does not fit its key."""


class Changed(msgspec.Struct, array_like=True, frozen=True):
    """The reading of the point with this index."""

    index: int
    value: Value
    quality: Quality
    time_ns: int
    reason: str

    @classmethod
    def of(cls, index: int, reading: Reading, time_ns: int) -> Changed:
        return cls(index, reading.value, reading.quality, time_ns, reading.reason)


class Snapshot(msgspec.Struct, array_like=True, frozen=True):
    """Everything: the points with their nature, and their readings as of delta ``sequence``."""

    instance: int
    """Another number each time the bus process starts."""
    sequence: int
    points: tuple[Point, ...]
    readings: tuple[Changed, ...]


class Delta(msgspec.Struct, array_like=True, frozen=True):
    """What has changed since delta ``sequence - 1``; empty ones say that the bus process lives."""

    instance: int
    sequence: int
    readings: tuple[Changed, ...]


class EventMessage(msgspec.Struct, array_like=True, frozen=True):
    """An event."""

    time_ns: int
    kind: Kind
    source: str
    severity: int
    message: str

    @classmethod
    def of(cls, event: Event, time_ns: int) -> EventMessage:
        return cls(time_ns, event.kind, event.source, event.severity, event.message)

    def event(self) -> Event:
        """The event with its time in seconds since 1970 UTC."""
        return Event(self.time_ns / 1e9, self.kind, self.source, self.severity, self.message)


class RequestMessage(NamedTuple):
    """A request that is valid until ``deadline_s`` of the monotonic clock."""

    deadline_s: float
    request: Request


class _RequestFields(msgspec.Struct, array_like=True, frozen=True):
    """The same as it goes over the link: what a command's fields are is told by its action."""

    deadline_s: float
    identity: Identity
    target: str
    action: Action
    command: msgspec.Raw
    received_at: float | None
    pressed: bool | None


class Rejected(msgspec.Struct, array_like=True, frozen=True):
    """What a front has refused by itself, ``count`` times since it last said so."""

    time_s: float
    count: int
    rejection: Rejection


class Counted(msgspec.Struct, array_like=True, frozen=True):
    """What a front has counted since it last said so, for a point of the bridge's own."""

    leaf: str
    by: int


_encoder = msgspec.msgpack.Encoder()
_snapshot = msgspec.msgpack.Decoder(Snapshot)
_delta = msgspec.msgpack.Decoder(Delta)
_told = msgspec.msgpack.Decoder(EventMessage)
_asked = msgspec.msgpack.Decoder(_RequestFields)
_commands = {action: msgspec.msgpack.Decoder(kind) for action, kind in COMMANDS.items()}
_outcome = msgspec.msgpack.Decoder(Outcome)
_rejected = msgspec.msgpack.Decoder(Rejected)
_counted = msgspec.msgpack.Decoder(Counted)


def encode(message: Snapshot | Delta | EventMessage | Rejected | Counted | Outcome) -> bytes:
    """Raises nothing: a text that is not Unicode, or a number too long for MessagePack, is changed, because
    one bad value of a client must not cost the whole message."""
    try:
        return _encoder.encode(message)
    except (UnicodeError, OverflowError):
        return _encoder.encode(_encodable(msgspec.to_builtins(message)))


def encode_request(asked: RequestMessage) -> bytes:
    """A request is never changed. Raises Malformed for one that cannot be encoded."""
    request = asked.request
    try:
        command = msgspec.Raw(_encoder.encode(request.command))
        who, came = (request.identity, request.target), (request.received_at, request.pressed)
        return _encoder.encode(_RequestFields(asked.deadline_s, *who, request.action, command, *came))
    except (UnicodeError, OverflowError) as error:
        raise Malformed(f"cannot be passed on: {error}") from None


def _encodable(built: object) -> object:
    match built:
        case str():
            return built.encode("utf-8", "replace").decode()
        case int() if not _LEAST_INT <= built <= _MOST_INT:
            return min(max(built, _LEAST_INT), _MOST_INT)
        case dict():
            entries = cast("dict[object, object]", built)
            return {_encodable(key): _encodable(value) for key, value in entries.items()}
        case list() | tuple():
            return [_encodable(item) for item in cast("Sequence[object]", built)]
        case _:
            return built


def decode_snapshot(data: bytes) -> Snapshot:
    """Raises Malformed, as all of these do."""
    snapshot = _decode(_snapshot, data)
    _check_indices(snapshot.readings, len(snapshot.points))
    return snapshot


def decode_delta(data: bytes, count: int) -> Delta:
    """``count`` is the number of points there are."""
    delta = _decode(_delta, data)
    _check_indices(delta.readings, count)
    return delta


def decode_event(data: bytes) -> Event:
    return _decode(_told, data).event()


def decode_request(data: bytes) -> RequestMessage:
    asked = _decode(_asked, data)
    decoder = _commands.get(asked.action)
    command = Do(asked.action) if decoder is None else _decode(decoder, bytes(asked.command))
    request = Request(asked.identity, asked.target, command, asked.received_at, asked.pressed)
    return RequestMessage(asked.deadline_s, request)


def decode_rejected(data: bytes) -> Rejected:
    return _decode(_rejected, data)


def decode_counted(data: bytes) -> Counted:
    counted = _decode(_counted, data)
    if counted.leaf not in CONNECTION_COUNTS or counted.by < 1:
        raise Malformed(f"{counted.leaf} is nothing that a front counts")
    return counted


def decode_outcome(data: bytes) -> Outcome:
    return _decode(_outcome, data)


def _decode(decoder: msgspec.msgpack.Decoder[_Model], data: bytes) -> _Model:
    try:
        return decoder.decode(data)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise Malformed(str(error)) from None


def _check_indices(readings: tuple[Changed, ...], count: int) -> None:
    if any(not 0 <= changed.index < count for changed in readings):
        raise Malformed(f"an index that is none of {count} points")
