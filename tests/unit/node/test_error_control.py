"""Heartbeat and node guarding (CiA 301 §7.2.8.3), EMCY and the bursts that keep a drive going."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.can.burstend import Burst
from bridge.can.softbursts import SoftBursts
from bridge.canopen import emcy, nmt
from bridge.canopen.emcy import Emergency
from bridge.canopen.frame import REMOTE, Frame
from bridge.canopen.heartbeat import HeartbeatConsumer, NodeGuard

BEAT = Frame(0x705, b"\x05")


def test_supervision_begins_with_the_first_heartbeat() -> None:
    consumer = HeartbeatConsumer(0.2)
    assert not consumer.on_time(100.0)
    consumer.on_frame(BEAT._replace(time=100.0))
    assert consumer.next_deadline() == 100.2
    assert not consumer.on_time(100.19)
    assert consumer.on_time(100.2)
    assert not consumer.on_time(100.3), "told once"


def test_a_heartbeat_is_judged_by_its_own_time_not_by_ours() -> None:
    consumer = HeartbeatConsumer(0.2)
    consumer.on_frame(BEAT._replace(time=100.0))
    consumer.on_frame(BEAT._replace(time=100.15))  # drained late, at 100.3
    assert not consumer.on_time(100.3)


def guard_answer(toggle: int, time: float) -> Frame:
    return Frame(0x705, bytes((0x05 | toggle << 7,)), time)


def test_guarding_asks_by_remote_frame_and_wants_the_toggle_bit() -> None:
    guard = NodeGuard(5, 0.1, 3)
    guard.expect(10.0)
    toggle = 1
    for step in range(10):
        now = 10.0 + 0.1 * step
        assert not guard.on_time(now + 1e-6)
        assert guard.take_frames() == [Frame(0x705 | REMOTE, b"\0")]
        guard.on_frame(guard_answer(toggle, now))
        toggle ^= 1
    assert guard.toggle_errors == 0


def test_a_node_that_repeats_its_toggle_bit_is_lost_after_the_life_time() -> None:
    guard = NodeGuard(5, 0.1, 3)
    guard.expect(10.0)
    lost_at = None
    for step in range(20):
        now = 10.0 + 0.1 * step
        if guard.on_time(now + 1e-6):
            lost_at = now
            break
        guard.on_frame(Frame(0x705, b"\x00", now))
    assert lost_at == pytest.approx(10.3)
    assert guard.toggle_errors > 0


def test_a_silent_node_is_lost_after_the_life_time() -> None:
    guard = NodeGuard(5, 0.1, 3)
    guard.expect(10.0)
    assert not guard.on_time(10.29)
    assert guard.on_time(10.3)
    assert guard.next_deadline() is None


def test_a_late_loop_asks_once() -> None:
    guard = NodeGuard(5, 0.1, 10)
    guard.expect(10.0)
    asked = 0
    for now in (10.0, 10.45, 10.4501, 10.5):
        guard.on_time(now)
        asked += len(guard.take_frames())
    assert asked == 2


def test_the_rhythm_of_guarding_is_kept_though_a_turn_is_late() -> None:
    guard = NodeGuard(5, 0.25, 10)
    guard.expect(10.0)
    deadlines = []
    for now in (10.125, 10.25, 10.625, 10.75):
        assert not guard.on_time(now)
        assert len(guard.take_frames()) == 1
        deadlines.append(guard.next_deadline())
    assert deadlines == [10.25, 10.5, 10.75, 11.0]


@pytest.mark.parametrize("late_s", [0.25, 0.375])
def test_after_a_missed_turn_a_whole_guard_time_passes(late_s: float) -> None:
    guard = NodeGuard(5, 0.25, 10)
    guard.expect(10.0)
    assert not guard.on_time(10.0 + late_s)
    assert guard.next_deadline() == 10.25 + late_s


def test_a_late_turn_does_not_put_off_the_loss() -> None:
    guard = NodeGuard(5, 0.25, 2)
    guard.expect(10.0)
    assert not guard.on_time(10.375)
    assert guard.next_deadline() == 10.5
    assert guard.on_time(10.5)


def test_a_wrong_toggle_bit_counts_once_and_the_next_right_one_is_a_sign_of_life() -> None:
    guard = NodeGuard(5, 0.1, 3)
    guard.expect(10.0)
    assert [guard.on_frame(guard_answer(toggle, 10.0)) for toggle in (1, 1, 0, 0, 1)] == [
        True,
        False,
        True,
        False,
        True,
    ]
    assert guard.toggle_errors == 2


def test_any_state_may_come_with_either_toggle_bit() -> None:
    guard = NodeGuard(5, 0.1, 3)
    guard.expect(10.0)
    answers = ("05", "FF", "04", "85", "7F")
    assert all(guard.on_frame(Frame(0x705, bytes.fromhex(data), 10.0)) for data in answers)
    assert guard.toggle_errors == 0


@pytest.mark.parametrize("data", ["", "0500"])
def test_an_answer_of_another_length_is_no_sign_of_life(data: str) -> None:
    guard = NodeGuard(5, 0.1, 3)
    guard.expect(10.0)
    assert not guard.on_frame(Frame(0x705, bytes.fromhex(data), 10.2))
    assert guard.on_time(10.3)


def test_until_guarding_begins_nothing_is_asked_nor_judged() -> None:
    """Somebody else may guard the node."""
    guard = NodeGuard(5, 0.1, 3)
    assert all(guard.on_frame(guard_answer(1, 10.0)) for _ in range(3))
    assert guard.toggle_errors == 0
    assert guard.next_deadline() is None
    assert not guard.on_time(100.0)
    assert guard.take_frames() == []


def test_an_emergency_message_of_the_manual() -> None:
    """BU 2500 §8.3: code, register, drive id in byte 3."""
    emergency = emcy.decode(bytes.fromhex("0081 11 02 00000000".replace(" ", "")))
    assert emergency is not None
    assert (emergency.code, emergency.register, emergency.vendor[0]) == (0x8100, 0x11, 2)


def test_a_short_emergency_message_has_its_code_and_register_at_least() -> None:
    assert emcy.decode(b"\x00\x81") is None
    assert emcy.decode(b"\x00\x81\x11") == Emergency(0x8100, 0x11, b"")


def test_nmt_commands() -> None:
    assert nmt.command(nmt.NmtCommand.START, 5) == Frame(0, b"\x01\x05")
    assert nmt.state_of(0x85) is nmt.NmtState.OPERATIONAL
    assert nmt.state_of(0x33) is nmt.NmtState.UNKNOWN


RPDO = Frame(0x205, bytes(8))


def test_a_burst_nobody_renews_ends_by_itself() -> None:
    beats = SoftBursts()
    assert beats.start(Burst((RPDO,), 0.01, 10), 0.0, at_once=False) == RPDO, (
        "the first frame goes out at once"
    )
    times = []
    now = 0.0
    while (due := beats.next_deadline()) is not None and now < 10:
        now = due
        times += [now] * len(beats.due(now))
    assert len(times) == 9
    assert max(times) <= 0.1


def test_a_renewed_burst_keeps_its_phase_and_takes_the_new_data() -> None:
    beats = SoftBursts()
    beats.start(Burst((RPDO,), 0.01, 10), 0.0, at_once=False)
    assert not beats.start(Burst((RPDO._replace(data=b"x"),), 0.01, 10), 0.0149, at_once=False)
    assert beats.next_deadline() == 0.01
    assert beats.due(0.015) == [RPDO._replace(data=b"x")]
    assert beats.next_deadline() == 0.02


@given(st.lists(st.floats(0.0, 0.5), min_size=1, max_size=50), st.integers(1, 20))
def test_a_late_timer_sends_no_bunch_and_no_more_than_was_asked(pauses: list[float], count: int) -> None:
    beats = SoftBursts()
    now, sent = 0.0, int(beats.start(Burst((RPDO,), 0.01, count), 0.0, at_once=False) is not None)
    for pause in pauses:
        now += pause
        frames = beats.due(now)
        assert len(frames) <= 1
        sent += len(frames)
    assert sent <= count
