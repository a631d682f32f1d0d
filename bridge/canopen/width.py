"""Width of numbers in SDO answers and requests: the one place that decides how many bytes a number has.

The type decides what is read: bytes beyond it do not count. What a node takes is decided by its own answer:
one that answers in another width is written to in that width, and in that of the type where it refuses
(CiA 301 §7.2.4.3.3–6; table 22: 0607 0010h, 0607 0012h, 0607 0013h).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from bridge.canopen import abort

LONGEST: Final = 8
"""Bytes of the longest number of CANopen."""
_EXPEDITED: Final = 4
_OTHER_WIDTH: Final = abort.LENGTHS | {abort.GENERAL, 0x0604_0043, 0x0604_0047}
"""With these a node may mean the length."""


class Unsized(bytes):
    """Four bytes of an expedited answer without a length. The value may be fewer of them; what the rest
    holds is not said (CiA 301 §7.2.4.3.3)."""

    __slots__ = ()


def fitted(data: bytes, size: int) -> bytes:
    """The bytes of a number of ``size`` bytes in an answer. Raises ValueError where bytes are missing."""
    if len(data) < size:
        raise ValueError(f"{len(data)} bytes are too few")
    return bytes(data[:size])


def unsigned(data: bytes, size: int) -> int:
    """The number without sign in an answer; one in fewer bytes than its type has is that number."""
    return int.from_bytes(data[:size], "little")


def holds(held: bytes, wanted: bytes, *, signed: bool = False) -> bool:
    """True where an answer, ``held``, is the number that ``wanted`` has the bytes of.

    Bytes beyond the shorter one must be its padding, with zeros or with the sign. In an answer without a
    length they say nothing.
    """
    if isinstance(held, Unsized):
        return bool(wanted) and held[: len(wanted)] == wanted
    if not held or not wanted or max(len(held), len(wanted)) > LONGEST:
        return held == wanted
    return any(
        int.from_bytes(held, "little", signed=sign) == int.from_bytes(wanted, "little", signed=sign)
        for sign in {False, signed}
    )


def surplus(data: bytes, size: int, *, signed: bool = False) -> bytes:
    """Bytes beyond a number of ``size`` bytes that are neither its padding nor without meaning: the object
    seems to be a longer one."""
    if isinstance(data, Unsized) or holds(data, data[:size], signed=signed):
        return b""
    return data[size:]


def forms(
    wanted: bytes, held: bytes | None, *, signed: bool = False, is_number: bool = True
) -> Iterator[bytes]:
    """``wanted`` in the widths in which a node may take it, the likeliest first.

    ``held`` is what the node has answered when the object was read, None where that is not known. With
    ``is_number`` false it may as well be a text: the other width is for a node that refuses the first.
    """
    width = _EXPEDITED if held is None or isinstance(held, Unsized) else len(held)
    other = _resized(wanted, width, signed=signed)
    is_told = is_number and held is not None and not isinstance(held, Unsized)
    if other is None:
        yield wanted
    elif is_told:
        yield from (other, wanted)
    else:
        yield from (wanted, other)


def may_mean_width(code: int) -> bool:
    """True where a node that refuses a number with this abort code may take it in another width."""
    return code in _OTHER_WIDTH


def _resized(data: bytes, size: int, *, signed: bool) -> bytes | None:
    """The same number in ``size`` bytes; None where that is no other form of it."""
    if len(data) == size or not 0 < len(data) <= LONGEST or not 0 < size <= LONGEST:
        return None
    try:
        return int.from_bytes(data, "little", signed=signed).to_bytes(size, "little", signed=signed)
    except OverflowError:
        return None
