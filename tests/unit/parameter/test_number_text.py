"""A number is read as its writer means it, or not at all (docs/reference/numbers.md)."""

from __future__ import annotations

from typing import Any

import pytest

from bridge.parameter.number_text import Language, NumberError, read_number, written
from tests.support.number_table import CASES

LANGUAGES: tuple[Language, ...] = ("en", "de")


@pytest.mark.landing(3)
@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("case", CASES, ids=lambda case: ascii(case["text"]))
def test_a_text_is_the_number_that_the_table_says(case: dict[str, Any], language: Language) -> None:
    wanted = case[language]
    if isinstance(wanted, str):
        with pytest.raises(NumberError) as refused:
            read_number(case["text"], language)
        assert refused.value.why == wanted
        assert list(refused.value.readings) == (case["readings"] if wanted == "ambiguous" else [])
    else:
        found = read_number(case["text"], language)
        assert found.value == wanted
        assert found.is_other == (case.get("other_notation_in") == language)


def test_no_text_is_two_numbers() -> None:
    """A text that both languages take at once is the same number in both, unless each may take it for its
    own."""
    for case in CASES:
        english, german = case["en"], case["de"]
        if isinstance(english, int | float) and isinstance(german, int | float):
            assert english == german, case


def test_a_whole_number_keeps_all_its_digits() -> None:
    found = read_number("18446744073709551615", "en").value
    assert isinstance(found, int)
    assert found == 18446744073709551615


@pytest.mark.parametrize("value", [0.0, 1.5, -1.125, 1500.0, 1e-7, 16777215.0, 1e20])
def test_what_is_written_is_read_as_the_same_number(value: float) -> None:
    assert read_number(written(value), "en").value == value
