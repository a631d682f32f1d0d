"""Figures that ``tests/bench/end_to_end.py`` makes of the records of its plant and clients."""

from __future__ import annotations

import json
import os
import time
from xml.etree import ElementTree

import pytest

from bridge.can import bcm
from bridge.canopen.frame import Frame
from tests.bench import end_to_end_report as report
from tests.bench.delays import Delays, delays, summary
from tests.bench.end_to_end_runs import Cell, Run, Spread, ratio, spread
from tests.bench.line_plot import Line, line_plot
from tests.bench.processes import usage
from tests.peers.broadcast_manager import BroadcastManager

CELL = Cell(1000, 100)


def run(bridge: str, round_number: int, us_per_pdo: float | None, rate: int = 1000) -> Run:
    late = Delays(seen=10, unseen=0, p50_ms=1.0, p99_ms=4.0, max_ms=9.0, caught_up_ms=1.0)
    return Run(
        bridge,
        Cell(rate, 100),
        round_number,
        cpu_percent=20.0 + round_number,
        us_per_pdo=us_per_pdo,
        memory_mb=100.0,
        processes=1,
        sent=1000,
        lost=500,
        is_late=False,
        delays={"modbus": late, "opcua": late, "zenoh": late},
    )


def test_a_change_is_seen_when_it_or_a_newer_one_is() -> None:
    late_s, unseen = delays([1.0, 2.0, 3.0, 4.0], [(1.5, 1), (3.5, 3)])
    assert late_s == [0.5, 1.5, 0.5]
    assert unseen == 1


def test_what_is_seen_again_counts_once() -> None:
    assert delays([1.0, 2.0], [(2.5, 2), (2.6, 1), (2.7, 2)]) == ([1.5, 0.5], 0)


def test_a_change_that_nobody_sent_is_a_fault_of_the_bench() -> None:
    with pytest.raises(ValueError, match="change 2 was seen and 1 were sent"):
        delays([1.0], [(1.5, 2)])


def test_nodes_that_are_not_watched_are_not_counted() -> None:
    found = summary([[1.0], [1.0, 2.0]], {2: [(1.25, 1), (2.5, 2)]})
    assert found == Delays(2, 0, p50_ms=500.0, p99_ms=500.0, max_ms=500.0, caught_up_ms=500.0)


def test_who_has_seen_nothing_has_no_delay() -> None:
    assert summary([[1.0]], {1: []}) == Delays(0, 1, None, None, None, None)


def test_who_has_not_seen_the_last_change_has_not_caught_up() -> None:
    found = summary([[1.0], [1.0, 2.0]], {1: [(1.5, 1)], 2: [(1.5, 1)]})
    assert (found.unseen, found.caught_up_ms) == (1, None)


def test_the_median_comes_with_least_and_most() -> None:
    runs = [run("ours", number, value) for number, value in enumerate((30.0, 10.0, 20.0))]
    assert spread(runs, "ours", CELL, lambda one: one.us_per_pdo) == Spread(20.0, 10.0, 30.0)


def test_a_round_without_a_figure_leaves_none() -> None:
    runs = [run("naive", 0, 10.0), run("naive", 1, None)]
    assert spread(runs, "naive", CELL, lambda one: one.us_per_pdo) is None


def test_a_ratio_is_formed_within_a_round() -> None:
    runs = [run("ours", 0, 10.0), run("naive", 0, 40.0), run("ours", 1, 100.0), run("naive", 1, 200.0)]
    assert ratio(runs, CELL, "naive", "ours", lambda one: one.us_per_pdo) == Spread(3.0, 2.0, 4.0)
    assert ratio([*runs, run("ours", 2, 1.0)], CELL, "naive", "ours", lambda one: one.us_per_pdo) is None


