"""``check`` and ``hash-password``: work on files, without a bus."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from bridge.base.errors import Fault, FileFaults
from bridge.catalogue import Catalogue
from bridge.cli.terminal import printable
from bridge.lint import CheckResult, Severity, lint
from bridge.project import count, load_project


def check(
    site: Annotated[Path, typer.Argument(metavar="SITE", help="the site file")],
    as_json: Annotated[bool, typer.Option("--json", help="machine-readable")] = False,
) -> None:
    """Check SITE and the mappings it uses, and predict its bus load; every fault in one run."""
    try:
        project = load_project(site)
        catalogue = Catalogue.of(project.site, project.families)
    except FileFaults as error:
        if as_json:
            faults = [_fault(fault, Severity.ERROR) for fault in error.faults]
            print(json.dumps({"ok": False, "faults": faults}, indent=2))
            raise typer.Exit(error.exit_code) from None
        raise
    verdict = lint(project.site, project.families, project.path, project.downloads)
    errors = verdict.of(Severity.ERROR)
    if as_json:
        print(json.dumps(_as_json(catalogue, verdict), indent=2))
        if errors:
            raise typer.Exit(FileFaults.exit_code)
        return
    for warning in verdict.of(Severity.WARNING):
        print(printable(str(warning)), file=sys.stderr)
    for load in verdict.loads:
        print(load)
    for case in verdict.worst_cases:
        print(case)
        for terms in case.terms:
            print(f"  {terms}")
    for exposure in verdict.exposures:
        print(exposure)
    if errors:
        raise FileFaults([finding.fault for finding in errors])
    print(f"{site}: {_served(catalogue)} on {count(len(project.site.bus), 'bus')}, no faults")


def _served(catalogue: Catalogue) -> str:
    drives, devices = catalogue.drives, catalogue.devices
    parts = [count(len(drives), "drive")] if drives or not devices else []
    return " and ".join([*parts, *([count(len(devices), "device")] if devices else [])])


def _as_json(catalogue: Catalogue, verdict: CheckResult) -> dict[str, Any]:
    found = {
        severity: [_fault(finding.fault, severity) for finding in verdict.of(severity)]
        for severity in Severity
    }
    return {
        "ok": not found[Severity.ERROR],
        "drives": list(catalogue.drives),
        "devices": list(catalogue.devices),
        "buses": [asdict(load) for load in verdict.loads],
        "intruders": [asdict(exposure) for exposure in verdict.exposures],
        "worst_cases": [
            {
                "drive": case.drive,
                **case.facts,
                "verdict": str(case.own.verdict),
            }
            for case in verdict.worst_cases
        ],
        "faults": found[Severity.ERROR],
        "warnings": found[Severity.WARNING],
    }


def _fault(fault: Fault, severity: Severity) -> dict[str, Any]:
    place = {"file": fault.file, "line": fault.line, "key": fault.key}
    return {"severity": severity.value, **place, "message": fault.message, "hint": fault.hint}


def hash_password() -> None:
    """Ask for a password and print the line for ``password_hash`` in the site file."""
    from bridge.northbound.passwords import hash_password as hashed

    print(hashed(typer.prompt("Password", hide_input=True, confirmation_prompt=True)))
