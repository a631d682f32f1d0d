"""CANopen's data types on the wire: every one of them, there and back."""

from __future__ import annotations

import math
import struct
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.canopen.datatypes import (
    INTEGERS,
    NUMBERS,
    REALS,
    Integer,
    Plain,
    TypeName,
    decode,
    encode,
    readable,
    text,
)

CODES = {
    "bool": "?", "int8": "b", "int16": "h", "int32": "i", "int64": "q",
    "uint8": "B", "uint16": "H", "uint32": "I", "uint64": "Q", "real32": "f", "real64": "d",
}  # fmt: skip
"""The same types for Python's own codec."""
WHOLE = [kind for kind in INTEGERS if kind != "bool"]

values: dict[str, st.SearchStrategy[Plain]] = {
    "bool": st.booleans(),
    **{kind: st.integers(INTEGERS[kind].low, INTEGERS[kind].high) for kind in WHOLE},
    "real32": st.floats(width=32),
    "real64": st.floats(),
    "string": st.text(st.characters(max_codepoint=255, exclude_characters="\0")),
    "bytes": st.binary().map(lambda data: data.hex(" ").upper()),
}


def test_each_type_is_tested() -> None:
    assert set(values) == set(get_args(TypeName)) == {*NUMBERS, "string", "bytes"}
    assert set(CODES) == set(NUMBERS)


@pytest.mark.landing(13)
@pytest.mark.parametrize("kind", get_args(TypeName))
@given(data=st.data())
def test_a_value_comes_back_as_it_was(kind: str, data: st.DataObject) -> None:
    value = data.draw(values[kind])
    back = decode(kind, encode(kind, value))
    assert type(back) is type(value)
    assert back == value or (isinstance(value, float) and math.isnan(value))


@pytest.mark.parametrize("kind", CODES)
@given(data=st.data())
def test_numbers_are_little_endian(kind: str, data: st.DataObject) -> None:
    value = data.draw(values[kind])
    coded = encode(kind, value)
    assert coded == struct.pack(f"<{CODES[kind]}", value)
    assert len(coded) == NUMBERS[kind].size


@pytest.mark.parametrize("kind", NUMBERS)
@given(data=st.binary(max_size=12))
def test_missing_bytes_are_an_error_and_more_are_left_out(kind: str, data: bytes) -> None:
    size = NUMBERS[kind].size
    if len(data) < size:
        with pytest.raises(ValueError, match=f"a {kind} has {size} bytes, not {len(data)}"):
            decode(kind, data)
    else:
        assert repr(decode(kind, data)) == repr(decode(kind, data[:size]))


@pytest.mark.parametrize("kind", WHOLE)
@given(data=st.data())
def test_what_does_not_fit_is_refused_with_what_does(kind: str, data: st.DataObject) -> None:
    low, high = INTEGERS[kind].low, INTEGERS[kind].high
    with pytest.raises(ValueError, match=f"a {kind} is {low}…{high}"):
        encode(kind, data.draw(st.integers(max_value=low - 1) | st.integers(min_value=high + 1)))


@pytest.mark.parametrize("kind", WHOLE)
def test_a_whole_number_is_no_other_value(kind: str) -> None:
    wrong: tuple[Plain, ...] = (True, 1.0, "1")
    for value in wrong:
        with pytest.raises(ValueError, match=f"a {kind} is a whole number"):
            encode(kind, value)


@pytest.mark.parametrize(
    ("kind", "value", "message"),
    [
        ("bool", 2, "true or false"),
        ("bool", 1.0, "true or false"),
        ("bool", "1", "true or false"),
        ("real32", 1e39, "too large for a real32"),
        ("real32", 10**400, "too large for a real32"),
        ("real64", 10**400, "too large for a real64"),
        ("real64", True, "a real64 is a number"),
        ("real32", "1", "a real32 is a number"),
        ("string", 5, "a text in quotes"),
        ("string", "€", "ISO 8859-1"),
        ("bytes", 5, "a text in quotes"),
        ("bytes", "7", "hexadecimal"),
    ],
)
def test_a_value_of_another_kind_is_refused(kind: str, value: Plain, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        encode(kind, value)


def test_examples() -> None:
    assert encode("bool", True) == encode("bool", 1) == b"\x01"
    assert encode("real32", 1.5) == bytes.fromhex("0000C03F")
    assert encode("string", "save") == b"save"
    assert encode("bytes", "0A 1b") == b"\x0a\x1b"
    assert encode("int16", -2) == b"\xfe\xff"


@given(st.binary())
def test_a_text_ends_with_its_first_zero(data: bytes) -> None:
    assert text(data).encode("latin-1") == data.partition(b"\0")[0]
    assert decode("string", data) == text(data)


@pytest.mark.parametrize(
    ("data", "shown"),
    [
        (b"SK TU4-CAO\0\0", "SK TU4-CAO"),
        ("Förderband".encode(), "Förderband"),
        ("Förderband".encode("latin-1"), "Förderband"),
        ("Förderband Süd".encode()[:-2], "Förderband S"),
        ("GR\u00c4".encode("latin-1"), "GR\u00c4"),
        ("5 \u00b5m \u03a9".encode(), "5 \u00b5m \u03a9"),
        (b"", ""),
    ],
)
def test_a_text_is_shown_in_the_encoding_that_it_is_in(data: bytes, shown: str) -> None:
    assert readable(data) == shown


@given(st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"])))
def test_a_text_in_utf_8_is_shown_as_it_is(text: str) -> None:
    assert readable(text.encode()) == text


@given(st.binary())
def test_any_bytes_can_be_shown(data: bytes) -> None:
    assert "\0" not in readable(data)


@given(st.integers(1, 8), st.booleans(), st.data())
def test_a_word_stands_for_a_number_as_its_bytes_do(size: int, signed: bool, data: st.DataObject) -> None:
    number = Integer(size, signed)
    value = data.draw(st.integers(number.low, number.high))
    word = number.to_word(value)
    assert word.to_bytes(size, "little") == number.encode(value)
    assert number.from_word(word) == number.decode(number.encode(value)) == value


@given(st.integers(-0x8000, 0x7FFF))
def test_a_signed_word_is_its_twos_complement(number: int) -> None:
    assert INTEGERS["int16"].from_word(number & 0xFFFF) == number


@pytest.mark.parametrize("kind", REALS)
def test_a_real_may_be_no_number(kind: str) -> None:
    for value in (math.inf, -math.inf):
        assert REALS[kind].decode(REALS[kind].encode(value)) == value
    assert math.isnan(REALS[kind].decode(REALS[kind].encode(math.nan)))