def test_the_table_has_a_row_for_each_rate_and_bridge() -> None:
    runs = [run(bridge, 0, 10.0, rate) for bridge in ("naive", "ours") for rate in (8000, 250)]
    lines = report.markdown(runs).splitlines()
    heads, _, *rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines if line[:1] == "|"]
    late = ["1.0 / 4.0 / 9.0"] * 3
    assert rows == [
        [rate, bridge, "20.0", "50.0", "10.0", beside, "100.0", *late]
        for rate in ("250", "8,000")
        for bridge, beside in (("ours", ""), ("naive", "1.00"))
    ]
    assert len(heads) == len(rows[0])


def test_a_spread_is_shown_where_rounds_differ() -> None:
    [row] = [
        line
        for line in report.markdown([run("ours", 0, 10.0), run("ours", 1, 30.0)]).splitlines()
        if "| ours" in line
    ]
    assert "| 20.5 (20.0–21.0) | 50.0 | 20.0 (10.0–30.0) |" in row


def test_all_runs_are_in_the_json() -> None:
    told = json.loads(report.to_json([run("ours", 0, 10.0)], {"cores": 2}))
    assert told["machine"] == {"cores": 2}
    assert told["runs"][0]["cell"] == {"rate": 1000, "changed": 100}
    assert told["runs"][0]["delays"]["opcua"]["p99_ms"] == 4.0


@pytest.mark.parametrize("log_y", [True, False])
def test_a_plot_has_a_mark_for_each_point_within_it(log_y: bool) -> None:
    lines = [Line("a < b", [(250, 3.6), (8000, 245.0)]), Line("none", []), Line("c", [(250, 3.6)])]
    plot = ElementTree.fromstring(line_plot("title", "x", lines, log_y=log_y))
    marks = plot.findall("{*}circle")
    assert len(marks) == 3
    assert all(0 < float(mark.attrib["cx"]) < 480 and 0 < float(mark.attrib["cy"]) < 280 for mark in marks)
    assert marks[0].attrib["cx"] != marks[1].attrib["cx"]
    texts = [text.text for text in plot.findall("{*}text")]
    assert "a < b" in texts
    assert "none" not in texts


def test_cpu_and_memory_of_this_process() -> None:
    before = usage(os.getpid())
    end = time.process_time() + 0.05
    while time.process_time() < end:
        pass
    after = usage(os.getpid())
    assert after.cpu_s - before.cpu_s >= 0.03
    assert after.memory_mb > 5
    assert after.processes >= 1


WORDS = (Frame(0x205, b"\x7e\x04"), Frame(0x205, b"\x7f\x04"))


def played(manager: BroadcastManager, until: float, step: float = 0.001) -> list[tuple[float, bytes]]:
    """Data that it sends from 0 until then, with their times."""
    sent: list[tuple[float, bytes]] = []
    for number in range(round(until / step)):
        now = number * step
        sent += [(now, frame.data) for frame in manager.send(now)]
    return sent


def test_a_burst_is_sent_at_once_and_so_many_more_times():
    manager = BroadcastManager()
    frames = [*manager.take(bcm.setup(WORDS[:1], 0.01, 3, start=True, at_once=True), 0.0)]
    assert frames == [WORDS[0]]
    assert [at for at, _ in played(manager, 0.1)] == pytest.approx([0.01, 0.02])


def test_a_refilled_burst_keeps_its_phase_and_takes_its_frames_in_turn():
    manager = BroadcastManager()
    [*manager.take(bcm.setup(WORDS[:1], 0.01, 5, start=True, at_once=True), 0.0)]
    assert not [*manager.take(bcm.setup(WORDS, 0.01, 4, start=False, at_once=False, anew=True), 0.004)]
    sent = played(manager, 0.1)
    assert [at for at, _ in sent] == pytest.approx([0.01, 0.02, 0.03, 0.04])
    assert [data for _, data in sent] == [WORDS[0].data, WORDS[1].data] * 2


def test_a_burst_that_is_deleted_is_over():
    manager = BroadcastManager()
    [*manager.take(bcm.setup(WORDS[:1], 0.01, 5, start=True, at_once=True), 0.0)]
    [*manager.take(bcm.delete(0x205), 0.005)]
    assert played(manager, 0.1) == []
