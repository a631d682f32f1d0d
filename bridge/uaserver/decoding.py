"""asyncua's decoder, made strict: what is malformed is refused where it is decoded.

asyncua accepts strings that are not UTF-8, which break whatever serialises them later; it goes backwards for
a negative length; and it makes arrays as long as a client says, even of elements that take no bytes: a
message of thirty bytes can fill the memory.
"""

# asyncua's decoder has no types:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportPrivateUsage=false, reportAttributeAccessIssue=false

from __future__ import annotations

import functools
import math
import struct
import traceback
from collections.abc import Callable, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, get_args

from asyncua.common.utils import Buffer, NotEnoughData
from asyncua.ua import ua_binary

from bridge.uaserver.library import InvalidSignature, StatusCodes, UaError, UaStatusCodeError, ua
from bridge.uaserver.loop import Stint

MOST_ELEMENTS: Final = 30_000
"""Limit for the elements of all arrays in one message that are decoded one by one. Ten thousand operations
with arrays of two fit in."""
MOST_AT_ONCE: Final = 3_000
"""Limit for those that are decoded while nobody else has a turn; a thousand take about 10 ms."""
MOST_BEFORE_SESSION: Final = 1_000
"""Limit for the messages that open a session, which name a few."""

MALFORMED: Final = (
    UaError,
    InvalidSignature,
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    ArithmeticError,
    RecursionError,
    struct.error,
)
"""Exceptions of asyncua's decoders for bytes that are not OPC UA."""

_TIME_AND_HANDLE: Final = struct.Struct("<qI")
_MOST_DIMENSIONS: Final = 10
_LENGTH: Final = struct.Struct("<i")
_DECODERS: Final = frozenset((ua_binary.struct_from_binary.__code__, ua_binary.nodeid_from_binary.__code__))
_Decode = Callable[[Any], Any]


@dataclass(slots=True)
class _Budget:
    """Number of array elements that may still be decoded: of the message, and before others have a turn."""

    left: int
    at_once: int

    def take(self, elements: int, *, in_turns: bool = False) -> None:
        """Raises UaStatusCodeError where there are not so many."""
        self.left -= elements
        self.at_once -= 0 if in_turns else elements
        if self.left < 0 or self.at_once < 0:
            raise UaStatusCodeError(StatusCodes.BadEncodingLimitsExceeded)


_budget: ContextVar[_Budget | None] = ContextVar("decoding_budget", default=None)
"""Budget of the message which the present task has before it."""


def begin(most: int) -> None:
    """A message begins: from here on this task decodes no more than ``most`` elements of arrays."""
    _budget.set(_Budget(most, MOST_AT_ONCE))


def install() -> None:
    """Make the decoder of this process strict. May be called again."""
    if ua_binary._String.unpack is _string:
        return
    Buffer.read = _read
    ua_binary._String.unpack = staticmethod(_string)
    ua_binary._reshape = _checked_shape(ua_binary._reshape)
    ua_binary._create_list_deserializer = _bounded(ua_binary._create_list_deserializer)
    ua_binary._create_uatype_array_deserializer = _bounded(ua_binary._create_uatype_array_deserializer)
    # What was made with the former ones.
    for made in (
        "_create_uatype_deserializer",
        "_create_type_deserializer",
        "_create_dataclass_deserializer",
    ):
        getattr(ua_binary, made).cache_clear()


async def decoded(kind: type[Any], arrays: Sequence[str], data: Buffer) -> Any:
    """A structure, of which the elements of the ``arrays`` are decoded in turns."""
    stint, fields_ = Stint(), dict[str, Any]()
    for name, hint in _hints(kind).items():
        if name not in arrays:
            fields_[name] = _part(hint, kind, data)
            continue
        elements = fields_[name] = list[Any]()
        (element,) = get_args(hint)
        for _ in range(_length(data)):
            _begin_turn()
            elements.append(_part(element, kind, data))
            await stint.pause()
        _begin_turn()
    return kind(**fields_)


def _begin_turn() -> None:
    budget = _budget.get()
    if budget:
        budget.at_once = MOST_AT_ONCE


