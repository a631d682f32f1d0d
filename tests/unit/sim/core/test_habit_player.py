"""Frames of a simulated node with habits, sent and heard."""

from __future__ import annotations

import pytest

from bridge.canopen.frame import Frame
from bridge.sim.core.habit import Rule
from bridge.sim.core.habit_player import HabitPlayer
from bridge.sim.nord.nord_tu4 import NordTu4

READ_1000 = Frame(0x605, bytes.fromhex("4000100000000000"))


def node(*rules: Rule) -> NordTu4:
    simulated = NordTu4(5)
    simulated.adopt_habits(rules)
    simulated.start(0.0)
    simulated.take_frames()
    return simulated


def answers(simulated: NordTu4, request: str, now: float = 1.0) -> list[str]:
    simulated.on_frame(Frame(0x605, bytes.fromhex(request)), now)
    return [frame.data.hex(" ").upper() for frame in simulated.take_frames() if frame.can_id == 0x585]


def test_bytes_of_an_answer_are_replaced_and_the_others_stay() -> None:
    simulated = node(Rule(frames="answer", like="43 00 10", data="42 .. .. .. .. A5"))
    (answer,) = answers(simulated, "40 00 10 00 00 00 00 00")
    assert answer.startswith("42 00 10 00 ") and answer[15:17] == "A5"


def test_an_answer_is_cut_or_padded() -> None:
    assert len(answers(node(Rule(frames="answer", size=6)), "4000100000000000")[0].split()) == 6
    heartbeat = HabitPlayer(5, [Rule(frames="error_control", size=8)])
    heartbeat.put([Frame(0x705, b"\x05")], 0.0)
    assert heartbeat.due(0.0) == [Frame(0x705, b"\x05" + bytes(7))]


def test_a_late_answer_is_due_when_it_is_due() -> None:
    simulated = node(Rule(frames="answer", delay_ms=700))
    assert answers(simulated, "4000100000000000", 1.0) == []
    due = simulated.next_deadline()
    assert due == pytest.approx(1.7)
    simulated.on_time(1.7)
    assert len(simulated.take_frames()) == 1


def test_an_aborted_request_does_not_reach_the_server_and_names_its_object() -> None:
    simulated = node(Rule(frames="request", like="40 00 10", abort=0x08000000))
    assert answers(simulated, "4000100000000000") == ["80 00 10 00 00 00 00 08"]


def test_a_request_that_gets_lost_is_not_answered() -> None:
    assert answers(node(Rule(frames="request", silent=True)), "4000100000000000") == []


def test_the_first_frames_may_remain_as_they_are() -> None:
    simulated = node(Rule(frames="answer", silent=True, skip=1))
    assert len(answers(simulated, "4000100000000000")) == 1
    assert answers(simulated, "4000100000000000") == []


def test_frames_of_other_nodes_are_left_alone() -> None:
    player = HabitPlayer(5, [Rule(frames="request", silent=True)])
    other = Frame(0x606, READ_1000.data)
    assert player.on_frame(other, 0.0) == other
