"""TOML as a person would have written it: names, texts and numbers that read back as they were."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.derive.toml import file_name, number, one_line, string, strings, value, word


def back(text: str) -> object:
    return tomllib.loads(f"x = {text}")["x"]


@given(
    st.one_of(
        st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False, allow_infinity=False)
    )
)
def test_a_value_reads_back_with_its_type(plain: bool | int | float) -> None:
    read = back(value(plain))
    assert read == plain
    assert type(read) is type(plain)


@given(st.text(st.characters(exclude_categories=["Cs"])))
def test_a_text_reads_back(text: str) -> None:
    assert back(value(text)) == text


@given(st.text())
def test_a_title_is_one_line_and_reads_back_as_that(text: str) -> None:
    assert back(string(text)) == one_line(text)
    assert "\n" not in one_line(text)
    assert back(strings([text, "b"])) == [one_line(text), "b"]


@pytest.mark.parametrize("plain", [float("inf"), float("-inf"), float("nan")])
def test_a_number_that_no_file_can_hold_is_refused(plain: float) -> None:
    with pytest.raises(ValueError, match="is no number for a file"):
        value(plain)


def test_a_number_that_may_have_decimals_has_a_point() -> None:
    assert number(5) == "5.0"
    with pytest.raises(ValueError, match="is too large"):
        number(10**400)


@pytest.mark.parametrize(
    ("plain", "digits", "text"), [(0x6040, 4, "0x6040"), (5, 4, "0x0005"), (0x38, 8, "0x00000038")]
)
def test_a_word_is_hexadecimal(plain: int, digits: int, text: str) -> None:
    assert word(plain, digits) == text


@given(st.text())
def test_a_file_name_is_plain_ascii(text: str) -> None:
    name = file_name(text)
    assert name == name.lower()
    assert all(one.isascii() and (one.isalnum() or one == "-") for one in name)
    assert not name.startswith("-")
