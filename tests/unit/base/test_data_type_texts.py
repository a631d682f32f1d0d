"""Texts for values that do not fit their data type."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.base.data_type_texts import text_of_misfit
from bridge.canopen.datatypes import INTEGERS, REALS, DataTypeError, Misfit, decode, encode
from bridge.text import render

KINDS = st.sampled_from([*INTEGERS, *REALS, "string", "bytes"])


def error_of(act: Callable[..., Any], *given: Any) -> DataTypeError | None:
    with contextlib.suppress(OverflowError):
        try:
            act(*given)
        except DataTypeError as error:
            return error
    return None


@given(KINDS, st.booleans() | st.integers() | st.floats() | st.text(max_size=9), st.binary(max_size=9))
def test_each_reads_as_the_library_has_it(kind: str, value: bool | int | float | str, data: bytes) -> None:
    for error in (error_of(encode, kind, value), error_of(decode, kind, data)):
        if error is not None:
            assert render(text_of_misfit(error)) == str(error)


@pytest.mark.parametrize(
    ("kind", "value", "misfit", "german"),
    [
        ("bool", 2, Misfit.NO_BOOL, "ein bool ist true oder false"),
        ("int8", 1.5, Misfit.NOT_WHOLE, "int8 ist eine ganze Zahl"),
        ("real32", "a", Misfit.NO_NUMBER, "real32 ist eine Zahl"),
        ("string", 1, Misfit.NO_TEXT, "string ist ein Text in Anführungszeichen"),
        ("bytes", "0x", Misfit.NO_BYTES, "Bytes sind Paare hexadezimaler Ziffern"),
        ("int8", 128, Misfit.OUT_OF_RANGE, "int8 ist -128…127"),
        ("real32", 1e39, Misfit.TOO_LARGE, "1e+39 ist zu groß für real32"),
        ("string", "€", Misfit.NOT_LATIN, "ein string hat nur Zeichen aus ISO 8859-1"),
    ],
)
def test_each_kind_of_value_is_told_in_german(
    kind: str, value: int | float | str, misfit: Misfit, german: str
) -> None:
    error = error_of(encode, kind, value)
    assert error is not None
    assert error.misfit is misfit
    assert render(text_of_misfit(error), "de") == german


def test_bytes_that_are_missing_are_counted() -> None:
    error = error_of(decode, "uint32", b"12")
    assert error is not None
    assert render(text_of_misfit(error), "de") == "uint32 hat 4 Bytes, nicht 2"
