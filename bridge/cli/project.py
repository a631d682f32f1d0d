"""``check`` and ``hash-password``: work on files, without a bus."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from bridge.config import warnings
from bridge.errors import FileFaults
from bridge.service import count, load_project


def check(
    site: Annotated[Path, typer.Argument(metavar="SITE", help="the site file")],
    as_json: Annotated[bool, typer.Option("--json", help="machine-readable")] = False,
) -> None:
    """Check SITE and the mappings it uses; every fault in one run."""
    try:
        project = load_project(site)
    except FileFaults as error:
        if as_json:
            print(json.dumps({"ok": False, "faults": [asdict(fault) for fault in error.faults]}, indent=2))
            raise typer.Exit(error.exit_code) from None
        raise
    repeated = warnings(project.site)
    drives = [
        f"{node.name}/{drive.name or drive.slot}"
        for bus in project.site.bus
        for node in bus.node
        for drive in node.drive
    ]
    if as_json:
        print(json.dumps({"ok": True, "drives": drives, "warnings": repeated}, indent=2))
        return
    for warning in repeated:
        print(f"warning: {warning}", file=sys.stderr)
    print(f"{site}: {count(len(drives), 'drive')} on {count(len(project.site.bus), 'bus')}, no faults")


def hash_password() -> None:
    """Ask for a password and print the line for ``password_hash`` in the site file."""
    from bridge.northbound.opcua.security import hash_password as hashed

    print(hashed(typer.prompt("Password", hide_input=True, confirmation_prompt=True)))
