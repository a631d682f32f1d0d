"""The demo's site file is what a good one looks like: whoever sees the demo first sees a plant in order."""

from __future__ import annotations

from pathlib import Path

from bridge.lint import CheckResult, Severity, lint
from bridge.project import load_project

DEMO = Path("bridge/demo/site.toml")


def verdict() -> CheckResult:
    project = load_project(DEMO)
    return lint(project.site, project.families, DEMO, project.downloads)


def test_each_drive_of_the_demo_stops_when_its_bridge_falls_silent() -> None:
    cases = verdict().worst_cases
    assert len(cases) == 7
    assert [str(one) for one in cases if "runs on" in str(one) or "not known" in str(one)] == []


def test_the_demo_warns_of_nothing_but_its_open_opc_ua_endpoint() -> None:
    assert verdict().of(Severity.ERROR) == ()
    assert [one.fault.key for one in verdict().of(Severity.WARNING)] == ["opcua.no_security"]
