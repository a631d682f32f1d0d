"""Findings of the linter: like faults of a file, with a severity, in the order of the file."""

from __future__ import annotations

from pathlib import Path

from bridge.lint.report import LintReport, Severity

SITE = '[site]\nname = "hall"\n[[bus]]\nname = "can0"\n[[bus]]\nname = "can1"\n'


def test_findings_stand_at_their_keys_in_the_order_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "site.toml"
    path.write_text(SITE)
    report = LintReport(path)
    report.warning(("bus", 1, "name"), "is odd", "another")
    report.error(("site", "name"), "is wrong")
    first, second = report.findings()
    assert str(first) == f"error: {path}:2: site.name: is wrong"
    assert str(second) == f"warning: {path}:6: bus[1].name: is odd (another)"
    assert (first.severity, second.severity) == (Severity.ERROR, Severity.WARNING)


def test_a_file_that_has_gone_meanwhile_costs_the_lines_alone(tmp_path: Path) -> None:
    report = LintReport(tmp_path / "gone.toml")
    report.error(("site",), "is wrong")
    assert str(report.findings()[0]) == f"error: {tmp_path / 'gone.toml'}: site: is wrong"
    assert LintReport(tmp_path / "gone.toml").findings() == ()
