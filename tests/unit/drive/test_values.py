"""Values of all kinds: numbers of 16 and 32 bits with and without sign, enumerations, bits."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.drive import ValueCodec, scale_of
from bridge.mapping.model import ProcessValue
from bridge.text import render

WORDS = ("first", "second", "third")


def codec(full: float | None = None, **entries: object) -> ValueCodec:
    given_words = {} if "words" in entries else {"word": "second"}
    model = ProcessValue.model_validate({"name": "it", "group": "command", **given_words, **entries})
    return ValueCodec(model, WORDS, scale_of(model, full))


def written(it: ValueCodec, value: float) -> list[int]:
    words = [0, 0, 0]
    for one in it.to_words(value):
        words[one.place] |= one.bits
    return words


@pytest.mark.parametrize(
    ("data_type", "words", "number"),
    [
        ("int16", [0, 0xFFFF, 0], -1),
        ("uint16", [0, 0xFFFF, 0], 0xFFFF),
        ("int32", [0, 0xFFFE, 0xFFFF], -2),
        ("uint32", [0, 0xFFFE, 0xFFFF], 0xFFFF_FFFE),
        # BU 2500 §6.5.4: 2800.758 rev is 002ABC76h, the low word first.
        ("int32", [0, 0xBC76, 0x002A], 0x002A_BC76),
    ],
)
def test_a_number_is_read_by_its_type_and_written_back(data_type: str, words: list[int], number: int) -> None:
    places = {"words": ["second", "third"]} if data_type.endswith("32") else {}
    it = codec(data_type=data_type, **places)
    assert it.from_words(words) == number
    assert written(it, number) == words


@given(st.integers(-(2**31), 2**31 - 1))
def test_a_scaled_number_of_32_bits_comes_back(number: int) -> None:
    it = codec(words=["first", "third"], scale={"factor": 0.01, "offset": -5.0})
    words = [number & 0xFFFF, 0x1234, number >> 16 & 0xFFFF]
    value = it.from_words(words)
    assert value == pytest.approx(number * 0.01 - 5.0)
    assert written(it, value) == [words[0], 0, words[2]]


def test_a_parameter_scales_a_number_without_sign() -> None:
    it = codec(50.0, data_type="uint16", scale={"full": "P1", "at": 0x4000, "limit": 4.0})
    assert it.from_words([0, 0xC000, 0]) == 150.0
    assert it.range == (0.0, pytest.approx(199.997))


def test_the_range_is_the_narrowest_of_word_limit_and_file() -> None:
    it = codec(50.0, scale={"full": "P1", "at": 0x4000}, low=-10.0)
    assert it.range == (-10.0, pytest.approx(99.997))
    assert codec(low=-3.0, high=7.0).range == (-3.0, 7.0)
    assert codec().range == (None, None)


def test_a_negative_factor_turns_the_range_round() -> None:
    it = codec(scale={"factor": -0.1})
    assert it.range == (pytest.approx(-3276.7), pytest.approx(3276.8))
    assert written(it, 1.0) == [0, 0xFFF6, 0]


def test_an_unknown_scale_gives_the_bare_number_and_says_why() -> None:
    it = codec(scale={"full": "P1", "at": 100})
    assert it.is_unknown
    assert it.from_words([0, 0xFFFF, 0]) == -1.0
    assert render(it.why_unknown) == "P1 cannot be read and is not in the site file"


def test_an_enumeration_takes_its_own_numbers() -> None:
    it = codec(states={0: "off", 6: "homing"})
    assert it.from_words([0, 6, 0]) == 6
    assert written(it, 6) == [0, 6, 0]
    with pytest.raises(ValueError, match="takes 0 off, 6 homing, not 5"):
        it.to_words(5)


def test_one_bit_is_true_or_false_and_sets_nothing_else() -> None:
    it = codec(bit=3)
    assert it.from_words([0, 0x0008, 0]) is True
    assert it.from_words([0, 0xFFF7, 0]) is False
    (one,) = it.to_words(True)
    assert (one.place, one.mask, one.bits) == (1, 0x0008, 0x0008)
    with pytest.raises(ValueError, match="takes true or false"):
        it.to_words(2)


@pytest.mark.parametrize("value", [-1, 0x1_0000, 1.5, float("nan"), float("inf")])
def test_what_is_no_word_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="takes"):
        codec(bits=["a"]).to_words(value)
