"""Lanes: calls one after the other on a thread of their own, which one bad job does not end."""

from __future__ import annotations

import threading
from typing import cast

import zenoh

from bridge.zenohlink import lane as module
from bridge.zenohlink.lane import Lane

SESSION = cast("zenoh.Session", object())
LONG_S = 10.0


class Case:
    def __init__(self) -> None:
        self.complaints: list[Exception] = []
        self.done: list[int] = []
        self.lane = Lane("test", SESSION, self.complaints.append)
        self.gate = threading.Event()

    def holds_up(self) -> None:
        """The lane is busy until the gate opens."""
        begun = threading.Event()

        def wait(session: zenoh.Session) -> None:
            begun.set()
            self.gate.wait(LONG_S)

        assert self.lane.do(wait)
        assert begun.wait(LONG_S)

    def does(self, number: int) -> bool:
        return self.lane.do(lambda session: self.done.append(number))


def test_jobs_are_done_in_order_with_the_session_and_all_of_them_before_the_end() -> None:
    case, sessions = Case(), list[object]()
    case.lane.do(sessions.append)
    for number in range(5):
        assert case.does(number)
    case.lane.end()
    case.lane.join(LONG_S)
    assert not case.lane.is_alive
    assert (case.done, sessions) == ([0, 1, 2, 3, 4], [SESSION])


def test_a_bad_job_is_complained_of_and_the_next_is_done() -> None:
    case = Case()

    def fail(session: zenoh.Session) -> None:
        raise ValueError("bad")

    case.lane.do(fail)
    case.does(1)
    case.lane.end()
    case.lane.join(LONG_S)
    assert [str(one) for one in case.complaints] == ["bad"]
    assert case.done == [1]


def test_who_is_stopped_leaves_out_what_waits_and_takes_no_more() -> None:
    case = Case()
    case.holds_up()
    case.does(1)
    case.lane.stop()
    assert not case.does(2)
    case.gate.set()
    case.lane.join(LONG_S)
    assert case.done == []


def test_there_is_an_end_to_what_may_wait() -> None:
    case, limit = Case(), module.LIMIT
    case.holds_up()
    taken = sum(case.does(number) for number in range(limit + 5))
    assert taken == limit
    case.lane.stop()
    case.gate.set()
    case.lane.join(LONG_S)
