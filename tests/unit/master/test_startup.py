"""Start order and mandatory nodes (CiA 302-2): which nodes of a bus may be started when."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import cast

import pytest

from bridge.config import NodeTable
from bridge.config.field_types import MandatoryMissing
from bridge.master.startup import StartGate
from bridge.node.neighbours import Neighbour
from tests.support import sites


def table(name: str, **more: object) -> NodeTable:
    keys: dict[str, object] = {
        "name": name,
        "id": 5,
        "mapping": sites.FAMILY,
        "drive": [{"slot": "fu1"}],
        **more,
    }
    return NodeTable.model_validate(keys)


@dataclass
class Node:
    table: NodeTable
    is_ready: bool = False
    is_operational: bool = False
    is_on_its_way: bool = True
    is_out_of_service: bool = False


@dataclass
class Bus:
    policy: MandatoryMissing
    nodes: list[Node] = field(default_factory=list[Node])

    def __post_init__(self) -> None:
        self.gate = StartGate(self.policy, cast("list[Neighbour]", self.nodes))

    def may(self) -> list[str]:
        self.gate.judge()
        return [node.table.name for node in self.nodes if self.gate.may_start(cast("Neighbour", node))]


def test_a_node_waits_for_those_of_a_lower_start_order_that_are_coming() -> None:
    first, second = Node(table("first", start_order=1)), Node(table("second", start_order=2))
    bus = Bus("go_on", [second, first])
    assert bus.may() == ["first"]
    first.is_operational = first.is_ready = True
    first.is_on_its_way = False
    assert "second" in bus.may()


def test_nobody_waits_for_one_that_is_not_coming() -> None:
    gone, second = (
        Node(table("gone", start_order=1), is_on_its_way=False),
        Node(table("second", start_order=2)),
    )
    assert "second" in Bus("go_on", [gone, second]).may()


@pytest.mark.parametrize("policy", ["wait", "stop_all"])
def test_where_a_mandatory_node_is_missing_nobody_starts(policy: MandatoryMissing) -> None:
    must, other = Node(table("must", mandatory=True)), Node(table("other"), is_ready=True)
    bus = Bus(policy, [must, other])
    assert bus.may() == []
    assert bus.gate.missing == ["must"]
    assert not bus.gate.is_open
    must.is_ready = True
    assert bus.may() == ["must", "other"]
    assert bus.gate.is_open


def test_where_the_site_goes_on_without_them_nobody_waits() -> None:
    bus = Bus("go_on", [Node(table("must", mandatory=True)), Node(table("other"))])
    assert bus.may() == ["must", "other"]


@pytest.mark.parametrize("out", ["out of service", "not enabled"])
def test_a_node_that_somebody_has_switched_off_is_not_missed(out: str) -> None:
    must = Node(table("must", mandatory=True, enabled=out != "not enabled"), is_on_its_way=False)
    must.is_out_of_service = out == "out of service"
    assert "other" in Bus("wait", [must, Node(table("other"))]).may()


def test_a_node_for_which_all_were_stopped_is_waited_for_until_it_is_ready() -> None:
    lost, other = Node(table("lost")), Node(table("other"), is_ready=True)
    bus = Bus("go_on", [lost, other])
    for _ in range(2):
        bus.gate.stopped_by(cast("Neighbour", lost))
    assert bus.may() == []
    assert bus.gate.missing == ["lost"]
    lost.is_ready = True
    assert bus.may() == ["lost", "other"]
    lost.is_ready = False
    assert bus.may() == ["lost", "other"], "it is not waited for a second time"
