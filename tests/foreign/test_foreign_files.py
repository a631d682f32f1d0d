"""The device descriptions of other people's packages: read, simulated, made into mappings, booted and served.

``make foreign`` fetches them, and shows the tables that these tests print."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from bridge.eds.model import Report
from bridge.eds.text_file import decode
from tests.support.eds_dialects import in_every_dialect
from tests.support.foreign import Result, served, table
from tests.support.process import REPOSITORY
from tools.foreign_files import PACKAGES, Package

FOLDER = REPOSITORY / "build" / "foreign"
ENOUGH = 0.9


def fetched() -> list[Path]:
    """The files of all packages; with LAB=0 there is no npm, and what comes with it is left out by name."""
    found: list[Path] = []
    for package in PACKAGES:
        files = sorted(_folder(package).glob("*"))
        if not files and package.registry == "npm" and os.environ.get("LAB") == "0":
            print(f"\nLAB=0: the files of {package} were NOT fetched")
            continue
        assert len(files) == package.files, f"{package} has not been fetched: run `make foreign`"
        found += files
    return found


def _folder(package: Package) -> Path:
    return FOLDER / f"{package.registry}-{package.name}"


def check(results: Sequence[Result]) -> None:
    """Drives and devices that are none are read, simulated, booted and served. Half a drive is refused."""
    for those in ([one for one in results if one.is_drive], [one for one in results if one.is_device]):
        assert those
        assert sum(not one.problem for one in those) >= ENOUGH * len(those), table(those)


def test_they_are_served_or_it_is_said_why(tmp_path: Path) -> None:
    results = [
        served(tmp_path / str(place), f"{path.parent.name}/{path.name}", path.read_bytes())
        for place, path in enumerate(fetched())
    ]
    print("\n" + table(results, findings=True))
    check(results)


def test_they_are_understood_in_every_dialect(tmp_path: Path) -> None:
    results: list[Result] = []
    for seed, path in enumerate(path for path in fetched() if path.suffix.lower() in (".eds", ".dcf")):
        text = decode(path.read_bytes(), Report())
        results += [
            served(tmp_path / f"{seed}{dialect}", f"{path.parent.name}/{path.name} as {dialect}", changed)
            for dialect, changed in in_every_dialect(text, seed)
        ]
    print(f"\n{table(results)}")
    check(results)
