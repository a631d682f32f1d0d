"""The image: present values, and who has not yet seen which change."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.image import DataType, Feed, Image, Point, Quality, Reading
from bridge.text import Text

POINTS = [
    Point(name="a/b/actual/frequency", data_type=DataType.FLOAT),
    Point(name="a/b/status/state", data_type=DataType.UINT8),
    Point(name="a/b/status/fault_text", data_type=DataType.STRING),
    Point(name="a/b/supervision/restart_interlock", data_type=DataType.BOOL),
]


@pytest.fixture
def image() -> Image:
    return Image(POINTS)


def seen(feed: Feed) -> list[int]:
    return feed.take(100)


def test_a_point_that_never_had_a_value_is_waiting_with_the_zero_of_its_type(image: Image):
    assert [image[i] for i in range(4)] == [
        Reading(value, Quality.WAITING, 0.0, "") for value in (0.0, 0, "", False)
    ]


def test_points_are_found_by_name(image: Image):
    image.set(1, 4, 12.5)
    assert image.read("a/b/status/state") == Reading(4, Quality.GOOD, 12.5, "")
    with pytest.raises(KeyError):
        image.read("a/b/status/nothing")


def test_two_points_of_one_name_are_a_fault_of_the_program():
    with pytest.raises(ValueError, match="same name"):
        Image([POINTS[0], POINTS[0]])


def test_storing_what_is_there_changes_nothing(image: Image):
    image.set(0, 25.0, 1.0, Quality.STALE, "no data")
    feed = image.feed()
    seen(feed)
    image.set(0, 25.0, 2.0, Quality.STALE, "no data")
    image.set_values([0], [25.0], 2.0)
    assert image[0].time == 1.0
    assert not feed


@pytest.mark.parametrize(
    ("value", "quality", "reason"),
    [(26.0, Quality.GOOD, ""), (25.0, Quality.STALE, ""), (25.0, Quality.GOOD, "because")],
)
def test_each_part_of_a_reading_is_a_change(image: Image, value: float, quality: Quality, reason: str):
    image.set(0, 25.0, 1.0)
    feed = image.feed()
    seen(feed)
    image.set(0, value, 2.0, quality, reason)
    assert seen(feed) == [0]
    assert image[0] == Reading(value, quality, 2.0, reason)


def test_values_alone_keep_their_quality(image: Image):
    image.set(0, 1.0, 1.0, Quality.DEVICE_FAULT, "why")
    feed = image.feed()
    seen(feed)
    image.set_values([0, 1], [2.0, 0], 3.0)
    assert image[0] == Reading(2.0, Quality.DEVICE_FAULT, 3.0, "why")
    assert image[1].quality is Quality.WAITING
    assert seen(feed) == [0]


def test_a_judgement_keeps_the_value(image: Image):
    image.set(0, 25.0, 1.0)
    image.judge([0, 1], Quality.LOST, 2.0, "node lost")
    assert image[0] == Reading(25.0, Quality.LOST, 2.0, "node lost")
    assert image[1].quality is Quality.LOST


class TestFeed:
    def test_a_new_one_is_shown_every_point_once(self, image: Image):
        feed = image.feed()
        assert len(feed) == 4
        assert seen(feed) == [0, 1, 2, 3]
        assert seen(feed) == []

    def test_the_newest_value_wins(self, image: Image):
        feed = image.feed()
        seen(feed)
        image.set(0, 1.0, 1.0)
        image.set(0, 2.0, 2.0)
        assert seen(feed) == [0]

    def test_chunks_come_longest_waiting_first_and_none_is_passed_over(self, image: Image):
        feed = image.feed()
        seen(feed)
        for index in (3, 0, 2):
            image.set(index, "x" if index == 2 else 1, 1.0)
        assert feed.take(2) == [3, 0]
        image.set_values([0, 1], [5.0, 5], 2.0)
        assert feed.take(1) == [2]
        assert feed.take(0) == []
        assert feed.take(9) == [0, 1]

    def test_a_slow_one_does_not_hold_up_another(self, image: Image):
        slow, quick = image.feed(), image.feed()
        image.set(0, 1.0, 1.0)
        assert seen(quick) == [0, 1, 2, 3]
        assert len(slow) == 4

    def test_what_changes_by_itself_is_there_at_once_and_told_later(self, image: Image):
        feed = image.feed()
        seen(feed)
        image.keep(1, 7, 1.0)
        assert image[1].value == 7
        assert (image[1].quality, image[1].time) == (Quality.GOOD, 1.0)
        assert not feed
        image.tell_kept()
        assert seen(feed) == [1]
        image.keep(1, 7, 2.0)
        image.tell_kept()
        assert not feed, "nothing has changed"

    def test_what_was_looked_at_before_it_is_told_is_told_all_the_same(self, image: Image):
        feed = image.feed()
        image.keep(1, 7, 1.0)
        image.tell_kept()
        seen(feed)
        image.keep(1, 8, 2.0)
        image.keep(1, 9, 2.1)
        image.tell_kept()
        assert seen(feed) == [1]

    def test_what_changes_by_itself_is_told_of_some_points_alone(self, image: Image):
        feed = image.feed()
        seen(feed)
        image.keep(1, 7, 1.0)
        image.keep(2, True, 1.0)
        image.tell_kept_of([0, 1])
        assert seen(feed) == [1]
        image.tell_kept()
        assert seen(feed) == [2], "each of them once"

    def test_some_points_are_taken_out_of_turn(self, image: Image):
        feed = image.feed()
        assert feed.take_of([3, 1]) == [3, 1]
        assert feed.take_of([3, 1]) == []
        assert seen(feed) == [0, 2]

    def test_it_is_told_of_the_first_change_since_it_took_all(self, image: Image):
        told: list[int] = []
        feed = image.feed(lambda: told.append(len(feed)))
        image.set(0, 1.0, 1.0)
        assert told == [], "there are changes from the beginning"
        feed.take(3)
        image.set(0, 2.0, 1.0)
        assert told == [], "one has been waiting"
        for change in (
            lambda: image.set(0, 3.0, 1.0),
            lambda: image.set_values([0, 1], [4.0, 4], 1.0),
            lambda: image.renew(1, 4, 2.0),
            lambda: (image.keep(1, 5, 2.0), image.tell_kept()),
            lambda: image.judge([0, 1], Quality.LOST, 2.0),
        ):
            seen(feed)
            told.clear()
            change()
            assert told == [0]
        seen(feed)
        image.tell_kept()
        image.set_values([0], [4.0], 3.0)
        assert told == [0], "nothing has changed"

    def test_a_dropped_one_is_marked_no_more(self, image: Image):
        feed = image.feed()
        seen(feed)
        image.drop_feed(feed)
        image.set(0, 9.0, 1.0)
        assert not feed

    @given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 5), st.integers(1, 4))))
    def test_who_takes_all_has_seen_the_present_values(self, steps: list[tuple[int, int, int]]):
        image = Image(Point(name=f"p{i}", data_type=DataType.UINT8) for i in range(4))
        feed = image.feed()
        known: dict[int, object] = {}
        for index, value, most in steps:
            image.set(index, value, 1.0)
            known |= {taken: image[taken].value for taken in feed.take(most)}
        known |= {taken: image[taken].value for taken in feed.take(100)}
        assert known == {index: image[index].value for index in range(4)}


def test_columns_are_readings_side_by_side(image: Image):
    image.set(1, 7, 1.0)
    image.set(0, 2.5, 2.0, Quality.LOST, "node lost")
    rows = [Reading(*row) for row in zip(*image.columns([0, 3, 1]), strict=True)]
    assert rows == [image[0], image[3], image[1]]


def test_qualities_are_numbered_as_modbus_serves_them():
    names = "waiting good stale lost dead device_fault disabled config_error"
    assert [quality.label for quality in sorted(Quality)] == names.split()
    assert list(Quality) == list(range(8))
    served = [quality.label for quality in Quality if quality.has_value]
    assert served == ["good", "stale", "lost", "device_fault"]


def test_a_point_knows_the_text_whose_words_it_shows(image: Image):
    feed = image.feed()
    seen(feed)
    image.say(2, Text.of("node.lost"), 1.0)
    assert image[2] == Reading("node lost", Quality.GOOD, 1.0, "")
    assert image.said(2) == Text.of("node.lost")
    assert seen(feed) == [2]
    image.set(2, "E003/3.0 overcurrent", 2.0)
    assert image.said(2) is None
    image.say(2, "waiting", 3.0)
    assert (image[2].value, image.said(2), image.said(1)) == ("waiting", None, None)


def test_the_reason_for_a_quality_is_a_text_that_reads_in_english(image: Image):
    image.set(1, 7, 1.0, Quality.LOST, Text.of("node.lost"))
    assert (image[1].why, image[1].reason) == (Text.of("node.lost"), "node lost")
    image.judge((1,), Quality.LOST, 2.0, Text.of("node.lost"))
    assert image[1].time == 1.0, "the same reason is no change"


def test_a_later_time_of_the_same_value_is_kept_and_no_feed_hears_of_it() -> None:
    image = Image((Point(name="a/b", data_type=DataType.UINT16),))
    image.set(0, 7, 1.0)
    feed = image.feed()
    feed.take(10)
    for now, time in ((3.0, 3.0), (2.0, 3.0)):
        image.date(0, now)
        assert (image[0].value, image[0].time) == (7, time)
    assert not feed
