"""Frames that may go before one of ours, and the sum in the documentation."""

from __future__ import annotations

from pathlib import Path

from bridge.lint import CheckResult, lint
from bridge.project import load_project
from tests.support import sites
from tests.support.docs import REPOSITORY


def verdict(path: Path) -> CheckResult:
    project = load_project(path)
    return lint(project.site, project.families, path, project.downloads)


def before_ms(folder: Path, nodes: int, bus: str = "") -> float | None:
    tables = [
        sites.node(sites.drive("fu1", "modbus", 200), name=f"n{n}", node_id=n) for n in range(1, nodes + 1)
    ]
    return (
        verdict(sites.write(folder, sites.bus(*tables, more=bus), sites.modbus()))
        .worst_cases[0]
        .wire.before_ms
    )


def test_more_nodes_and_a_slower_bus_take_longer(tmp_path: Path) -> None:
    one, two = before_ms(tmp_path, 1), before_ms(tmp_path, 2)
    fast = before_ms(tmp_path, 1, "bitrate = 1000000")
    assert one is not None and two is not None and fast is not None
    assert two > one > fast >= 4 * 0.135, "one frame under way, SYNC, a TPDO, our heartbeat at least"


def test_a_bus_that_is_never_idle_has_no_bound(tmp_path: Path) -> None:
    assert before_ms(tmp_path, 20, "bitrate = 50000") is None


def test_the_example_of_the_page_is_what_check_shows() -> None:
    page = (REPOSITORY / "docs/explanation/dead-man-chain.md").read_text(encoding="utf-8")
    case = verdict(REPOSITORY / "deploy/site.example.toml").worst_cases[0]
    assert f"\n{case.stop.sum}\n{case.drive}: dead controller: {case.stop}\n" in page
