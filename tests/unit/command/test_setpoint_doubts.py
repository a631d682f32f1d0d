"""Setpoints whose word means another value since a parameter was changed: in doubt until they are written."""

from __future__ import annotations

from bridge.command.setpoint_doubts import InForce, SetpointDoubts, words_of
from bridge.text import render


def speed(value: float, *words: int, places: tuple[int, ...] = (0,), unit: str = "Hz") -> InForce:
    return InForce(places, words or (0x2000,), value, unit)


def test_the_words_at_some_places() -> None:
    assert words_of((2, 0), (10, 11, 12)) == (12, 10)


def test_a_value_is_told_with_its_unit_and_no_more_digits_than_it_has() -> None:
    assert speed(25.0).text == "25 Hz"
    assert speed(2.5, unit="").text == "2.5"


def test_the_same_word_that_means_something_else_is_in_doubt() -> None:
    doubts = SetpointDoubts()
    why = doubts.note("frequency", speed(25.0), speed(50.0))
    assert render(why) == "written as 25 Hz, and the same word means 50 Hz since the drive was changed"
    assert doubts.why("frequency", (0x2000,)) == why
    assert doubts.has_any((0x2000,))


def test_another_word_or_the_same_value_is_in_no_doubt() -> None:
    doubts = SetpointDoubts()
    assert doubts.note("frequency", speed(25.0), speed(25.0)) == ""
    assert doubts.note("frequency", speed(25.0, 1), speed(50.0, 2)) == ""
    assert not doubts.has_any((0x2000,))


def test_a_second_change_still_tells_what_was_written() -> None:
    doubts = SetpointDoubts()
    doubts.note("frequency", speed(25.0), speed(50.0))
    why = doubts.note("frequency", speed(50.0), speed(100.0))
    assert render(why) == "written as 25 Hz, and the same word means 100 Hz since the drive was changed"


def test_another_word_in_its_place_ends_the_doubt_as_long_as_it_stands_there() -> None:
    doubts = SetpointDoubts()
    doubts.note("frequency", speed(25.0), speed(50.0))
    assert doubts.why("frequency", (0,)) == ""
    assert doubts.why("torque", (0x2000,)) == ""
    assert doubts.why("frequency", (0x2000,)) != ""


def test_what_is_written_anew_by_its_name_or_its_word_is_in_no_doubt() -> None:
    for names, places in (({"frequency"}, ()), ((), (0,))):
        doubts = SetpointDoubts()
        doubts.note("frequency", speed(25.0), speed(50.0))
        doubts.note("position", speed(1.0, 7, 0, places=(1, 2)), speed(2.0, 7, 0, places=(1, 2)))
        doubts.forget(names, places)
        assert doubts.why("frequency", (0x2000, 7, 0)) == ""
        assert doubts.why("position", (0x2000, 7, 0)) != ""
    doubts.forget((), (2,))
    assert not doubts.has_any((0x2000, 7, 0)), "one of its words is enough"
