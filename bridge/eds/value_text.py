"""Values of a device description: text to number, number to bytes (CiA 306 §4.3, CiA 301 §7.4.7)."""

from __future__ import annotations

import math
import re
from typing import Final

from bridge.canopen.datatypes import REALS, Integer
from bridge.eds.ini import shown
from bridge.eds.model import StaticDataType, Value
from bridge.text import Said, Text

_INTEGER: Final = re.compile(
    r"([+-]?)(?:0x([0-9a-f]{1,32})|([0-9]{1,39})|([0-9][0-9a-f]{0,31})h)", re.IGNORECASE
)
_NODE_ID: Final = re.compile(r"\$?NODE_?ID", re.IGNORECASE)
_TEXTS: Final = (StaticDataType.VISIBLE_STRING, StaticDataType.UNICODE_STRING)
_BYTES: Final = (StaticDataType.OCTET_STRING, StaticDataType.DOMAIN)
_REALS: Final = {StaticDataType.REAL32: REALS["real32"], StaticDataType.REAL64: REALS["real64"]}
_INTEGERS: Final = {
    StaticDataType.BOOLEAN: Integer(1),
    StaticDataType.TIME_OF_DAY: Integer(6),
    StaticDataType.TIME_DIFFERENCE: Integer(6),
    **{
        one: Integer(int(one.name.removeprefix(kind)) // 8, signed=kind == "INTEGER")
        for kind in ("INTEGER", "UNSIGNED")
        for one in StaticDataType
        if one.name.startswith(kind)
    },
}


class BadValue(ValueError):
    """A text that is no such value; ``said`` is why, put into words only where somebody reads it."""

    def __init__(self, said: Text) -> None:
        super().__init__(said)
        self.said = said


def integer(text: str) -> tuple[int, Said]:
    """A whole number, and what is odd about how it is written, or "".

    Raises BadValue. 001 is 1 and 010 is 10: tools pad with zeros. The standard allows C's octal numbers;
    where one would give another value, the text says so.
    """
    note: Said = ""
    bare = text.strip()
    if ";" in bare:
        bare = bare.partition(";")[0].rstrip()
        note = Text.of("eds.comment_behind_value", value=shown(text))
    match = _INTEGER.fullmatch(bare)
    if not match:
        raise BadValue(Text.of("eds.not_number", value=shown(text)))
    sign, hexadecimal, decimal, assembler = match.groups()
    if decimal is None:
        value = int(hexadecimal or assembler, 16)
        if assembler:
            note = Text.of("eds.taken_as", value=shown(bare), taken=f"0x{value:X}")
    else:
        value = int(decimal)
        if len(decimal) > 1 and decimal[0] == "0" and value:
            octal = int(decimal, 8) if set(decimal) <= set("01234567") else value
            if octal != value:
                note = Text.of("eds.not_octal", value=decimal, taken=str(value), octal=str(octal))
            else:
                note = Text.of("eds.taken_as", value=decimal, taken=str(value))
    return (-value if sign == "-" else value), note


def expression(text: str) -> tuple[Value, Said]:
    """A number that may contain $NODEID once, on either side, and what is odd about it. Raises BadValue."""
    if not _NODE_ID.search(text):
        value, note = integer(text)
        return Value(value), note
    bare = re.sub(r"[\s()]", "", text.partition(";")[0])
    terms = re.findall(r"([+-]?)([^+-]+)", bare)
    total, nodes = 0, 0
    for sign, term in terms:
        if _NODE_ID.fullmatch(term) and sign != "-":
            nodes += 1
            continue
        value, _ = integer(term)
        total += -value if sign == "-" else value
    if nodes != 1 or "".join(sign + term for sign, term in terms) != bare:
        raise BadValue(Text.of("eds.not_expression", value=shown(text)))
    found = Value(total, True)
    if re.fullmatch(r"\$NODEID(\+(0x[0-9A-Fa-f]+|[0-9]+))?", text):
        return found, ""
    return found, Text.of("eds.taken_as", value=shown(text), taken=str(found))


def value(text: str, data_type: StaticDataType | None) -> tuple[Value, Said]:
    """``text`` as a value of ``data_type``, and what is odd about it. Raises BadValue."""
    if data_type in _TEXTS:
        return Value(text), ""
    if data_type in _BYTES:
        return Value(_octets(text)), ""
    if data_type in _REALS and not re.match(r"[+-]?0x", text.strip(), re.IGNORECASE):
        return Value(_real(text)), ""
    if data_type is None and not _NODE_ID.search(text):
        try:
            number, note = integer(text)
        except BadValue:
            return Value(text), ""
        return Value(number), note
    if data_type is StaticDataType.BOOLEAN and text.strip().lower() in ("true", "false"):
        return Value(int(text.strip().lower() == "true")), ""
    number, note = expression(text)
    if data_type is not None and data_type in _REALS:
        return Value(_real_from_bits(number, data_type)), note
    return _fitted(number, data_type, text), note


def encode(plain: int | float | str | bytes, data_type: StaticDataType) -> bytes:
    """A value as an SDO transfers it. Raises BadValue if it does not fit its type."""
    if isinstance(plain, bytes):
        return plain
    try:
        if isinstance(plain, str):
            return plain.encode("utf-16-le" if data_type is StaticDataType.UNICODE_STRING else "latin-1")
        if data_type in _REALS:
            return _REALS[data_type].encode(plain)
        if data_type in _INTEGERS and isinstance(plain, int):
            return _INTEGERS[data_type].encode(plain)
    except UnicodeEncodeError:
        raise BadValue(Text.of("eds.not_latin_1", value=shown(str(plain)))) from None
    except ValueError:
        raise BadValue(_beyond(str(plain), data_type)) from None
    raise BadValue(Text.of("eds.not_of_type", value=str(plain), type=data_type.name))


def _beyond(text: str, data_type: StaticDataType) -> Text:
    return Text.of("eds.beyond_type", value=text, type=data_type.name)


def bits_of_type(data_type: StaticDataType) -> int | None:
    """The length of a number; None for what may have any length."""
    found = _INTEGERS.get(data_type) or _REALS.get(data_type)
    return 8 * found.size if found else None


def _octets(text: str) -> bytes:
    bare = re.sub(r"[\s,]|0x", "", text.strip().strip('"'), flags=re.IGNORECASE)
    try:
        return bytes.fromhex(bare)
    except ValueError:
        raise BadValue(Text.of("eds.not_bytes", value=shown(text))) from None


def _real(text: str) -> float:
    try:
        number = float(text.strip().replace(",", "."))
    except ValueError:
        raise BadValue(Text.of("eds.not_number", value=shown(text))) from None
    if not math.isfinite(number):
        raise BadValue(Text.of("eds.not_finite", value=shown(text)))
    return number


def _real_from_bits(number: Value, data_type: StaticDataType) -> float:
    """0x3F800000 for 1.0, as CiA 306 writes reals."""
    real, plain = _REALS[data_type], number.plain
    if not isinstance(plain, int) or number.plus_node_id:
        raise BadValue(Text.of("eds.real_with_node_id"))
    try:
        found = real.decode(Integer(real.size).encode(plain))
    except ValueError:
        raise BadValue(_beyond(hex(plain), data_type)) from None
    if not math.isfinite(found):
        raise BadValue(Text.of("eds.not_finite", value=hex(plain)))
    return found


def _fitted(number: Value, data_type: StaticDataType | None, text: str) -> Value:
    """An integer within its type; 0xFFFF of an INTEGER16 is -1."""
    plain = number.plain
    if data_type is None or not isinstance(plain, int):
        return number
    fits = _INTEGERS[data_type]
    if fits.high < plain <= fits.high - fits.low and re.match(r"\s*0x", text, re.IGNORECASE):
        return Value(fits.from_word(plain), number.plus_node_id)
    if not number.plus_node_id and not fits.low <= plain <= fits.high:
        raise BadValue(_beyond(shown(text), data_type))
    return number
