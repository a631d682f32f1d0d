"""Habits of devices: from which frame on one is named, what is said, and when it is news again."""

from __future__ import annotations

import pytest

from bridge.canopen.habits import HABITS, HabitCount, HabitCounter, Odd


def test_every_oddity_has_its_sentences() -> None:
    assert set(HABITS) == set(Odd)


@pytest.mark.parametrize(
    ("odd", "has", "due", "one", "many"),
    [
        (
            Odd.SDO_LENGTH,
            4,
            8,
            "1 SDO answer of 4 bytes: not CiA 301 §7.2.4.3, an SDO has 8",
            "2 SDO answers",
        ),
        (
            Odd.HEARTBEAT_LENGTH,
            2,
            1,
            "1 heartbeat of 2 bytes: not CiA 301 §7.2.8.3, a heartbeat has 1",
            "2 heartbeats",
        ),
        (
            Odd.EMCY_LENGTH,
            2,
            8,
            "1 emergency message of 2 bytes: not CiA 301 §7.2.7, an emergency message has 8",
            "2 emergency messages",
        ),
        (Odd.TPDO_LENGTH, 6, 8, "1 TPDO of 6 bytes: not CiA 301 §7.2.2, the mapping has 8", "2 TPDOs"),
        (Odd.TPDO_LENGTH_BY_FILE, 6, 8, "1 TPDO of 6 bytes: the mapping file has 8", "2 TPDOs"),
        (
            Odd.SDO_LATE,
            700,
            500,
            "1 SDO answer 700 ms after the request: sdo_timeout_ms is 500",
            "2 SDO answers",
        ),
    ],
)
def test_each_is_told_with_its_number_and_what_is_right(
    odd: Odd, has: int, due: int, one: str, many: str
) -> None:
    counter = HabitCounter()
    counter.note(odd, has, due)
    assert [str(shown) for shown in counter.said()] == [one]
    counter.note(odd, has, due)
    assert str(counter.said()[0]).startswith(f"{many} ")


def test_a_habit_is_one_from_the_third_frame_on() -> None:
    counter = HabitCounter()
    for _ in range(2):
        counter.note(Odd.SDO_LENGTH, 4, 8)
    assert not counter.has_news
    assert counter.habits() == counter.take_news() == []
    assert len(counter.said()) == 1
    counter.note(Odd.SDO_LENGTH, 4, 8)
    assert counter.has_news
    assert counter.take_news() == counter.habits() == [HabitCount(Odd.SDO_LENGTH, 3, 4, 8)]
    assert not counter.has_news


def test_it_is_news_again_when_it_has_shown_ten_times_as_often() -> None:
    counter, news = HabitCounter(), []
    for number in range(1, 301):
        counter.note(Odd.SDO_LATE, 700, 500)
        if counter.has_news:
            news.append(number)
            assert str(counter.take_news()[0]).startswith(f"{number} SDO answers")
    assert news == [3, 30, 300]


def test_who_asks_late_is_told_once_and_of_the_last_frame() -> None:
    counter = HabitCounter()
    for length in range(50):
        counter.note(Odd.TPDO_LENGTH, length, 8)
    assert counter.take_news() == [HabitCount(Odd.TPDO_LENGTH, 50, 49, 8)]
    for _ in range(249):
        counter.note(Odd.TPDO_LENGTH, 1, 8)
    assert counter.take_news() == []
    counter.note(Odd.TPDO_LENGTH, 1, 8)
    assert len(counter.take_news()) == 1


def test_habits_are_counted_apart() -> None:
    counter = HabitCounter()
    for _ in range(3):
        counter.note(Odd.SDO_LENGTH, 4, 8)
    counter.note(Odd.EMCY_LENGTH, 2, 8)
    assert len(counter.said()) == 2
    assert len(counter.habits()) == 1
