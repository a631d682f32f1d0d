"""The results of the proof: fault × family × protocol as JSON and as tables in two Markdown pages.

The page of the proof has one row for each kind of fault, the page of the figures one for each fault, family
and protocol."""

from __future__ import annotations

import json
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

BEGIN: Final = "<!-- made by `make proof`: do not edit -->"
END: Final = "<!-- end of what `make proof` makes -->"

KINDS: Final = {
    "controller": (
        "owner stopped",
        "owner killed",
        "owner stopped beside strangers",
        "owner's telegrams are not valid",
        "client writes ahead and hangs",
        "drive released",
    ),
    "network and machine": (
        "network cut",
        "half-open connection",
        "disk full",
        "clock stepped by an hour",
    ),
    "front": (
        "OPC UA front stopped",
        "OPC UA front killed",
        "zenoh front stopped",
        "zenoh front killed",
        "front killed, starts fail",
    ),
    "bus process": (
        "bus process paused",
        "bus process paused with a frame of a second bridge waiting",
        "bus process stopped as it sends",
        "bus process stopped",
        "bus process killed",
        "event loop blocked for 1 s",
        "pause of the bridge across the deadline",
        "SIGHUP to the bus process",
        "SIGTERM to the bus process",
    ),
    "bus": ("interface down", "interface down for 50 ms", "bus-off"),
    "node and drive": (
        "node silent",
        "node rebooting",
        "deaf drive",
        "deaf drive whose owner jogs",
        "boot-up fails after a restart",
    ),
    "third parties": (
        "intruder on an RPDO",
        "intruder that is a master",
        "second bridge",
        "second connection of the owner's address",
        "what moves a drive as a parameter",
    ),
    "stop and acknowledge": (
        "stop asked for in a silence",
        "stop of outputs that their silent owner's time-out holds",
        "acknowledge after somebody's stop",
        "acknowledge after somebody's stop of outputs",
    ),
}
"""What fails, with the names of its faults: the rows of the summary."""

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

    def worst_and_bound(self, what: str) -> tuple[float, float] | None:
        """Worst time and bound in ms of ``bus`` or ``drive``; None where it has none."""
        values, bounds = self._values(f"{what}_ms"), self._values(f"{what}_bound_ms")
        return (max(values), max(bounds)) if values and bounds else None

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
_SUMMARY_HEAD: Final = (
    "what fails",
    "faults",
    "measurements",
    "failed",
    "void",
    "stop on the bus, ms",
    "drive stopped, ms",
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


def _conditions(result: dict[str, Any]) -> str:
    return (
        f"{result['date']}, {result['machine']}; {result['cycles']} cycles, "
        f"{result['seconds'] / 60:.0f} min, of all plants together. Times in ms."
    )


def _closest(found: Iterable[Cell], what: str) -> str:
    """The worst time that comes closest to its bound, with that bound."""
    pairs = [pair for cell in found if (pair := cell.worst_and_bound(what))]
    if not pairs:
        return "–"
    worst, bound = max(pairs, key=lambda pair: pair[0] / pair[1])
    return f"{worst:.0f} of {bound:.0f}"


def summary(result: dict[str, Any]) -> str:
    """The generated part of the page of the proof, markers included: a row for each kind of fault."""
    found = cells(result["samples"])
    rows: list[list[str]] = []
    for kind, names in KINDS.items():
        of_kind = [cell for cell in found if cell.fault in names]
        if not of_kind:
            continue
        measured = sum(len(cell.records) for cell in of_kind)
        failed, void = sum(cell.count("failed") for cell in of_kind), sum(len(cell.void) for cell in of_kind)
        faults = len({cell.fault for cell in of_kind})
        numbers = [str(faults), str(measured), f"**{failed}**" if failed else "0", str(void)]
        timed = [cell for cell in of_kind if not cell.demand]
        rows.append([kind, *numbers, _closest(of_kind, "bus"), _closest(timed, "drive")])
    judged = sum(len(cell.records) for cell in found if cell.demand)
    lines = [
        BEGIN,
        "",
        _conditions(result) + f" {judged} measurements were judged by yes or no.",
        "",
        *_table(_SUMMARY_HEAD, slice(1, 7), rows),
        "",
        END,
    ]
    return "\n".join(lines)


def markdown(result: dict[str, Any]) -> str:
    """The generated part of the page of the figures, markers included: a row for each fault, family and
    protocol."""
    found = cells(result["samples"])
    demands = [cell.demand_row() for cell in found if cell.demand]
    failed = sum(sample["verdict"] == "failed" for sample in result["samples"])
    void = sum(sample["verdict"] == "void" for sample in result["samples"])
    lines = [
        BEGIN,
        "",
        _conditions(result),
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


def put_into(page: Path, figures: Path, result: dict[str, Any]) -> None:
    put_between(page, BEGIN, END, summary(result))
    put_between(figures, BEGIN, END, markdown(result))


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
