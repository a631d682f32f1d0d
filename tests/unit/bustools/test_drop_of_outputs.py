"""The drop test of a node that is no drive: it notices a silent bridge."""

from __future__ import annotations

from pathlib import Path

from bridge.bustools.drop_test import Proof
from bridge.drive import OwnVerdict
from bridge.project import load_project
from bridge.sim.catalogue import simulate_description
from tests.support import sites
from tests.support.devices import DEVICES, description_of
from tests.support.muted_bench import MutableBench, drop

WATCHING = "own_timeout_ms = 400\nenforce = true\n"
MAPPING = "eds:io16.eds"


def bench_of(folder: Path, more: str) -> MutableBench:
    (folder / "io16.eds").write_bytes((DEVICES / "io16.eds").read_bytes())
    block = sites.node(name="io", node_id=21, mapping=MAPPING, more=more)
    project = load_project(sites.write(folder, sites.bus(block)))
    node = simulate_description(description_of("io16.eds"), 21)
    return MutableBench(project.site, family=project.families[MAPPING], mapping=MAPPING, node=node)


def test_a_node_that_notices_is_proven(tmp_path: Path) -> None:
    bench = bench_of(tmp_path, WATCHING)
    (outcome,) = drop(bench).outcomes
    assert (outcome.drive, outcome.own.verdict, outcome.own_ms) == ("io", OwnVerdict.STOPS, 400)
    assert outcome.is_proven, outcome.seen
    assert 300 < (outcome.reacted_ms or outcome.noticed_ms or 0) <= 450


def test_one_that_does_not_is_not(tmp_path: Path) -> None:
    (outcome,) = drop(bench_of(tmp_path, "")).outcomes
    assert outcome.proof is Proof.NOTHING
    assert not outcome.is_proven
