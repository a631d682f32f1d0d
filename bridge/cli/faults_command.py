"""``faults``: what the drives of a site, or of a family, can report, with causes and remedies."""

from __future__ import annotations

import json
import re
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from bridge.base.errors import OperationFailed
from bridge.bustools.fault_memory import fault_memory
from bridge.cli.parameter_drive import find
from bridge.cli.terminal import printable
from bridge.drive import FaultWords
from bridge.drive.fault_words import Explained, Language, emergency_codes, listed_faults
from bridge.mapping import load_family
from bridge.mapping.loader import family_names
from bridge.mapping.model import Family
from bridge.project import load_project
from bridge.text import render


class Tongue(StrEnum):
    """A language, as an option."""

    EN = "en"
    DE = "de"


def faults(
    site: Annotated[
        str, typer.Argument(metavar="SITE", help="a site file, or a family such as nord/sk-tu4-cao")
    ],
    fault: Annotated[
        str, typer.Argument(metavar="[FAULT]", help="a number, or a part of a text; left out, all")
    ] = "",
    drive: Annotated[
        str | None, typer.Option(help="NODE/DRIVE: ask it what it remembers, instead of listing all")
    ] = None,
    language: Annotated[Tongue, typer.Option(help="English or German")] = Tongue.EN,
    as_json: Annotated[bool, typer.Option("--json", help="machine-readable")] = False,
) -> None:
    """List the faults that the drives of a site or family report, with causes and remedies."""
    tongue: Language = "de" if language is Tongue.DE else "en"
    if drive is not None:
        if fault:
            raise typer.BadParameter(
                "lists all that the drive remembers: give no FAULT", param_hint="--drive"
            )
        _show_memory(Path(site), drive, tongue, as_json=as_json)
        return
    found = {name: matching(family, fault, tongue) for name, family in _families(site).items()}
    if fault and not any(found.values()):
        raise OperationFailed(f"{', '.join(found)}: no fault {fault!r}")
    if as_json:
        facts = {name: [asdict(one) for one in listed] for name, listed in found.items()}
        print(json.dumps(facts, indent=2, ensure_ascii=False))
        return
    for name, listed in found.items():
        print(printable(name))
        for one in listed:
            _tell(f"  {one}", one)


def _tell(line: str, one: Explained) -> None:
    print(printable(line))
    for said in filter(None, (one.cause, one.remedy)):
        print(printable(f"      {said}"))


def _show_memory(site: Path, drive: str, language: Language, *, as_json: bool) -> None:
    target = find(site, drive)
    words = FaultWords(target.family, language)
    found = target.run(lambda now: fault_memory(target.access, target.family, words, now))
    if as_json:
        facts = [
            {"where": one.where, "information": one.information, **asdict(one.explained)} for one in found
        ]
        print(json.dumps(facts, indent=2, ensure_ascii=False))
        return
    print(printable(target.name if found else f"{target.name}: remembers no fault"))
    for one in found:
        more = f" ({one.information:04X}h)" if one.information else ""
        _tell(f"  {one.where}: {one.explained}{more}", one.explained)


def _families(site: str) -> dict[str, Family]:
    if site in family_names():
        return {site: load_family(site)}
    if not site.endswith(".toml"):
        raise typer.BadParameter(f"{site!r} is neither a site file nor one of {', '.join(family_names())}")
    return load_project(Path(site)).families


def matching(family: Family, wanted: str, language: Language) -> list[Explained]:
    """The fault with this number, in any of its forms, or the emergency code; else those with ``wanted`` in
    number or text."""
    words = FaultWords(family, language)
    every = {name: words.listed(name) for name in listed_faults(family)}
    # Codes for which the drive has numbers of its own are not listed twice.
    codes = {name: words.listed(name) for name in emergency_codes(family)}
    exact = [one for name, one in (codes | every).items() if wanted and _is_number(wanted, name, one.number)]
    part = wanted.lower()

    def has_part(one: Explained) -> bool:
        return part in one.number.lower() or part in render(one.text).lower()

    return exact or list(filter(has_part, every.values()))


def _is_number(wanted: str, name: str, number: str) -> bool:
    """``number`` may have x for digits that depend on how the drive is set."""
    asked = wanted.lower()
    if name.endswith("h"):
        return asked.removeprefix("0x").removesuffix("h") == name.lower().removesuffix("h")
    pattern = re.escape(number.lower()).replace("x", "[x0-9]")
    return asked in (name.lower(), number.lower().rpartition("/")[2]) or bool(re.fullmatch(pattern, asked))
