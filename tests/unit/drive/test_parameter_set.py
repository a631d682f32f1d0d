"""Parameter sets of a drive by the bits of a word."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.drive.parameter_set import ParameterSet


@pytest.mark.parametrize(
    ("word", "in_set"), [(0x0000, 1), (0x4000, 2), (0x8000, 3), (0xC000, 4), (0x3FFF, 1), (0xFFFF, 4)]
)
def test_nord_has_four_sets_by_bits_14_and_15(word: int, in_set: int) -> None:
    """BU 2500 §6.5.1: parameter set bit 0 and bit 1."""
    assert ParameterSet((14, 15)).of(word) == in_set
    assert ParameterSet((14, 15)).mask == 0xC000


@given(st.integers(0, 0xFFFF))
def test_without_bits_there_is_one_set(word: int) -> None:
    assert ParameterSet(()).of(word) == 1
    assert ParameterSet(()).mask == 0


def test_the_first_place_is_the_low_bit_wherever_it_stands() -> None:
    assert ParameterSet((7, 2)).of(0x80) == 2
    assert ParameterSet((7, 2)).of(0x04) == 3


@given(st.lists(st.integers(0, 15), min_size=1, max_size=4, unique=True), st.integers(0, 0xFFFF))
def test_only_its_bits_count(bits: list[int], word: int) -> None:
    sets = ParameterSet(bits)
    assert sets.of(word) == sets.of(word & sets.mask)
    assert sets.of(word & ~sets.mask) == 1
