"""The table of the proof: fault × family × protocol, as JSON and as a part of a Markdown page."""

from __future__ import annotations

import json
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

BEGIN: Final = "<!-- made by `make proof`: do not edit -->"
END: Final = "<!-- end of what `make proof` makes -->"

_MOST_PER_MEASUREMENT: Final = 0.01
_MOST_AT_LEAST: Final = 3
"""How many drives may stop without a fault of theirs: a slow machine's controllers are late. More than that
is a bridge that stops what it should not."""
_MOST_WHERE_BUSY: Final = 26
"""Each drive twice, where other tests have the machine as well."""

Record = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Cell:
    """All samples of one fault, family and protocol. Times in ms. Void ones are none of those that are
    needed, but the medians and the worst are of all: nothing that was late is hidden."""

    fault: str
    family: str
    protocol: str
    records: tuple[Record, ...]
    void: tuple[Record, ...] = ()

    def _values(self, key: str) -> list[float]:
        measured = (*self.records, *self.void)
        return [float(record[key]) for record in measured if record.get(key) is not None]

    def _triple(self, what: str) -> list[str]:
        values, bounds = self._values(f"{what}_ms"), self._values(f"{what}_bound_ms")
        if not values:
            return ["–", "–", "–"]
        bound = f"{max(bounds):.0f}" if bounds else "–"
        return [str(round(statistics.median(values))), str(round(max(values))), bound]

    def count(self, verdict: str) -> int:
        return sum(record["verdict"] == verdict for record in self.records)

    @property
    def demand(self) -> str:
        """What has to hold, where that is judged by yes or no; empty where times are."""
        return next((record["demand"] for record in (*self.records, *self.void) if record.get("demand")), "")

    @property
    def verdict(self) -> str:
        bad = self.count("failed")
        notes = [f"**{bad} failed**"] * bool(bad)
        if self.void:
            over = max(record["over_ms"] for record in self.void)
            notes.append(
                f"{len(self.void)} void: late by up to {over:.1f} ms, and the machine was in the way for that"
            )
        return "; ".join(notes) or "ok"

    def row(self) -> list[str]:
        times = (
            *self._triple("way")[1:2],
            *self._triple("sent")[1:],
            *self._triple("bus"),
            *self._triple("drive"),
        )
        return [self.fault, self.family, self.protocol, str(len(self.records)), *times, self.verdict]

    def demand_row(self) -> list[str]:
        """The same of a fault that is judged by yes or no."""
        head = self.fault, self.family, self.protocol, self.demand, str(len(self.records))
        return [*head, *self._triple("bus"), self.verdict]


def cells(records: Iterable[Record]) -> list[Cell]:
    """In the order in which they first occur."""
    found: dict[tuple[str, str, str], list[Record]] = {}
    for record in records:
        found.setdefault((record["fault"], record["family"], record["protocol"]), []).append(record)
    return [
        Cell(
            *key,
            tuple(record for record in records if record["verdict"] != "void"),
            tuple(record for record in records if record["verdict"] == "void"),
        )
        for key, records in found.items()
    ]


