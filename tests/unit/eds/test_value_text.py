"""Values of device descriptions (CiA 306 §4.3): numbers, node ids, reals, bytes, and odd spellings."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.eds.model import StaticDataType, Value
from bridge.eds.value_text import BadValue, bits_of_type, encode, expression, integer, value
from bridge.text import render


@pytest.mark.parametrize(
    ("text", "number", "note"),
    [
        ("5", 5, ""),
        (" -5 ", -5, ""),
        ("0x1F", 31, ""),
        ("0X1f", 31, ""),
        ("-0x10", -16, ""),
        ("001", 1, "001 is taken as 1"),
        ("010", 10, "010 is taken as 10, not as octal 8"),
        ("089", 89, "089 is taken as 89"),
        ("000", 0, ""),
        ("1Fh", 31, "1Fh is taken as 0x1F"),
        ("5 ; comment", 5, "5 ; comment: what follows the semicolon is taken as a comment"),
    ],
)
def test_a_number_is_read_as_tools_write_it(text: str, number: int, note: str) -> None:
    read, odd = integer(text)
    assert (read, render(odd)) == (number, note)


@pytest.mark.parametrize("text", ["", "x", "1F", "0x", "1.5", "--5", "h", "5 5", "٣"])
def test_what_is_no_number_is_named(text: str) -> None:
    with pytest.raises(BadValue, match="is not a number"):
        integer(text)


@pytest.mark.parametrize(
    ("text", "found", "is_usual"),
    [
        ("$NODEID+0x180", Value(0x180, True), True),
        ("$NODEID", Value(0, True), True),
        ("$NODEID+384", Value(384, True), True),
        ("0x180+$NODEID", Value(0x180, True), False),
        ("NodeID + 0x180", Value(0x180, True), False),
        ("($NODE_ID+0x180)", Value(0x180, True), False),
        ("0x200-1+$NODEID", Value(0x1FF, True), False),
        ("0x180", Value(0x180), True),
    ],
)
def test_a_node_id_stands_on_either_side(text: str, found: Value, is_usual: bool) -> None:
    read, note = expression(text)
    assert read == found
    assert (note == "") is is_usual


@pytest.mark.parametrize("text", ["$NODEID+$NODEID", "5-$NODEID", "$NODEID*2", "$NODEID+", "$NODEID 5+"])
def test_what_is_no_sum_with_one_node_id_is_refused(text: str) -> None:
    with pytest.raises(BadValue):
        expression(text)


@pytest.mark.parametrize(
    ("text", "kind", "plain"),
    [
        ("0xFFFF", StaticDataType.INTEGER16, -1),
        ("0x7FFF", StaticDataType.INTEGER16, 32767),
        ("65535", StaticDataType.UNSIGNED16, 65535),
        ("true", StaticDataType.BOOLEAN, 1),
        ("False", StaticDataType.BOOLEAN, 0),
        ("0x3F800000", StaticDataType.REAL32, 1.0),
        ("1,5", StaticDataType.REAL32, 1.5),
        ("-2.5e3", StaticDataType.REAL64, -2500.0),
        ("SK 500", StaticDataType.VISIBLE_STRING, "SK 500"),
        ("0A 1B", StaticDataType.OCTET_STRING, b"\x0a\x1b"),
        ('"0x0A,0x1B"', StaticDataType.DOMAIN, b"\x0a\x1b"),
        ("text", None, "text"),
        ("7", None, 7),
    ],
)
def test_a_value_is_read_by_its_type(text: str, kind: StaticDataType | None, plain: object) -> None:
    assert value(text, kind)[0] == Value(plain)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("65536", StaticDataType.UNSIGNED16),
        ("-32769", StaticDataType.INTEGER16),
        ("65535", StaticDataType.INTEGER16),
        ("0x10000", StaticDataType.INTEGER16),
        ("nan", StaticDataType.REAL32),
        ("0x7F800000", StaticDataType.REAL32),
        ("0x1FFFFFFFF", StaticDataType.REAL32),
        ("$NODEID+1", StaticDataType.REAL32),
        ("fast", StaticDataType.REAL64),
        ("0A 1", StaticDataType.OCTET_STRING),
    ],
)
def test_what_is_beyond_its_type_is_refused(text: str, kind: StaticDataType) -> None:
    with pytest.raises(BadValue):
        value(text, kind)


@pytest.mark.parametrize(
    ("plain", "kind", "data"),
    [
        (-1, StaticDataType.INTEGER16, "FFFF"),
        (-1, StaticDataType.INTEGER24, "FFFFFF"),
        (1, StaticDataType.BOOLEAN, "01"),
        (0x123456, StaticDataType.UNSIGNED24, "563412"),
        (1.0, StaticDataType.REAL32, "0000803F"),
        ("Ü", StaticDataType.VISIBLE_STRING, "DC"),
        ("Ü", StaticDataType.UNICODE_STRING, "DC00"),
        (b"\x01", StaticDataType.DOMAIN, "01"),
    ],
)
def test_a_value_is_transferred_with_its_low_byte_first(
    plain: int | float | str | bytes, kind: StaticDataType, data: str
) -> None:
    assert encode(plain, kind) == bytes.fromhex(data)


@pytest.mark.parametrize(
    ("plain", "kind", "told"),
    [
        (256, StaticDataType.UNSIGNED8, "256 is beyond UNSIGNED8"),
        (-1, StaticDataType.UNSIGNED8, "-1 is beyond UNSIGNED8"),
        ("電", StaticDataType.VISIBLE_STRING, "電 has characters beyond ISO 8859-1"),
        (1.5, StaticDataType.UNSIGNED8, "1.5 is no UNSIGNED8"),
        (5, StaticDataType.DOMAIN, "5 is no DOMAIN"),
    ],
)
def test_what_does_not_fit_is_told(plain: int | float | str, kind: StaticDataType, told: str) -> None:
    with pytest.raises(BadValue) as caught:
        encode(plain, kind)
    assert str(caught.value) == told


@pytest.mark.parametrize(
    ("kind", "bits"),
    [
        (StaticDataType.BOOLEAN, 8),
        (StaticDataType.INTEGER24, 24),
        (StaticDataType.UNSIGNED64, 64),
        (StaticDataType.REAL64, 64),
        (StaticDataType.TIME_OF_DAY, 48),
        (StaticDataType.VISIBLE_STRING, None),
        (StaticDataType.DOMAIN, None),
    ],
)
def test_the_length_of_a_number(kind: StaticDataType, bits: int | None) -> None:
    """CiA 301 §7.1.6."""
    assert bits_of_type(kind) == bits


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_a_real_is_the_same_by_its_bits(number: float) -> None:
    bits = struct.unpack("<I", struct.pack("<f", number))[0]
    found = value(f"0x{bits:08X}", StaticDataType.REAL32)[0].plain
    assert isinstance(found, float)
    assert math.isclose(found, number, rel_tol=0, abs_tol=0)


@given(st.text(max_size=20), st.sampled_from([*StaticDataType, None]))
def test_no_text_raises_anything_else(text: str, kind: StaticDataType | None) -> None:
    try:
        value(text, kind)
    except BadValue as error:
        assert str(error)
