"""Messages on the link between the bus process and its fronts, in MessagePack. Pure.

Times are seconds since 1970 UTC, except those of a request and of ``Rejected``, which are of the monotonic
clock that both ends have: they run on one machine. A stepped wall clock must not make a request old.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, TypeVar, cast

import msgspec

from bridge.catalogue.points import CONNECTION_COUNTS
from bridge.command import Action, Do, Event, Identity, Outcome, Rejection, Request
from bridge.command.messages.request import COMMANDS
from bridge.image import Point, Quality, Value
from bridge.text import Said, Text

SNAPSHOT: Final = "mirror/snapshot"
DELTA: Final = "mirror/delta"
PROMPT: Final = "mirror/prompt"
"""Key of readings for who cannot wait for the next delta; that one has the same again."""
EVENT: Final = "mirror/event"
REQUESTS: Final = "mirror/request/*"
REJECTED: Final = "mirror/rejected"
COUNTED: Final = "mirror/counted"
CONNECTIONS: Final = "mirror/connection/*"
TOKEN: Final = "mirror/@/bus"

_LEAST_INT: Final = -(2**63)
_MOST_INT: Final = 2**64 - 1
_Model = TypeVar("_Model")


class Malformed(ValueError):
    """A message that does not fit its key."""


class Changed(msgspec.Struct, array_like=True, frozen=True):
    """The reading of the point with this index."""

    index: int
    value: Value | Text
    """A text where the value is the words of one."""
    quality: Quality
    time: float
    why: Said


class Snapshot(msgspec.Struct, array_like=True, frozen=True):
    """Everything: the points with their nature, and their readings as of delta ``sequence``."""

    instance: int
    """Another number each time the bus process starts."""
    sequence: int
    points: tuple[Point, ...]
    readings: tuple[Changed, ...]


class Delta(msgspec.Struct, array_like=True, frozen=True):
    """Changes since delta ``sequence - 1``; empty ones show that the bus process lives."""

    instance: int
    sequence: int
    readings: tuple[Changed, ...]


class Prompt(msgspec.Struct, array_like=True, frozen=True):
    """Readings that have changed just now."""

    instance: int
    readings: tuple[Changed, ...]


class Answered(msgspec.Struct, array_like=True, frozen=True):
    """The outcome of a request. The image that has applied delta ``sequence`` of ``instance`` shows what the
    request has changed."""

    outcome: Outcome
    instance: int
    sequence: int


class _Asked(msgspec.Struct, array_like=True, frozen=True):
    """A request that is valid until ``deadline_s``; what the fields of its command are is told by its
    action."""

    deadline_s: float
    identity: Identity
    target: str
    action: Action
    command: msgspec.Raw
    received_at: float | None
    pressed: bool | None


class Rejected(msgspec.Struct, array_like=True, frozen=True):
    """A refusal by a front itself, ``count`` times since its last report."""

    time_s: float
    count: int
    rejection: Rejection


class Counted(msgspec.Struct, array_like=True, frozen=True):
    """A count of a front since its last report, for a point of the bridge's own."""

    leaf: str
    by: int


class Connected(msgspec.Struct, array_like=True, frozen=True):
    """A client's connection to a front has begun or ended; ``has_others``: the same user has other ones."""

    identity: Identity
    is_there: bool
    has_others: bool


_encoder = msgspec.msgpack.Encoder()
_decoders: dict[type, msgspec.msgpack.Decoder[Any]] = {
    kind: msgspec.msgpack.Decoder(kind)
    for kind in (
        Snapshot,
        Delta,
        Prompt,
        Event,
        Rejected,
        Counted,
        Connected,
        Answered,
        _Asked,
        *COMMANDS.values(),
    )
}


def encode(message: Snapshot | Delta | Prompt | Event | Rejected | Counted | Connected | Answered) -> bytes:
    """Raises nothing: a text that is not Unicode, or a number too long for MessagePack, is changed, because
    one bad value of a client must not cost the whole message."""
    try:
        return _encoder.encode(message)
    except (UnicodeError, OverflowError):
        return _encoder.encode(_encodable(msgspec.to_builtins(message)))


def key_of(keys: str, front: str) -> str:
    """That of ``REQUESTS`` or ``CONNECTIONS`` that belongs to this front."""
    return keys.replace("*", front)


def front_of(key: str) -> str:
    """The other way round."""
    return key.rpartition("/")[2]


def encode_request(request: Request, deadline_s: float) -> bytes:
    """A request is never changed. Raises Malformed for one that cannot be encoded."""
    try:
        command = msgspec.Raw(_encoder.encode(request.command))
        who, came = (request.identity, request.target), (request.received_at, request.pressed)
        return _encoder.encode(_Asked(deadline_s, *who, request.action, command, *came))
    except (UnicodeError, OverflowError) as error:
        raise Malformed(str(error)) from None


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


def decode(kind: type[_Model], data: bytes) -> _Model:
    """Raises Malformed, as all of these do."""
    try:
        return _decoders[kind].decode(data)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise Malformed(str(error)) from None


def decode_snapshot(data: bytes) -> Snapshot:
    snapshot = decode(Snapshot, data)
    _check_indices(snapshot.readings, len(snapshot.points))
    return snapshot


def decode_delta(data: bytes, count: int) -> Delta:
    """``count`` is the number of points there are."""
    delta = decode(Delta, data)
    _check_indices(delta.readings, count)
    return delta


def decode_prompt(data: bytes, count: int) -> Prompt:
    """``count`` is the number of points there are."""
    prompt = decode(Prompt, data)
    _check_indices(prompt.readings, count)
    return prompt


def decode_request(data: bytes) -> tuple[Request, float]:
    """A request and its deadline."""
    asked = decode(_Asked, data)
    kind = COMMANDS.get(asked.action)
    command = Do(asked.action) if kind is None else decode(kind, bytes(asked.command))
    return Request(asked.identity, asked.target, command, asked.received_at, asked.pressed), asked.deadline_s


def decode_counted(data: bytes) -> Counted:
    counted = decode(Counted, data)
    if counted.leaf not in CONNECTION_COUNTS or counted.by < 1:
        raise Malformed(f"{counted.leaf} is nothing that a front counts")
    return counted


def _check_indices(readings: tuple[Changed, ...], count: int) -> None:
    if any(not 0 <= changed.index < count for changed in readings):
        raise Malformed(f"an index that is none of {count} points")
