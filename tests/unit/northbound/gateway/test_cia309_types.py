"""Values of CiA 309-3 as text and as the bytes of an object."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.northbound.gateway.cia309_types import TYPES, BadText, decode, encode
from bridge.northbound.gateway.syntax import parse


@pytest.mark.parametrize(
    ("kind", "words", "octets"),
    [
        ("b", "1", "01"),
        ("i8", "-1", "FF"),
        ("u16", "0xABCD", "CD AB"),
        ("i24", "-2", "FE FF FF"),
        ("u56", "0x01020304050607", "07 06 05 04 03 02 01"),
        ("i32", "-2", "FE FF FF FF"),
        ("u64", "18446744073709551615", "FF FF FF FF FF FF FF FF"),
        ("r32", "1.0", "00 00 80 3F"),
        ("r64", "1.0", "00 00 00 00 00 00 F0 3F"),
        ("t", "3 77", "4D 00 00 00 03 00"),
        ("td", "0 1", "01 00 00 00 00 00"),
        ("vs", "motor", "6D 6F 74 6F 72"),
        ("os", "AQID", "01 02 03"),
        ("us", "QQA=", "41 00"),
        ("d", "AQID", "01 02 03"),
        ("hex", "01 02", "01 02"),
    ],
)
def test_values_and_bytes(kind: str, words: str, octets: str) -> None:
    data = bytes.fromhex(octets)
    assert encode(kind, words.split()) == data
    assert encode(kind, decode(kind, data).split()) == data


@pytest.mark.parametrize("text", ["1_0", "\u0662", "nan", "inf", "2,5", "1e999", "0x10", "", "."])
def test_a_real_number_has_the_digits_0_to_9(text: str) -> None:
    with pytest.raises(BadText, match="r32 is a number that fits"):
        encode("r32", [text])


@given(st.sampled_from(sorted(TYPES - {"vs"})), st.binary(max_size=20))
def test_any_bytes_are_a_value_or_a_bad_one(kind: str, data: bytes) -> None:
    try:
        text = decode(kind, data)
    except BadText:
        return
    assert "\n" not in text
    if kind not in ("b", "r32", "r64", "t", "td"):
        assert data.startswith(encode(kind, text.split() or [""]))


@given(st.text(st.characters(max_codepoint=0xFF, min_codepoint=0x20, exclude_characters="\x7f"), min_size=1))
def test_a_visible_string_survives_the_line(text: str) -> None:
    data = text.encode("latin-1")
    line = parse(f"5 w 0x2000 0 vs {decode('vs', data)}")
    assert line.command.data.decode("latin-1").isprintable()  # type: ignore[union-attr]
