"""Error control (CiA 301 §7.2.8.3): a heartbeat consumer and node guarding, by the frames' own times."""

from __future__ import annotations

import pytest

from bridge.canopen.frame import REMOTE, Frame
from bridge.canopen.heartbeat import HeartbeatConsumer, NodeGuard

REQUEST = Frame(0x705 | REMOTE, b"\0")


def says(octet: int, time: float) -> Frame:
    return Frame(0x705, bytes((octet,)), time)


# heartbeat


def test_supervision_begins_with_the_first_heartbeat() -> None:
    consumer = HeartbeatConsumer(0.3)
    assert consumer.next_deadline() is None
    assert not consumer.on_time(1000.0)
    assert consumer.on_frame(says(5, 10.0))
    assert consumer.next_deadline() == 10.3


def test_a_silent_node_is_told_once_and_at_the_deadline() -> None:
    consumer = HeartbeatConsumer(0.5)
    consumer.on_frame(says(5, 10.0))
    assert not consumer.on_time(10.499)
    assert consumer.on_time(10.5)
    assert not consumer.on_time(20.0)
    assert consumer.next_deadline() is None


def test_who_is_expected_is_supervised_before_it_is_heard() -> None:
    consumer = HeartbeatConsumer(0.5)
    consumer.expect(10.0)
    assert consumer.on_time(10.5)


def test_the_time_of_the_frame_counts_and_a_reset_ends_it() -> None:
    consumer = HeartbeatConsumer(0.5)
    consumer.expect(10.0)
    consumer.on_frame(says(5, 10.4))
    assert not consumer.on_time(10.8)
    consumer.reset()
    assert consumer.next_deadline() is None
    assert not consumer.on_time(99.0)
    assert consumer.take_frames() == []


# node guarding


def guard() -> NodeGuard:
    guard = NodeGuard(5, 0.5, 3)
    guard.expect(10.0)
    return guard


def test_the_node_is_asked_at_once_and_in_its_guard_time() -> None:
    one = guard()
    asked: list[float] = []
    for step in range(14):
        now = 10.0 + step / 10
        assert not one.on_time(now)
        frames = one.take_frames()
        assert frames in ([], [REQUEST])
        asked += [now] if frames else []
    assert asked == pytest.approx([10.0, 10.5, 11.0])


def test_who_asks_a_little_late_keeps_the_rhythm() -> None:
    """The node's own life guarding counts on it (CiA 301 §7.2.8.3.2.1)."""
    one = guard()
    for late in (0.125, 0.25, 0.0):
        due = one.next_deadline()
        assert due is not None
        one.on_frame(says(5, due))
        one.on_time(due + late)
        assert one.next_deadline() == due + 0.5
    assert one.take_frames() == [REQUEST] * 3


def test_who_is_late_asks_once() -> None:
    one = guard()
    one.on_frame(says(5, 12.0))
    assert not one.on_time(13.2)
    assert one.take_frames() == [REQUEST]
    assert one.next_deadline() == 13.5, "12.0 s + three guard times"


def test_a_node_that_does_not_answer_is_lost_after_its_life_time_and_once() -> None:
    one = guard()
    assert one.life_time_s == 1.5
    assert not one.on_time(11.499)
    assert one.on_time(11.5)
    assert not one.on_time(99.0)
    assert one.next_deadline() is None


def test_the_toggle_bit_may_begin_with_either_and_alternates() -> None:
    for first in (0x00, 0x80):
        one = guard()
        assert one.on_frame(says(5 | first, 10.1))
        assert one.on_frame(says(5 | (first ^ 0x80), 10.6))
        assert one.on_frame(says(5 | first, 11.1))
        assert one.toggle_errors == 0


def test_the_state_is_no_part_of_the_toggle_bit() -> None:
    one = guard()
    for number, state in enumerate((5, 4, 127, 4, 5)):
        assert one.on_frame(says(state | 0x80 * (number % 2), 10.1 + number / 10))
    assert one.toggle_errors == 0


def test_a_repeated_toggle_bit_proves_nothing_and_the_next_correct_one_does() -> None:
    one = guard()
    one.on_frame(says(0x05, 10.1))
    assert not one.on_frame(says(0x05, 11.0))
    assert one.toggle_errors == 1
    assert one.on_time(11.6), "the answer of 10.1 s was the last that counts"
    again = guard()
    again.on_frame(says(0x05, 10.1))
    again.on_frame(says(0x05, 11.0))
    assert again.on_frame(says(0x85, 11.1))
    assert not again.on_time(11.7)


def test_an_answer_of_another_length_proves_nothing() -> None:
    one = guard()
    assert not one.on_frame(Frame(0x705, b"\x05\x00", 11.0))
    assert one.on_time(11.5)


def test_what_somebody_else_asked_for_counts_as_heard() -> None:
    one = NodeGuard(5, 0.5, 3)
    assert one.on_frame(says(0x05, 10.0))
    assert one.next_deadline() is None
    assert not one.on_time(19.0), "nobody guards it"
    one.expect(20.0)
    one.reset()
    assert not one.on_time(99.0)
    assert one.take_frames() == []
