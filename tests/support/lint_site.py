"""Sites for the linter, with one node "conveyor", id 5, and whatever else a test puts beside it."""

from __future__ import annotations

import tomllib
from pathlib import Path

from bridge.config import Site
from bridge.config.download import Download
from bridge.eds import Description
from bridge.lint import CheckResult, Severity, family_dictionaries, lint
from bridge.mapping import Family, load_family

NORD = "nord/sk-tu4-cao"
FAMILY = load_family(NORD)
DICTIONARY = family_dictionaries([NORD])[NORD]

SITE = """
[site]
name = "lint"
[[bus]]
name = "can0"
interface = "virtual"
{bus}
[[bus.node]]
name = "conveyor"
id = 5
mapping = "nord/sk-tu4-cao"
{node}
[[bus.node.drive]]
slot = "fu1"
control = "modbus"
accepts = {{ runs_on = "nothing moves in a test" }}
{drive}
{more}
[modbus]
listen = "127.0.0.1:1502"
"""
OTHER = """
[[bus.node]]
name = "pump"
id = {id}
mapping = "{family}"
[[bus.node.drive]]
slot = "fu1"
accepts = {{ runs_on = "nothing moves in a test" }}
"""
TIMEOUT = "fieldbus_timeout_ms = 200"


def judge(
    folder: Path,
    *,
    bus: str = "",
    node: str = "",
    drive: str = TIMEOUT,
    more: str = "",
    families: dict[str, Family] | None = None,
    dictionary: Description | None = DICTIONARY,
    downloads: tuple[Download, ...] = (),
) -> CheckResult:
    text = SITE.format(bus=bus, node=node, drive=drive, more=more)
    path = folder / "site.toml"
    path.write_text(text)
    site = Site.model_validate(tomllib.loads(text))
    known = {NORD: FAMILY} | (families or {})
    return lint(site, known, path, {"conveyor": downloads}, {NORD: dictionary} if dictionary else {})


def findings(verdict: CheckResult, severity: Severity) -> list[str]:
    return [f"{one.fault.key}: {one.fault.message}" for one in verdict.of(severity)]


def only(verdict: CheckResult, severity: Severity) -> str:
    """The one finding there is."""
    [finding] = verdict.findings
    assert finding.severity is severity, finding
    assert finding.fault.line > 0
    return str(finding)
