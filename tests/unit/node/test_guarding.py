"""A node that is watched by node guarding (CiA 301 §7.2.8.3.2.1), through the whole CANopen side."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.canopen.frame import REMOTE, Frame
from bridge.canopen.nmt import NmtState
from tests.support.bench import Bench, write_site

GUARDED = 'supervision = "guarding"\nsupervision_ms = 100\nlife_time_factor = 2'
GUARD_S, LIFE_S = 0.1, 0.2
QUESTION = 0x705 | REMOTE
START = Frame(0x000, b"\x01\x05")


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(write_site(tmp_path, node=GUARDED), present=False)


def started(bench: Bench) -> None:
    """Until the node has been told to start."""
    bench.power_on()
    while START.data not in [frame.data for frame in bench.sent(0x000)]:
        bench.run(0.001)


def test_guard_time_and_life_time_are_set_in_the_node_and_it_is_asked_in_that_time(bench: Bench) -> None:
    started(bench)
    writes = [frame.data.hex() for frame in bench.sent(0x605)]
    assert "2b0c100064000000" in writes
    assert "2f0d100002000000" in writes
    bench.run(1.0)
    assert bench.value("conveyor/node/nmt_state") == NmtState.OPERATIONAL
    before = len(bench.sent(QUESTION))
    bench.run(1.0)
    assert len(bench.sent(QUESTION)) - before == pytest.approx(1.0 / GUARD_S, abs=1)


def test_a_node_that_answers_after_its_life_time_when_it_is_started_is_guarded_all_the_same(
    bench: Bench,
) -> None:
    """Its life time runs out between the start command and its answer: nobody else would ask it again."""
    started(bench)
    bench.deaf_to = frozenset({0x705})
    bench.run(LIFE_S + 0.05)
    bench.deaf_to = frozenset()
    bench.receive(Frame(0x705, b"\x05"))
    bench.run(0.001)
    assert bench.value("conveyor/node/nmt_state") == NmtState.OPERATIONAL
    before = len(bench.sent(QUESTION))
    bench.run(1.0)
    assert len(bench.sent(QUESTION)) - before == pytest.approx(1.0 / GUARD_S, abs=1)


def test_a_node_that_answered_late_and_dies_then_is_lost(bench: Bench) -> None:
    started(bench)
    bench.deaf_to = frozenset({0x705})
    bench.run(LIFE_S + 0.05)
    bench.deaf_to = frozenset()
    bench.receive(Frame(0x705, b"\x05"))
    bench.run(0.001)
    bench.powered = False
    bench.run(LIFE_S + 2 * GUARD_S)
    assert str(bench.value("conveyor/node/boot_status")).startswith("F: lost: no answer to node guarding")