def merge(parts: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The results of several machines as one."""
    merged = dict(parts[0])
    merged["samples"] = [sample for part in parts for sample in part["samples"]]
    merged["stopped_in_vain"] = [text for part in parts for text in part["stopped_in_vain"]]
    for key in ("by_themselves", "seconds", "cycles"):
        merged[key] = sum(part[key] for part in parts)
    merged["faults_missing"] = sorted({name for part in parts for name in part["faults_missing"]})
    merged["cells"] = sorted({tuple(cell) for part in parts for cell in part["cells"]})
    merged["errors"] = [text for part in parts for text in part["errors"]]
    order = {name: place for place, name in enumerate(merged["faults"])}
    merged["samples"].sort(key=lambda sample: (order[sample["fault"]], sample["family"], sample["protocol"]))
    return merged


_HEAD: Final = (
    "fault",
    "family",
    "protocol",
    "n",
    "way: worst",
    "from the send: worst",
    "bound",
    "bus: median",
    "worst",
    "bound",
    "drive: median",
    "worst",
    "bound",
    "",
)
_DEMAND_HEAD: Final = (
    "fault",
    "family",
    "protocol",
    "what has to hold",
    "n",
    "bus: median",
    "worst",
    "bound",
    "",
)


def _table(head: Sequence[str], numbers: slice, rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a table; its columns ``numbers`` are right-aligned."""
    rules = ["---"] * len(head)
    rules[numbers] = ["--:"] * len(rules[numbers])
    lines = ["| " + " | ".join(row) + " |" for row in (head, *rows)]
    return [lines[0], "|" + "|".join(rules) + "|", *lines[1:]]


def markdown(result: dict[str, Any]) -> str:
    """The generated part of docs/explanation/proof.md, markers included."""
    found = cells(result["samples"])
    demands = [cell.demand_row() for cell in found if cell.demand]
    failed = sum(sample["verdict"] == "failed" for sample in result["samples"])
    void = sum(sample["verdict"] == "void" for sample in result["samples"])
    lines = [
        BEGIN,
        "",
        f"{result['date']}, {result['machine']}; {result['cycles']} cycles, "
        f"{result['seconds'] / 60:.0f} min, of all plants together. Times in ms.",
        "",
        f"{len(result['samples']) - void} measurements: {failed} failed. Void, and made again: {void}, in "
        "which a bound was exceeded by no more than the machine stood still, or bridge and drives waited for "
        "the CPU that they share here. "
        f"{result['by_themselves']} times a drive was found stopped before a fault, and "
        f"{len(result['stopped_in_vain'])} times beside one that did not concern it (some of them are both): "
        "the machine was too slow for its controllers then.",
        "",
        *(
            [f"Not possible on this machine: {', '.join(result['faults_missing'])}.", ""]
            * bool(result["faults_missing"])
        ),
        *_table(_HEAD, slice(3, 13), (cell.row() for cell in found if not cell.demand)),
        "",
        *(
            [
                "Judged by yes or no; the times are those of a stop that was asked for, from the call to the "
                "bus:",
                "",
                *_table(_DEMAND_HEAD, slice(4, 8), demands),
                "",
            ]
            * bool(demands)
        ),
        END,
    ]
    return "\n".join(lines)


def put_into(page: Path, result: dict[str, Any]) -> None:
    put_between(page, BEGIN, END, markdown(result))


def put_between(page: Path, begin: str, end: str, made: str) -> None:
    """Replace what stands between these markers of ``page``, them included."""
    text = page.read_text(encoding="utf-8")
    before, found, rest = text.partition(begin)
    _, ended, after = rest.partition(end)
    if not (found and ended):
        raise ValueError(f"{page} has no markers: {begin} … {end}")
    page.write_text(before + made + after, encoding="utf-8")


def load(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8"))


def failures(result: dict[str, Any], least: int) -> list[str]:
    """Why the proof has not succeeded: one sentence each, none where it has.

    Each of the result's ``cells`` (fault, family, protocol, what a round is worth) needs samples of as many
    rounds as inject its fault ``least`` times."""
    found = list(result["errors"])
    is_busy = any(sample["noise_ms"] for sample in result["samples"])
    at_least = _MOST_WHERE_BUSY if is_busy else _MOST_AT_LEAST
    most = max(at_least, int(_MOST_PER_MEASUREMENT * len(result["samples"])))
    in_vain = len(result["stopped_in_vain"])
    if in_vain > most:
        found.append(f"{in_vain} drives stopped beside a fault that did not concern them, {most} may")
    if result["by_themselves"] > most:
        found.append(f"{result['by_themselves']} drives were found stopped before a fault, {most} may be")
    seen = {(cell.fault, cell.family, cell.protocol): cell for cell in cells(result["samples"])}
    worth = {(fault, family, protocol): each for fault, family, protocol, each in result["cells"]}
    empty = {key: Cell(*key, ()) for key in worth if key not in seen}
    for key, cell in {**seen, **empty}.items():
        name = f"{cell.fault}, {cell.family}, {cell.protocol}"
        if bad := cell.count("failed"):
            found.append(f"{name}: {bad} of {len(cell.records)} failed")
        needed = -(-least // worth[key])
        if len(cell.records) < needed:
            found.append(f"{name}: only {len(cell.records)} samples of {needed}")
    return found
