"""Deadlines of the nodes of a bus: who is due, who was touched, and what a deadline that moves costs."""

from __future__ import annotations

from typing import cast

from hypothesis import given
from hypothesis import strategies as st

from bridge.master.schedule import Schedule
from bridge.node.neighbours import Neighbour


class Node:
    def __init__(self, name: str, at: float | None = None) -> None:
        self.name = name
        self.at = at

    def next_deadline(self) -> float | None:
        return self.at


def schedule_of(*nodes: Node) -> Schedule[Neighbour]:
    """All of them are touched in the beginning."""
    return Schedule(cast("list[Neighbour]", list(nodes)))


def names(nodes: list[Neighbour]) -> list[str]:
    return [cast("Node", node).name for node in nodes]


def test_in_the_beginning_every_node_is_looked_at_at_once() -> None:
    schedule = schedule_of(Node("a"), Node("b"))
    assert schedule.is_touched
    assert schedule.next_deadline() == float("-inf")
    assert names(schedule.take_touched()) == ["a", "b"]
    assert not schedule.is_touched
    assert schedule.next_deadline() is None


def test_a_node_is_given_once_in_the_order_in_which_they_were_touched() -> None:
    first, second = Node("a"), Node("b")
    schedule = schedule_of(first, second)
    schedule.take_touched()
    for node in (second, first, second):
        schedule.touch(cast("Neighbour", node))
    assert names(schedule.take_touched()) == ["b", "a"]


def test_a_node_is_due_at_its_deadline_and_once() -> None:
    node = Node("a", 10.0)
    schedule = schedule_of(node)
    schedule.take_touched()
    schedule.plan(cast("Neighbour", node))
    assert schedule.next_deadline() == 10.0
    assert schedule.take_due(9.999) == []
    assert names(schedule.take_due(10.0)) == ["a"]
    assert schedule.take_due(99.0) == []


def test_a_deadline_that_was_put_off_is_noticed_when_the_old_one_comes() -> None:
    node = Node("a", 10.0)
    schedule = schedule_of(node)
    schedule.take_touched()
    schedule.plan(cast("Neighbour", node))
    node.at = 20.0
    schedule.plan(cast("Neighbour", node))
    assert len(schedule) == 1, "each heartbeat puts it off: that costs nothing"
    assert names(schedule.take_due(10.0)) == ["a"]
    schedule.plan(cast("Neighbour", node))
    assert schedule.next_deadline() == 20.0


def test_a_deadline_that_is_brought_forward_counts_and_the_old_one_is_stale() -> None:
    node = Node("a", 10.0)
    schedule = schedule_of(node)
    schedule.take_touched()
    schedule.plan(cast("Neighbour", node))
    node.at = 5.0
    schedule.plan(cast("Neighbour", node))
    assert names(schedule.take_due(5.0)) == ["a"]
    assert schedule.take_due(10.0) == []
    node.at = None
    schedule.plan(cast("Neighbour", node))
    assert schedule.next_deadline() is None


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 50)), max_size=30))
def test_nobody_is_forgotten(moves: list[tuple[int, int]]) -> None:
    nodes = [Node(str(number)) for number in range(4)]
    schedule = schedule_of(*nodes)
    schedule.take_touched()
    for number, at in moves:
        nodes[number].at = float(at)
        schedule.plan(cast("Neighbour", nodes[number]))
    seen: set[str] = set()
    for now in range(51):
        for node in schedule.take_due(float(now)):
            one = cast("Node", node)
            if one.at is not None and one.at <= now:
                assert one.name not in seen
                seen.add(one.name)
            else:
                schedule.plan(node)
    assert seen == {node.name for node in nodes if node.at is not None}
