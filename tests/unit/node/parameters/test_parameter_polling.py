"""Which parameter point is read next: one at a time, within a budget, and what has failed later."""

from __future__ import annotations

from itertools import pairwise

import pytest

from bridge.node.parameters.parameter_polling import Came, ParameterPolling, PointRead
from tests.support.nodes import node_of


class Case:
    def __init__(self, nodes: int = 1) -> None:
        self.node = node_of()
        self.asked: list[str] = []
        self.reads: list[PointRead] = []
        self.polling = ParameterPolling(self.node, nodes)
        self.names = [entry.name for entry in self.node.drives[0].spec.names.points()]

    def on_time(self, now: float) -> None:
        read = self.polling.take_due(now)
        if read is not None:
            self.asked.append(read.entry.name)
            self.reads.append(read)

    def runs(self, begin: float, end: float, came: Came = Came.READ) -> list[float]:
        """Every question until then is answered at once; when they were asked."""
        times: list[float] = []
        while (due := self.polling.next_deadline()) is not None and due < end:
            before = len(self.asked)
            self.on_time(max(due, begin))
            if len(self.asked) > before:
                times.append(max(due, begin))
                self.polling.on_result(self.reads[-1], came)
        return times


@pytest.fixture
def case() -> Case:
    case = Case()
    case.polling.start(case.node.drives, 10.0)
    return case


def test_every_point_is_read_once_after_the_boot_up(case: Case) -> None:
    assert case.names
    case.runs(10.0, 10.0 + len(case.names) * case.polling.pause_s)
    assert set(case.asked) == set(case.names)


def test_one_is_asked_at_a_time(case: Case) -> None:
    case.on_time(10.0)
    assert case.polling.next_deadline() is None
    case.on_time(99.0)
    assert len(case.asked) == 1


def test_there_is_a_pause_between_two(case: Case) -> None:
    times = case.runs(10.0, 12.0)
    assert all(after - before >= case.polling.pause_s - 1e-9 for before, after in pairwise(times))
    assert case.polling.pause_s >= 1 / 20


def test_all_nodes_share_a_twentieth_of_the_bus() -> None:
    """270 bits for a question and its answer."""
    bitrate = Case().node.bus.bitrate
    assert 1 / Case(1).polling.pause_s == 20.0, "no node is asked more often"
    assert 100 / Case(100).polling.pause_s * 270 == pytest.approx(0.05 * bitrate)


def test_what_the_drive_does_not_have_is_not_asked_again_and_what_failed_is_later(case: Case) -> None:
    case.runs(10.0, 10.001, Came.NEVER)
    first = case.asked[0]
    case.runs(10.001, 30.0)
    assert case.asked.count(first) == 1
    failing = Case()
    failing.polling.start(failing.node.drives, 10.0)
    failing.runs(10.0, 10.001, Came.FAILED)
    times = failing.runs(10.001, 16.0)
    again = [time for time, name in zip(times, failing.asked[1:], strict=True) if name == failing.asked[0]]
    assert again
    assert again[0] >= 15.0


def test_an_answer_for_a_node_that_was_lost_meanwhile_counts_for_nothing(case: Case) -> None:
    case.on_time(10.0)
    case.polling.stop()
    case.polling.on_result(case.reads[0], Came.READ)
    assert case.polling.next_deadline() is None
    case.polling.start(case.node.drives, 20.0)
    assert case.polling.next_deadline() == 20.0
