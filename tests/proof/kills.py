"""The results of the seeded faults: how many were found, and a table of which by what and how soon."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from tests.proof.report import put_between

BEGIN: Final = "<!-- made by `make proof-mutants`: do not edit -->"
END: Final = "<!-- end of what `make proof-mutants` makes -->"


def merge(parts: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The results of several machines as one, in the order of the table of mutants. One that lived on one
    plant and was found on another is found."""
    merged = dict(parts[0])
    merged["false_alarms"] = [text for part in parts for text in part["false_alarms"]]
    place = {name: number for number, name in enumerate(merged["mutants"])}
    kills: dict[str, dict[str, Any]] = {}
    for kill in (kill for part in parts for kill in part["kills"]):
        if not kills.get(kill["mutant"], {}).get("judgement"):
            kills[kill["mutant"]] = kill
    merged["kills"] = sorted(kills.values(), key=lambda kill: place[kill["mutant"]])
    merged["seconds"] = max(part["seconds"] for part in parts)
    merged["machines"] = len([part for part in parts if len(part["mutants"]) == len(place)])
    return merged


def _conditions(result: dict[str, Any]) -> str:
    found = sum(bool(kill["judgement"]) for kill in result["kills"])
    return (
        f"{result['date']}, {result['machine']}; {result['machines']} at a time, "
        f"{result['seconds'] / 60:.0f} min. {found} of {len(result['mutants'])} were found, and "
        f"{len(result['false_alarms'])} faults in the program as it is."
    )


def summary(result: dict[str, Any]) -> str:
    """The generated part of the page of the proof, markers included."""
    return "\n".join([BEGIN, "", _conditions(result), "", END])


def markdown(result: dict[str, Any]) -> str:
    """The generated part of the page of the figures, markers included: a row for each seeded fault."""
    rows = [
        f"| {kill['mutant']} | {kill['breaks']} | {kill['fault'] or '**survived**'} "
        f"| {kill['judgement'].replace('|', '/')} | {kill['seconds']:.0f} |"
        for kill in result["kills"]
    ]
    lines = [
        BEGIN,
        "",
        _conditions(result),
        "",
        "| seeded fault | what it breaks | found by | judgement | s |",
        "|---|---|---|---|--:|",
        *rows,
        "",
        END,
    ]
    return "\n".join(lines)


def put_into(page: Path, figures: Path, result: dict[str, Any]) -> None:
    put_between(page, BEGIN, END, summary(result))
    put_between(figures, BEGIN, END, markdown(result))


def survivors(result: dict[str, Any]) -> list[str]:
    return [kill["mutant"] for kill in result["kills"] if not kill["judgement"]]


def failures(result: dict[str, Any]) -> list[str]:
    """Why the hunt has not succeeded: one sentence each."""
    found = [f"false alarm: {text}" for text in result["false_alarms"]]
    tried = {kill["mutant"] for kill in result["kills"]}
    found += [f"not tried: {name}" for name in result["mutants"] if name not in tried]
    return found + [f"survived: {name}" for name in survivors(result)]
