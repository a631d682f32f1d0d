"""Traffic of a bus as tabs are shown it."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.base.errors import OperationFailed
from bridge.northbound.page.traffic import MOST_ROWS, ShownFrame, TrafficFilter, TrafficViews
from bridge.text import Text, Words

BUS = "can0"


def frame(at_ms: float, identifier: str = "185", kind: str = "pdo", node: int = 5) -> ShownFrame:
    return ShownFrame(at_ms, identifier, "31 04", kind, node, "TPDO1 conveyor/fu1", "says something", 100)


class BusTap:
    def __init__(self) -> None:
        self.waiting: list[ShownFrame] = []
        self.openings = self.lost = self.tries = 0
        self.is_open = False
        self.failure: Words = ""

    def open(self) -> None:
        self.tries += 1
        if self.failure:
            raise OperationFailed(self.failure)
        self.is_open, self.openings = True, self.openings + 1

    def take(self) -> list[ShownFrame]:
        if self.failure:
            raise OperationFailed(self.failure)
        taken, self.waiting = self.waiting, []
        return taken

    def close(self) -> None:
        self.is_open = False


class Bench:
    def __init__(self) -> None:
        self.tap = BusTap()
        self.views = TrafficViews([(BUS, 250_000, self.tap)])
        self.now = 0.0

    def beat(
        self, *filters: TrafficFilter, after_s: float = 0.1, counts: bool = False
    ) -> list[list[dict[str, Any]]]:
        """Messages to each of ``filters`` in this beat."""
        self.now += after_s
        shown: list[list[dict[str, Any]]] = [[] for _ in filters]
        pairs = [
            (filter_, lambda data, out=out: out.append(json.loads(data)))
            for filter_, out in zip(filters, shown, strict=True)
        ]
        self.views.beat(pairs, self.now, counts=counts)
        return shown


def test_a_bus_is_listened_to_while_somebody_wants_to() -> None:
    bench = Bench()
    assert bench.beat() == []
    assert not bench.tap.openings
    bench.beat(TrafficFilter(BUS))
    bench.beat(TrafficFilter(BUS), TrafficFilter(BUS))
    assert bench.tap.is_open
    assert bench.tap.openings == 1
    bench.beat()
    assert not bench.tap.is_open
    bench.beat(TrafficFilter(BUS))
    bench.views.close()
    assert not bench.tap.is_open


@given(
    kinds=st.lists(st.sampled_from(["pdo", "sdo", "nmt"]), unique=True),
    nodes=st.lists(st.integers(0, 3), unique=True),
    frames=st.lists(st.tuples(st.sampled_from(["pdo", "sdo", "nmt"]), st.integers(0, 3)), max_size=30),
)
def test_a_tab_gets_what_it_asks_for_in_order(
    kinds: list[str], nodes: list[int], frames: list[tuple[str, int]]
) -> None:
    bench = Bench()
    filter_ = TrafficFilter(BUS, "frames", frozenset(kinds), frozenset(nodes))
    bench.beat(filter_)
    bench.tap.waiting = [frame(float(n), kind=kind, node=node) for n, (kind, node) in enumerate(frames)]
    (shown,) = bench.beat(filter_)
    wanted = [
        float(n)
        for n, (kind, node) in enumerate(frames)
        if (not kinds or kind in kinds) and (not nodes or node in nodes)
    ]
    assert [row[0] for message in shown for row in message["frames"]] == wanted
    assert bool(shown) == bool(wanted)


def test_of_a_busy_bus_a_tab_gets_the_first_and_how_many_more_there_were() -> None:
    bench = Bench()
    bench.beat(TrafficFilter(BUS))
    bench.tap.waiting = [frame(float(n)) for n in range(MOST_ROWS + 7)]
    bench.tap.lost = 3
    ((message,),) = bench.beat(TrafficFilter(BUS))
    assert (len(message["frames"]), message["more"], message["lost"]) == (MOST_ROWS, 7, 3)


def test_identifiers_are_counted_with_rates_loads_and_gaps() -> None:
    bench = Bench()
    filter_ = TrafficFilter(BUS, "identifiers")
    bench.beat(filter_)
    for second in range(20):
        bench.tap.waiting = [frame(1000.0 * second + ms) for ms in (0, 100, 300, 600)]
        bench.tap.waiting.append(frame(1000.0 * second, "080", "sync", 0))
        ((message,),) = bench.beat(filter_, after_s=1.0, counts=True)
    sync, pdo = message["identifiers"]
    identifier, _, count, rate_hz, load, shortest_ms, longest_ms, data, text = pdo
    assert (identifier, count, data, text) == ("185", 80, "31 04", "says something")
    assert rate_hz == pytest.approx(4.0, abs=0.1)
    assert load == pytest.approx(100 * 400 / 250_000, abs=0.01)
    assert (shortest_ms, longest_ms) == (100.0, 400.0)
    assert (sync[0], sync[2]) == ("080", 20)


def test_identifiers_are_told_once_a_second_and_filtered() -> None:
    bench = Bench()
    filter_ = TrafficFilter(BUS, "identifiers", frozenset({"sync"}))
    bench.beat(filter_)
    bench.tap.waiting = [frame(0.0), frame(1.0, "080", "sync", 0)]
    assert bench.beat(filter_) == [[]]
    ((message,),) = bench.beat(filter_, counts=True)
    assert [row[0] for row in message["identifiers"]] == ["080"]


def test_a_bus_that_cannot_be_heard_says_why_and_is_tried_again() -> None:
    bench = Bench()
    bench.tap.failure = "can0 cannot be listened to: no such device"
    ((message,),) = bench.beat(TrafficFilter(BUS))
    assert message["failure"] == bench.tap.failure
    ((message,),) = bench.beat(TrafficFilter(BUS, "identifiers"), counts=True)
    assert message["failure"] == bench.tap.failure
    bench.tap.failure = ""
    bench.beat(TrafficFilter(BUS), after_s=1.0)
    bench.tap.waiting = [frame(0.0)]
    assert "frames" in bench.beat(TrafficFilter(BUS))[0][0]
    bench.tap.failure = "the process that has the bus has ended"
    assert bench.beat(TrafficFilter(BUS))[0][0]["failure"] == bench.tap.failure
    assert not bench.tap.is_open


def test_the_reason_comes_with_its_code() -> None:
    bench = Bench()
    bench.tap.failure = Text.of("page.bus_deaf", bus="can0", why="no such device")
    ((message,),) = bench.beat(TrafficFilter(BUS))
    assert message["failure"] == "can0 cannot be listened to: no such device"
    assert message["text"]["code"] == "page.bus_deaf"


def test_a_bus_that_cannot_be_heard_is_tried_once_a_second() -> None:
    bench = Bench()
    bench.tap.failure = "can0 cannot be listened to: no such device"
    for beat in range(50):
        filters = [TrafficFilter(BUS)] if beat % 2 else [TrafficFilter(BUS), TrafficFilter(BUS)]
        assert all(shown[0]["failure"] for shown in bench.beat(*filters))
        bench.beat(after_s=0.0)  # nobody wants to hear, and then somebody again
    assert bench.tap.tries == 5


def test_a_flood_of_identifiers_takes_no_more_memory_than_a_bus_has() -> None:
    bench = Bench()
    filter_ = TrafficFilter(BUS, "identifiers")
    bench.beat(filter_)
    bench.tap.waiting = [frame(0.0, f"{n:08X}") for n in range(5000)]
    ((message,),) = bench.beat(filter_, counts=True)
    assert len(message["identifiers"]) == 2048
