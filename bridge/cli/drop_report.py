"""The report of a drop test: what was read, what was measured, who signs it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bridge import __version__
from bridge.bustools.drop_test import DropOutcome, DropTest
from bridge.command.node import Node


@dataclass(frozen=True, slots=True)
class Occasion:
    """Operator, time and place of a test. ``consent`` is how the operator agreed."""

    operator: str
    host: str
    consent: str
    at: datetime
    site: Path


def facts(occasion: Occasion, node: Node, test: DropTest) -> dict[str, Any]:
    """The report as a JSON object."""
    first = node.members[0].identification
    report: dict[str, Any] = {
        "report": "drivebridge drop-test",
        "version": __version__,
        "operator": occasion.operator,
        "host": occasion.host,
        "consent": occasion.consent,
        "time": occasion.at.astimezone(UTC).isoformat(timespec="seconds"),
        "site": {
            "file": str(occasion.site.resolve()),
            "sha256": hashlib.sha256(occasion.site.read_bytes()).hexdigest(),
        },
        "node": {
            "name": node.name,
            "id": node.table.id,
            "bus": node.bus.name,
            "mapping": node.table.mapping,
            "vendor": first.vendor,
            "product": first.product,
            "revision": first.revision,
            "serial": first.serial,
            "device_name": first.device_name,
            "boot_status": test.notes,
            "has_drives": bool(node.drives),
        },
        "deadman_ms": node.bus.deadman_ms,
        "silent_ms": round(1000 * test.silent_s),
        "rpdos_alone": test.rpdos_alone,
        "ok": bool(test.outcomes) and all(one.is_proven for one in test.outcomes),
        "failure": test.failure or None,
        "drives": [_drive(one) for one in test.outcomes],
    }
    return sealed(report)


def sealed(report: dict[str, Any]) -> dict[str, Any]:
    """The report with its ``sha256``: that of the object without it, keys sorted, no spaces."""
    canonical = json.dumps(report, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return report | {"sha256": hashlib.sha256(canonical.encode()).hexdigest()}


def _drive(one: DropOutcome) -> dict[str, Any]:
    return {
        "drive": one.drive,
        "settings": [
            {
                "watches": watch.watches,
                "setting": watch.setting,
                "time_ms": watch.time_ms,
                "reaction": watch.reaction,
            }
            for watch in one.own.watches
        ],
        "own_ms": one.own_ms,
        "own": one.own_text,
        "bound_ms": one.bound_ms,
        "worst_case_bridge_ms": one.own.bridge_ms,
        "reacted_ms": one.reacted_ms,
        "noticed_ms": one.noticed_ms,
        "seen": [{"after_ms": after_ms, "what": what} for after_ms, what in one.seen],
        "state_before": one.state_before.label,
        "state_after": one.state_after.label,
        "fault_after": one.fault_after,
        "verdict": str(one.proof),
        "ok": one.is_proven,
    }


def markdown(report: dict[str, Any]) -> str:
    """The same for people, with a place for the signature."""
    return "\n".join(_lines(report)) + "\n"


def _lines(report: dict[str, Any]) -> Iterator[str]:
    node, site = report["node"], report["site"]
    yield f"# Drop test of {node['name']}: {'passed' if report['ok'] else 'NOT passed'}"
    yield ""
    yield f"- **When**: {report['time']}"
    yield f"- **Who**: {report['operator']} on {report['host']}; {report['consent']}"
    yield f"- **Node**: {node['name']}, id {node['id']} on {node['bus']}, mapping {node['mapping']}"
    identity = ", ".join(f"{name} {node[name]:X}h" for name in ("vendor", "product", "revision", "serial"))
    yield f"- **Device**: {node['device_name'] or '–'} ({identity})"
    yield f"- **Boot-up**: {node['boot_status'] or '–'}"
    yield f"- **Site file**: {site['file']}, SHA-256 `{site['sha256']}`"
    yield f"- **drivebridge**: {report['version']}; deadman_ms {report['deadman_ms']}"
    without = "SYNC, RPDO, heartbeat, guarding and SDO"
    if report["rpdos_alone"]:
        without = "RPDOs, as the site file stops drives by silence; all else went on"
    yield f"- **Silence**: {report['silent_ms']} ms without {without}"
    yield ""
    if report["failure"]:
        yield f"No result: {report['failure']}"
        yield ""
    for drive in report["drives"]:
        yield from _drive_lines(drive)
    if report["node"]["has_drives"]:
        yield "The drives stood still, disabled, before, during and after the test: it shows that they "
        yield "notice a silent bridge and how they react, not how far a moving machine runs on."
    else:
        yield "The outputs had their safe values before, during and after the test: it shows that the node "
        yield "notices a silent bridge and leaves Operational. What becomes of each output then was read "
        yield "from it: see the boot-up."
    yield ""
    yield f"SHA-256 of the JSON report without `sha256`: `{report['sha256']}`"
    yield ""
    yield "Signature: ________________________________"


def _drive_lines(drive: dict[str, Any]) -> Iterator[str]:
    yield f"## {drive['drive']}: {drive['verdict']}"
    yield ""
    yield "| what | value |"
    yield "|---|---|"
    for setting in drive["settings"]:
        reaction = f", {setting['reaction']}" if setting["reaction"] else ""
        yield f"| setting read | {setting['setting']}{reaction} |"
    yield f"| own time-out | {drive['own']} |"
    yield f"| bound from the last frame | {_ms(drive['bound_ms'] or None)} |"
    yield f"| reaction after the last frame | {_ms(drive['reacted_ms'])} |"
    yield f"| node left Operational after | {_ms(drive['noticed_ms'])} |"
    yield f"| worst case of a dead bridge | {_ms(drive['worst_case_bridge_ms'] or None)} |"
    yield f"| state before, after | {drive['state_before']}, {drive['state_after']} |"
    yield f"| fault afterwards | {drive['fault_after'] or '–'} |"
    for seen in drive["seen"]:
        yield f"| seen after {seen['after_ms']:g} ms | {seen['what']} |"
    yield ""


def _ms(value: float | None) -> str:
    return "–" if value is None else f"{value:g} ms"


def write(report: dict[str, Any], text: str, folder: Path) -> tuple[Path, Path]:
    """The report as JSON, and ``text`` for people, in ``folder``; raises OSError where they cannot be
    written."""
    folder.mkdir(parents=True, exist_ok=True)
    stamp = report["time"].replace(":", "").replace("+0000", "Z").replace("-", "")
    base = folder / f"{report['node']['name']}-{stamp}"
    as_json, as_text = base.with_suffix(".json"), base.with_suffix(".md")
    as_json.write_text(json.dumps(report, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    as_text.write_text(text, encoding="utf-8")
    return as_json, as_text
