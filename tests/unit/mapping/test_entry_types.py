"""Single entries of a mapping file: objects, patterns, codes, numbers, and what is said of others."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from bridge.mapping.entry_types import (
    Decimal,
    EmcyCode,
    FaultNumber,
    Mapped,
    ObjectRef,
    Pattern,
    Ref,
    States,
    pattern_bits,
)


def read(kind: object, text: object) -> object:
    return TypeAdapter(kind).validate_python(text)


def refusal(kind: object, text: object) -> str:
    with pytest.raises(ValidationError) as caught:
        read(kind, text)
    return caught.value.errors()[0]["msg"].removeprefix("Value error, ")


def test_an_object_is_index_and_sub_index_in_hexadecimal() -> None:
    assert read(Ref, "3002:0a") == ObjectRef(0x3002, 0x0A)
    assert str(ObjectRef(0x3002, 0x0A)) == "3002:0A"
    assert sorted([ObjectRef(2, 0), ObjectRef(1, 9), ObjectRef(1, 1)])[0] == ObjectRef(1, 1)


@pytest.mark.parametrize("text", ["", "3002", "3002:1", "0x3002:01", "3002:001", "G002:01", 3002, None])
def test_anything_else_is_none(text: object) -> None:
    assert refusal(Ref, text) == 'must be an object as "3002:01", index and sub-index in hexadecimal'


@given(st.integers(0, 0xFFFF), st.integers(0, 0xFF))
def test_an_object_reads_back_as_it_is_written(index: int, sub: int) -> None:
    assert read(Ref, str(ObjectRef(index, sub))) == ObjectRef(index, sub)


@pytest.mark.parametrize(
    ("text", "lengths", "is_composite"),
    [
        ("6040:00", (16,), False),
        ("6060:00/8", (8,), False),
        ("607A:00/32", (32,), False),
        ("2AC8:00+2830:00", (8, 8), True),
        ("2AC8:00/4+2830:00/12", (4, 12), True),
    ],
)
def test_what_may_stand_for_a_word(text: str, lengths: tuple[int, ...], is_composite: bool) -> None:
    found = TypeAdapter(Mapped).validate_python(text)
    assert (found.lengths, found.is_composite, str(found)) == (lengths, is_composite, text)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("6040:00/0", "must have 1…64 bits"),
        ("6040:00/65", "must have 1…64 bits"),
        ("6040:00/12+6041:00/8", "has 20 bits, a word has 16"),
        ("6040:00+6041:00+6042:00", "has 24 bits, a word has 16"),
        ("6040:00+", "must be an object as"),
        ("", "must be an object as"),
    ],
)
def test_what_may_not(text: str, why: str) -> None:
    assert refusal(Mapped, text).startswith(why)


@pytest.mark.parametrize(
    ("pattern", "mask", "value"),
    [("0XX1000", 0b1001111, 0b0001000), ("X", 0, 0), ("1", 1, 1), ("X1XX XXXX X01X 0111", 0x406F, 0x4027)],
)
def test_a_pattern_is_a_mask_and_a_value(pattern: str, mask: int, value: int) -> None:
    assert pattern_bits(str(read(Pattern, pattern))) == (mask, value)


@pytest.mark.parametrize("text", ["", "2", "x", "0" * 17])
def test_what_is_no_pattern(text: str) -> None:
    assert "0, 1 and X" in refusal(Pattern, text)


@given(st.text("01X", min_size=1, max_size=16), st.integers(0, 0xFFFF))
def test_a_word_matches_where_each_bit_is_as_written_or_does_not_matter(pattern: str, word: int) -> None:
    mask, value = pattern_bits(pattern)
    bits = zip(reversed(pattern), (word >> place & 1 for place in range(16)), strict=False)
    assert (word & mask == value) is all(want in ("X", str(bit)) for want, bit in bits)


@pytest.mark.parametrize("text", ["2310", "FF12", "23xx"])
def test_an_emergency_code_has_four_digits_or_is_a_group(text: str) -> None:
    assert read(EmcyCode, text) == text


@pytest.mark.parametrize("text", ["231", "ff12", "2xxx", "23XX", "0x2310"])
def test_what_is_no_emergency_code(text: str) -> None:
    assert "four hexadecimal digits" in refusal(EmcyCode, text)


def test_numbers_of_faults_and_states() -> None:
    assert read(FaultNumber, "10.3") == "10.3"
    assert "one decimal" in refusal(FaultNumber, "10")
    assert read(Decimal, "007") == "7"
    assert "in decimal" in refusal(Decimal, "0x7")
    assert read(States, {"-1": "reverse", "3": "third", 4: "fourth"}) == {
        -1: "reverse",
        3: "third",
        4: "fourth",
    }
    assert "in decimal" in refusal(States, {"three": "x"})
