"""Habits of nodes as ``monitor`` names them from what it hears."""

from __future__ import annotations

from bridge.bustools.habit_watch import HabitWatch
from bridge.canopen.frame import REMOTE, Frame
from bridge.canopen.habits import HABITS, HabitCounter, Odd


def heard(*frames: tuple[int, str, float]) -> list[str]:
    """Habits found of node 5; its TPDO1 has four bytes by its mapping file."""
    watch = HabitWatch(lambda node_id: 0.5, lambda cob_id: 4 if cob_id == 0x185 else None)
    for can_id, data, time in frames:
        watch.on_frame(Frame(can_id, bytes.fromhex(data), time), 5)
    return watch.habits().get(5, [])


def test_what_is_as_the_standard_says_is_no_habit() -> None:
    assert heard((0x705, "05", 0.0), (0x185, "01020304", 0.0), (0x85, "00" * 8, 0.0)) == []
    assert heard((0x605, "40" + "00" * 7, 0.0), (0x585, "43" + "00" * 7, 0.1)) == []
    assert heard((0x705 | REMOTE, "00" * 8, 0.0)) == []


def test_heartbeats_of_eight_bytes_are_counted_and_named() -> None:
    beats = [(0x705, "05" + "00" * 7, 0.1 * place) for place in range(32)]
    assert heard(*beats) == ["32 heartbeats of 8 bytes: not CiA 301 §7.2.8.3, a heartbeat has 1"]


def test_short_sdo_answers_are_named() -> None:
    assert heard((0x585, "43" + "00" * 5, 0.0)) == [
        "1 SDO answer of 6 bytes: not CiA 301 §7.2.4.3, an SDO has 8"
    ]


def test_an_answer_after_the_time_out_is_named_with_both_times() -> None:
    """The abort that the client has sent in between asks for nothing."""
    said = heard((0x605, "40" + "00" * 7, 1.0), (0x605, "80" + "00" * 7, 1.5), (0x585, "43" + "00" * 7, 1.7))
    assert said == ["1 SDO answer 700 ms after the request: sdo_timeout_ms is 500"]


def test_a_padded_tpdo_is_named_by_the_mapping_file() -> None:
    assert heard((0x185, "00" * 8, 0.0)) == ["1 TPDO of 8 bytes: the mapping file has 4"]


def test_every_row_of_the_table_says_its_numbers() -> None:
    for habit in HABITS.values():
        for count in (1, 32):
            said = habit.said(count, 8, 4711)
            assert str(count) in said and "8" in said and "4711" in said and "{" not in said
    assert HABITS.keys() == set(Odd)


def test_three_odd_frames_are_a_habit_and_ten_times_as_many_are_news_again() -> None:
    counter = HabitCounter()
    news = 0
    for _ in range(300):
        counter.note(Odd.TPDO_LENGTH, 8, 4)
        news += len(counter.take_news())
    assert news == 3, "at 3, 30 and 300"
