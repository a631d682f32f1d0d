"""The end of the service with outputs: waited for, named where they do not follow or cannot be read."""

from __future__ import annotations

from pathlib import Path

from bridge.master.ending import Ending, waits_for
from tests.support.bench import Bench
from tests.support.output_block import (
    block_bench,
    block_of,
    go,
    nmt_stops,
)


def ended(bench: Bench, for_s: float) -> Ending:
    bench.master.halt(bench.now)
    bench.run(for_s)
    return bench.end()


def test_the_end_waits_for_outputs_and_says_that_all_are_stopped(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path))
    bench.master.halt(bench.now)
    assert waits_for(bench.plant)
    bench.run(0.1)
    assert not waits_for(bench.plant)
    ending = bench.end()
    assert (ending.is_good, ending.lines) == (True, ["all drives and outputs are stopped"])


def test_the_end_names_outputs_that_do_not_follow(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path))
    block_of(bench).stuck["6200:01"] = 1, 0x81
    ending = ended(bench, 1.0)
    assert (ending.is_good, ending.ignoring, ending.nodes_stopped) == (False, ("shaft",), ("shaft",))
    assert ending.lines[-1] == "0 of 1 drives and outputs are stopped"


def test_the_end_does_not_wait_for_what_cannot_be_read_and_names_it(tmp_path: Path) -> None:
    bench = block_bench(tmp_path)
    block_of(bench).refuses_reading.add(0x6200)
    ending = ended(go(bench), 1.0)
    assert not waits_for(bench.plant)
    assert (ending.is_good, nmt_stops(bench)) == (True, 0)
    reason = "the node does not let 6200h:01 be read: attempt to read a write-only object (06010001h)"
    assert ending.lines == [
        f"forwarded, and not known to be followed: shaft ({reason})",
        "0 of 1 drives and outputs are stopped",
    ]


def test_the_end_names_outputs_that_are_not_heard(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path))
    bench.cut = True
    assert ended(bench, 1.0).unheard == ("shaft",)
