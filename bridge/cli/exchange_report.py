"""State of an exchange, kept until it is done, and its report."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC
from pathlib import Path
from typing import Any, cast

from bridge import __version__
from bridge.base.errors import OperationFailed
from bridge.cli import drop_report
from bridge.config import NodeTable

_FOLDER = "exchanges"
_Facts = dict[str, Any]


@dataclass(slots=True)
class DeviceExchange:
    """One exchange of a node's device. It is kept in ``folder`` until ``end``, so that whoever begins again
    with the same device and files reports also what was written before."""

    folder: Path
    node: str
    began: str
    last: str
    files: dict[str, str]
    """SHA-256 of the backups, by path."""
    identity: dict[str, int]
    drives: dict[str, _Facts] = field(default_factory=dict[str, Any])
    is_unsaved: bool = False
    """True while something was written that the node has not been told to save."""
    warnings: list[str] = field(default_factory=list[str])

    def keep(self, drive: str, facts: Mapping[str, Any]) -> None:
        """Add what was done to a drive to what was done to it before."""
        before = self.drives.get(drive, {}).get("written", [])
        self.drives[drive] = {**facts, "written": [*before, *facts["written"]]}
        self.is_unsaved |= bool(facts["written"])
        self.write()

    def saved(self, warning: str) -> None:
        self.is_unsaved = False
        self.warnings += [warning] if warning else []
        self.write()

    def end(self, report: Mapping[str, Any]) -> tuple[Path, Path]:
        """Write the report; raises OSError where that fails. What was kept goes once it is a success."""
        files = drop_report.write(dict(report), markdown(report), self.folder)
        if report["ok"]:
            self.path.unlink(missing_ok=True)
        return files

    @property
    def path(self) -> Path:
        return self.folder / f"{self.node}.unfinished.json"

    def write(self) -> None:
        """Raises ``OperationFailed`` where it cannot be kept."""
        kept = {name: getattr(self, name) for name in _KEPT}
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            beside = self.path.with_suffix(".new")
            beside.write_text(json.dumps(kept, indent=2), encoding="utf-8")
            beside.replace(self.path)
        except OSError as error:
            raise OperationFailed(
                f"what was done cannot be kept in {self.folder}: {error.strerror}; run it as the "
                "service's user"
            ) from None


_KEPT = ("node", "began", "files", "identity", "drives", "is_unsaved", "warnings")


def begin(
    state_dir: Path,
    occasion: drop_report.Occasion,
    node: str,
    identity: dict[str, int],
    files: Sequence[Path],
) -> DeviceExchange:
    """The exchange that was begun with this device and these files, or a new one. Raises
    ``OperationFailed`` where it cannot be kept."""
    now = occasion.at.astimezone(UTC).isoformat(timespec="seconds")
    sums = {str(file.resolve()): hashlib.sha256(file.read_bytes()).hexdigest() for file in sorted(files)}
    found = DeviceExchange(state_dir / _FOLDER, node, now, now, sums, identity)
    kept = _kept(found)
    if kept.get("files") == sums and kept.get("identity") == identity:
        for name in ("began", "drives", "is_unsaved", "warnings"):
            setattr(found, name, kept[name])
    found.write()
    return found


def _kept(new: DeviceExchange) -> _Facts:
    """Empty where nothing was kept, or only half a file."""
    try:
        content: object = json.loads(new.path.read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    if not isinstance(content, dict) or not content.keys() >= set(_KEPT):
        return {}
    return cast("_Facts", content)


def facts(
    occasion: drop_report.Occasion,
    done: DeviceExchange,
    node: NodeTable,
    old: Mapping[str, int],
    dropped: _Facts,
    audit: list[_Facts],
    *,
    ok: bool,
) -> _Facts:
    """The report as a JSON object."""
    return drop_report.sealed(
        {
            "report": "drivebridge exchange",
            "version": __version__,
            "operator": occasion.operator,
            "host": occasion.host,
            "consent": occasion.consent,
            "began": done.began,
            "time": done.last,
            "site": dropped["site"],
            "node": {
                "name": node.name,
                "id": node.id,
                "bus": dropped["node"]["bus"],
                "mapping": node.mapping,
            },
            "old": dict(old),
            "new": done.identity,
            "files": done.files,
            "drives": done.drives,
            "warnings": done.warnings,
            "drop_test": dropped,
            "audit": audit,
            "ok": ok,
        }
    )


def markdown(report: Mapping[str, Any]) -> str:
    """The same for people, with a place for the signature."""
    return "\n".join(_lines(report)) + "\n"


def _lines(report: Mapping[str, Any]) -> Iterator[str]:
    node, dropped = report["node"], report["drop_test"]
    yield f"# Exchange of {node['name']}: {'done' if report['ok'] else 'NOT done'}"
    yield ""
    yield f"- **When**: begun {report['began']}, ended after {report['time']}"
    yield f"- **Who**: {report['operator']} on {report['host']}; {report['consent']}"
    yield f"- **Node**: {node['name']}, id {node['id']} on {node['bus']}, mapping {node['mapping']}"
    yield f"- **Old device**: {_identity(report['old'])}"
    yield f"- **New device**: {_identity(report['new'])}"
    yield f"- **Site file**: {report['site']['file']}, SHA-256 `{report['site']['sha256']}`"
    for file, sha256 in report["files"].items():
        yield f"- **Backup**: {file}, SHA-256 `{sha256}`"
    yield ""
    for name, drive in report["drives"].items():
        yield f"## {name}: {len(drive['written'])} written, {drive['same']} were the same"
        yield ""
        if drive["written"]:
            yield from ("| parameter | was | is |", "|---|---|---|")
            yield from (
                f"| {one['name']} | {_cell(one['before'])} | {_cell(one['value'])} |"
                for one in drive["written"]
            )
            yield ""
        for what, names in (("does not have", drive["missing"]), ("says is read-only", drive["read_only"])):
            if names:
                yield f"What the drive {what}: {', '.join(names)}"
                yield ""
        yield from (f"Warning: {one}\n" for one in drive["warnings"])
    yield from (f"Warning: {one}\n" for one in report["warnings"])
    yield "## If the bridge falls silent"
    yield ""
    yield from ("| drive | audit | drop test | reaction after |", "|---|---|---|---|")
    tests = {one["drive"]: one for one in dropped["drives"]}
    for one in report["audit"]:
        test = tests.get(one["drive"], {})
        after = "–" if test.get("reacted_ms") is None else f"{test['reacted_ms']:g} ms"
        yield f"| {one['drive']} | {one['verdict']} | {test.get('verdict', 'no result')} | {after} |"
    yield ""
    if dropped["failure"]:
        yield f"No result of the drop test: {dropped['failure']}"
        yield ""
    yield f"SHA-256 of the JSON report without `sha256`: `{report['sha256']}`"
    yield ""
    yield "Signature: ________________________________"


def _identity(numbers: Mapping[str, int]) -> str:
    return ", ".join(f"{name} {number:X}h" for name, number in numbers.items()) or "not told"


def _cell(value: object) -> str:
    return "not read" if value is None else str(value).replace("|", "\\|")
