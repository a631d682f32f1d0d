"""The report of a drop test says what was tried and what came of it."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest

from bridge.cli import drop_report
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


@pytest.mark.parametrize("more", [WATCHING, ""])
def test_the_report_says_what_was_tried(tmp_path: Path, more: str) -> None:
    bench = bench_of(tmp_path, more)
    test = drop(bench)
    site = tmp_path / "site.toml"
    occasion = drop_report.Occasion("me", "here", "agreed", datetime(2026, 11, 24, tzinfo=UTC), site)
    (node,) = bench.plant.nodes.values()
    facts = drop_report.facts(occasion, node, test)
    assert facts["ok"] is bool(more)
    assert (facts["node"]["vendor"], facts["node"]["product"]) == (0xACE, 0x401)
    text = drop_report.markdown(facts)
    assert f"| own time-out | {test.outcomes[0].own_text} |" in text
    assert all(setting["setting"] in text for setting in facts["drives"][0]["settings"])
    assert "leaves Operational" in text
    assert "drives stood still" not in text
