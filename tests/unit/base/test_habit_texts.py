"""Habits of devices as texts: in English as ``canopen`` says them."""

from __future__ import annotations

import pytest

from bridge.base.habit_texts import text_of_habit
from bridge.canopen.habits import HabitCount, Odd
from bridge.text import render


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("odd", Odd)
def test_each_reads_as_canopen_says_it(odd: Odd, count: int) -> None:
    shown = HabitCount(odd, count, 4, 8)
    text = text_of_habit(shown)
    assert render(text) == str(shown)
    assert render(text, "de") != str(shown)


def test_and_in_german() -> None:
    shown = HabitCount(Odd.SDO_LENGTH, 3, 4, 8)
    said = "3 SDO-Antworten mit 4 Bytes: nicht nach CiA 301 §7.2.4.3, ein SDO hat 8"
    assert render(text_of_habit(shown), "de") == said
