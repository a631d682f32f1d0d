"""Pace of sending."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from math import inf
from typing import Any

from bridge.zenohlink import Pace
from tests.support.virtual_loop import VirtualLoop

PERIOD_S = 0.01


class Turns:
    """Times of the turns, in ms."""

    def __init__(self, most_s: float = inf, *, waits: bool = False) -> None:
        self.at: list[int] = []
        self.pace = Pace(self._turn, PERIOD_S, most_s, waits=waits)
        self.fails = False

    def _turn(self) -> None:
        self.at.append(round(asyncio.get_running_loop().time() * 1000))
        if self.fails:
            raise LookupError("ours")


def play(turns: Turns, *moves: Callable[[], object] | float, end_s: float = 0.1) -> list[int]:
    """``moves``: what is done, and the seconds that pass between."""

    async def go() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda *_: None)
        for move in moves:
            if callable(move):
                move()
            else:
                await asyncio.sleep(move)
        await asyncio.sleep(end_s)
        turns.pace.stop()

    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        runner.run(go())
    return turns.at


def test_the_first_change_is_sent_at_once_and_others_wait_their_time() -> None:
    turns = Turns()
    assert play(turns, turns.pace.start, 0.02, turns.pace.wake, 0.001, turns.pace.wake, turns.pace.wake) == [
        20,
        30,
    ]


def test_where_it_has_to_wait_it_does_so_from_the_first_change_on() -> None:
    turns = Turns(waits=True)
    moves = turns.pace.start, 0.02, turns.pace.wake, 0.001, turns.pace.wake, 0.02, turns.pace.wake
    assert play(turns, *moves) == [30, 51]


def test_what_came_before_the_start_counts() -> None:
    turns = Turns()
    assert play(turns, turns.pace.wake, 0.02, turns.pace.start) == [20]


def test_without_changes_it_rests() -> None:
    turns = Turns()
    assert play(turns, turns.pace.start) == []


def test_it_rests_for_no_longer_than_it_may() -> None:
    turns = Turns(most_s=0.03)
    assert play(turns, turns.pace.start, 0.004, turns.pace.wake, end_s=0.09) == [0, 10, 40, 70]


def test_nothing_is_sent_after_the_end() -> None:
    turns = Turns(most_s=0.03)
    moves = turns.pace.start, 0.001, turns.pace.wake, turns.pace.stop, 0.05, turns.pace.wake
    assert play(turns, *moves) == [0]


def test_a_turn_that_fails_is_not_the_last() -> None:
    turns = Turns(most_s=0.03)
    turns.fails = True
    assert play(turns, turns.pace.start, end_s=0.07) == [0, 30, 60]


def test_a_turn_may_ask_for_the_next() -> None:
    turns = Turns()
    turn: Any = turns._turn

    def again() -> None:
        turn()
        if len(turns.at) < 4:
            turns.pace.wake()

    turns.pace = Pace(again, PERIOD_S)
    assert play(turns, turns.pace.wake, turns.pace.start) == [0, 10, 20, 30]
