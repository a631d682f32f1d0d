"""The data types of CiA 309-3 between their text and their bytes."""

from __future__ import annotations

import base64
import binascii
import math
import re
from typing import Final

from bridge.canopen.datatypes import REALS, Integer

_INTEGERS: Final = {
    "b": Integer(1),
    **{f"i{8 * size}": Integer(size, signed=True) for size in range(1, 9)},
    **{f"u{8 * size}": Integer(size) for size in range(1, 9)},
}
_REALS: Final = {"r32": REALS["real32"], "r64": REALS["real64"]}
_REAL: Final = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)(e[-+]?[0-9]+)?", re.IGNORECASE)
_TIMES: Final = ("t", "td")
"""Days and milliseconds: TIME_OF_DAY and TIME_DIFFERENCE (CiA 301 §7.1.6.5)."""
_MS: Final = Integer(4)
_DAYS: Final = Integer(2)
_MOST_MS: Final = (1 << 28) - 1
_BASE64: Final = ("os", "us", "d")
HEX: Final = "hex"
"""Bytes in hexadecimal, not in the standard: what is answered where a read names no data type."""
TYPES: Final = frozenset((*_INTEGERS, *_REALS, *_TIMES, *_BASE64, "vs", HEX))


class BadText(ValueError):
    """A text is no value of its data type, or bytes are none."""


def encode(kind: str, words: list[str]) -> bytes:
    """The bytes of a value, of which ``words`` are the rest of the line. Raises ``BadText``.

    ``kind`` is one of ``TYPES``.
    """
    if kind == HEX:
        return _unhex("".join(words))
    if kind in _TIMES:
        if len(words) != 2:
            raise BadText("a time is a number of days and one of milliseconds")
        days, ms = _whole(words[0]), _whole(words[1])
        if not 0 <= ms <= _MOST_MS:
            raise BadText(f"0…{_MOST_MS} ms")
        return _packed(_MS, ms) + _packed(_DAYS, days)
    if len(words) != 1:
        raise BadText("one value is expected")
    text = words[0]
    if kind == "vs":
        try:
            return text.encode("latin-1")
        except UnicodeEncodeError:
            raise BadText("a visible string has characters of ISO 8859-1 only") from None
    if kind in _BASE64:
        try:
            return base64.b64decode(text, validate=True)
        except (binascii.Error, ValueError):
            raise BadText(f"{kind} is written in base64") from None
    if kind in _REALS:
        number = float(text) if _REAL.fullmatch(text) else math.inf
        try:
            if math.isfinite(number):
                return _REALS[kind].encode(number)
        except ValueError:
            pass
        raise BadText(f"{kind} is a number that fits, such as -2.5e3")
    number = _whole(text)
    if kind == "b" and number not in (0, 1):
        raise BadText("a boolean is 0 or 1")
    return _packed(_INTEGERS[kind], number)


def decode(kind: str, data: bytes) -> str:
    """The text of a value. Raises ``BadText`` where ``data`` is too short; surplus bytes of numbers are left
    out: some servers answer every read with four."""
    if kind == HEX:
        return data.hex(" ").upper()
    if kind in _BASE64:
        return base64.b64encode(data).decode("ascii")
    if kind == "vs":
        return quoted(data.split(b"\0", 1)[0].decode("latin-1"))
    size = 6 if kind in _TIMES else _REALS[kind].size if kind in _REALS else _INTEGERS[kind].size
    if len(data) < size:
        raise BadText(f"{kind} has {size} bytes, not {len(data)}")
    if kind in _TIMES:
        return f"{_DAYS.decode(data[4:])} {_MS.decode(data) & _MOST_MS}"
    if kind in _REALS:
        return repr(_REALS[kind].decode(data))
    number = _INTEGERS[kind].decode(data)
    return str(int(bool(number)) if kind == "b" else number)


def quoted(text: str) -> str:
    """A text as one word of a line: control characters would break it, and are blanks in it."""
    plain = "".join(char if char.isprintable() else " " for char in text)
    if plain and not any(char in plain for char in ' "#'):
        return plain
    return '"' + plain.replace('"', '""') + '"'


def _whole(text: str) -> int:
    sign, bare = (-1, text[1:]) if text.startswith("-") else (1, text)
    try:
        if bare[:2].lower() == "0x" and bare[2:].isalnum() and bare.isascii():
            return sign * int(bare[2:], 16)
        if bare.isdecimal() and bare.isascii() and len(bare) <= 20:
            return sign * int(bare)
    except ValueError:
        pass
    raise BadText(f"{text[:20]!r} is no whole number")


def _packed(kind: Integer, number: int) -> bytes:
    try:
        return kind.encode(number)
    except ValueError as error:
        raise BadText(str(error)) from None


def _unhex(text: str) -> bytes:
    try:
        return bytes.fromhex(text)
    except ValueError:
        raise BadText("bytes are pairs of hexadecimal digits") from None
