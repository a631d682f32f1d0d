"""How many answers to an intruder a bus takes: within a share of it, and nobody is forgotten."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from bridge.can.wirebits import longest_bits
from bridge.master.answers import SHARE, Answers, answer_bits
from bridge.node.node_core import NodeCore

BITRATE = 100_000
BITS_PER_S = SHARE * BITRATE
AT_ONCE = 0.05 * BITS_PER_S
ANSWER = answer_bits(4)


def node(node_id: int) -> NodeCore:
    return cast(NodeCore, SimpleNamespace(table=SimpleNamespace(id=node_id)))


NODES = [node(one) for one in range(1, 20)]


def asked(*nodes: NodeCore, identifiers: int = 4) -> Answers:
    answers = Answers(BITRATE)
    for one in nodes:
        answers.ask(one, identifiers)
    return answers


def test_an_answer_is_a_word_on_each_identifier_and_an_nmt_command() -> None:
    assert answer_bits(3) == 3 * longest_bits(8) + longest_bits(2)


def test_who_is_asked_is_told_once() -> None:
    answers = asked(NODES[0], NODES[0])
    assert answers.are_asked
    assert answers.take(10.0) == [NODES[0]]
    assert not answers.are_asked
    assert answers.take(11.0) == []


def test_at_first_there_is_room_for_50_ms_and_one_more_answer() -> None:
    taken = asked(*NODES).take(10.0)
    assert taken == NODES[: int(AT_ONCE // ANSWER) + 1]
    assert 1 < len(taken) < len(NODES)


def test_the_others_wait_until_the_share_has_made_up_for_it() -> None:
    answers = asked(*NODES)
    count = len(answers.take(10.0))
    owed_s = (count * ANSWER - AT_ONCE) / BITS_PER_S
    assert answers.next_deadline() == pytest.approx(10.0 + owed_s + 0.001)
    assert answers.take(10.0 + owed_s - 0.001) == []
    assert answers.take(10.0 + owed_s + 0.001) == NODES[count : count + 1]


def test_over_a_long_time_no_more_than_the_share_is_used() -> None:
    answers = Answers(BITRATE)
    told = 0
    for tick in range(10_000):
        answers.ask(NODES[0], 4)
        told += len(answers.take(10.0 + tick / 1000))
    assert 0.95 * 10 * BITS_PER_S <= told * ANSWER <= 10 * BITS_PER_S + AT_ONCE + ANSWER


def test_an_answer_that_is_longer_than_all_room_goes_out() -> None:
    answers = asked(NODES[0], identifiers=60)
    assert answer_bits(60) > AT_ONCE
    assert answers.take(10.0) == [NODES[0]]


def test_what_was_not_used_adds_up_for_50_ms() -> None:
    answers = asked(*NODES)
    count = len(answers.take(10.0))
    answers.take(10.5)
    answers.clear()
    for one in NODES:
        answers.ask(one, 4)
    assert len(answers.take(60.0)) == count


def test_a_frame_that_was_received_before_the_last_round_takes_no_room() -> None:
    answers = asked(NODES[0])
    answers.take(10.0)
    answers.ask(NODES[1], 4)
    assert answers.take(9.9) == [NODES[1]]


def test_who_is_forgotten_needs_no_round() -> None:
    answers = asked(*NODES)
    assert answers.next_deadline() is not None
    answers.clear()
    assert not answers.are_asked
    assert answers.next_deadline() is None
    assert answers.take(10.0) == []


def test_a_round_is_not_before_the_last_one() -> None:
    answers = asked(NODES[0])
    answers.take(10.0)
    answers.ask(NODES[1], 4)
    assert answers.next_deadline() == pytest.approx(10.001)