@functools.cache
def _hints(kind: type[Any]) -> dict[str, Any]:
    return dict(ua_binary.get_safe_type_hints(kind, {"ua": ua}))


def _part(hint: Any, kind: type[Any], data: Buffer) -> Any:
    return ua_binary._create_type_deserializer(hint, kind)(data)


def _length(data: Buffer) -> int:
    """Length of an array that is decoded in turns: no longer than what is left of the message, and of the
    budget."""
    (length,) = _LENGTH.unpack(data.read(_LENGTH.size))
    if length < -1 or length > len(data):
        raise NotEnoughData(f"an array of {length} elements in {len(data)} bytes")
    budget = _budget.get()
    if budget and length > 0:
        budget.take(length, in_turns=True)
    return length


def first_length(data: Buffer) -> int:
    """Length of the array that comes next, which is not decoded yet; that of a null array is 0."""
    (length,) = _LENGTH.unpack(data.copy(_LENGTH.size).read(_LENGTH.size))
    return max(0, length)


def is_malformed(error: BaseException) -> bool:
    """Whether ``error`` comes from decoding, and so from what the client has sent."""
    if isinstance(error, NotEnoughData):
        return True
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code in _DECODERS or trace.tb_frame.f_code is _part.__code__:
            return True
        trace = trace.tb_next
    return False


def place(error: BaseException) -> str:
    """Place in the source where ``error`` was raised."""
    frames = traceback.extract_tb(error.__traceback__)
    return f"at {Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else ""


def _string(data: Buffer) -> str | None:
    """A String (Part 6 §5.2.2.4). Raises UnicodeDecodeError for what is no UTF-8."""
    content: bytes | None = ua_binary.Primitives.Bytes.unpack(data)
    return None if content is None else content.decode()


def _read(self: Any, size: int) -> bytes:
    """Replacement of ``Buffer.read``."""
    if not 0 <= size <= self._size:
        raise NotEnoughData(f"{size} bytes asked for where {self._size} are left")
    begin = self._cur_pos
    self._size -= size
    self._cur_pos += size
    return self._data[begin : self._cur_pos]


def _bounded(make: Callable[[Any], _Decode]) -> Callable[[Any], _Decode]:
    """``make`` for arrays that are no longer than what is left of the message, or of the budget."""

    @functools.cache
    def made(kind: Any) -> _Decode:
        decode = make(kind)
        # Numbers are decoded all at once.
        is_quick = isinstance(kind, ua.VariantType) and hasattr(ua_binary.Primitives1, kind.name)

        def checked(data: Buffer) -> Any:
            (length,) = _LENGTH.unpack(data.copy(_LENGTH.size).read(_LENGTH.size))
            if length < -1 or length > len(data) - _LENGTH.size:
                raise NotEnoughData(f"an array of {length} elements in {len(data) - _LENGTH.size} bytes")
            budget = _budget.get()
            if budget and not is_quick and length > 0:
                budget.take(length)
            # A null array is an empty one to every service; asyncua has None for it.
            return decode(data) or []

        return checked

    return made


def _checked_shape(reshape: Callable[[Any, list[int]], Any]) -> Callable[[Any, list[int]], Any]:
    """``reshape`` for dimensions that fit the values: asyncua fills up what they lack."""

    def checked(flat: list[Any], dimensions: list[int]) -> Any:
        # Counted first: the product of many is slow.
        fits = 0 < len(dimensions) <= _MOST_DIMENSIONS and min(dimensions) >= 0
        if not fits or math.prod(dimensions) != len(flat):
            raise UaError(f"dimensions {dimensions[:9]} of {len(flat)} values")
        return reshape(flat, dimensions)

    return checked


def request_handle(header: Buffer) -> int:
    """Handle of a RequestHeader of which nothing else need be sound. Raises for one that ends before it."""
    ua_binary.nodeid_from_binary(header)
    _, handle = _TIME_AND_HANDLE.unpack(header.read(_TIME_AND_HANDLE.size))
    return int(handle)
