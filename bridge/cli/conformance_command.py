"""``conformance``: what CiA 301 asks of a slave, tried on a real node that stands still."""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from bridge import __version__
from bridge.base.errors import OperationFailed
from bridge.bustools.conformance import Conformance, Slave, Verdict
from bridge.bustools.conformance_checks import checks, lengths, put_back
from bridge.bustools.lss_task import LssTask, inquire
from bridge.canopen.lss import LssAddress, LssError
from bridge.cli import drop_report, drop_test_command
from bridge.cli.bus_runner import AsJson, CliBus, carry_out, print_table, tell
from bridge.cli.parameter_drive import SiteArgument, Target, Yes, find
from bridge.cli.terminal import progress
from bridge.parameter import backups
from bridge.parameter.backup_file import IDENTITY
from bridge.project import load_project

_LSS_S = 0.2
_FOLDER = "conformance"
_WHAT = (
    "is started and stopped for a moment, SYNC is sent, and it gets a heartbeat, which is taken back. It is "
    "pre-operational afterwards. No drive of it is enabled"
)


def conformance(
    site: SiteArgument,
    node: Annotated[str, typer.Argument(metavar="NODE", help="the node's name in the site file")],
    reset: Annotated[
        bool, typer.Option("--reset", help="also reset its communication: what it has not saved is lost")
    ] = False,
    report: Annotated[
        Path | None, typer.Option(help="folder of the report; conformance in the site's state_dir")
    ] = None,
    yes: Yes = False,
    as_json: AsJson = False,
) -> None:
    """Try on NODE, which must stand still, what CiA 301 asks of a slave, and write a report."""
    project = load_project(site)
    bus, table = drop_test_command.find_node(project, node)
    family = project.families[table.mapping_key]
    names = [f"{node}/{family.leaf_of(drive)}" for drive in table.drive] or [node]
    targets = [find(site, name) for name in names]
    drop_test_command.refuse_company(project, bus, table)
    for target in targets:
        check = target.alone(whole=True).check
        target.run(lambda now, check=check: check(()))
    if not yes and sys.stdin.isatty() and not typer.confirm(f"{node} {_WHAT}. Go on?", err=True):
        raise OperationFailed("nothing was done")
    identity: dict[str, int] = {}
    targets[0].run(lambda now: backups.identify(identity))
    slave = Slave(table.id, table.sdo_timeout_ms / 1000)
    line = CliBus(bus, project.families, is_of_site=True)
    try:
        _try_out(line, node, slave, reset=reset)
    finally:
        if slave.heartbeat_ms is not None or slave.is_displaced:
            carry_out(line, lambda now: Conformance(slave, (), put_back(slave), now))
    _ask_by_lss(targets[0], identity, slave)
    facts = _facts(node, slave, identity, targets[0])
    folder = report or Path(project.site.site.state_dir) / _FOLDER
    try:
        files = drop_report.write(facts, "\n".join(_markdown(facts)) + "\n", folder)
    except OSError as error:
        print(json.dumps(facts, indent=2))
        raise OperationFailed(f"the report cannot be written to {folder}: {error.strerror}") from None
    if as_json:
        print(json.dumps(facts | {"files": [str(file) for file in files]}, indent=2))
    else:
        rows = [(one["verdict"], one["clause"], one["rule"], one["seen"]) for one in facts["checks"]]
        print_table([("verdict", "CiA 301", "rule", "seen"), *rows])
        print(f"{node}: {_summary(facts)}")
        tell(f"report: {files[0]}, {files[1]}")
    if not facts["ok"]:
        raise typer.Exit(OperationFailed.exit_code)


def _try_out(line: CliBus, node: str, slave: Slave, *, reset: bool) -> None:
    with progress(node) as show:
        task = carry_out(
            line,
            lambda now: Conformance(slave, checks(slave, reset=reset), put_back(slave), now),
            lambda one: show(one.done, one.total, f"{len(slave.findings)} rules"),
        )
    if task.done < task.total:
        raise OperationFailed("interrupted; what was changed is put back")
    lengths(slave, task.heard)


def _ask_by_lss(target: Target, identity: Mapping[str, int], slave: Slave) -> None:
    """The one node with this identity, by LSS: it has the same identity and node id."""
    clause, rule = "CiA 305 §6.7", "LSS tells the same identity and node id"
    if set(identity) != set(IDENTITY):
        slave.skipped(clause, rule, "1018h is not whole, and LSS cannot single it out", Verdict.NOT_SEEN)
        return
    address = LssAddress(*(identity[name] for name in IDENTITY))
    task = carry_out(target.line, lambda now: LssTask(inquire(address), now, _LSS_S))
    try:
        told, node_id = task.result
    except LssError as error:
        slave.skipped(clause, rule, str(error))
        return
    slave.found(clause, rule, (told, node_id) == (address, slave.id), f"node id {node_id}")


def _facts(node: str, slave: Slave, identity: Mapping[str, int], target: Target) -> dict[str, Any]:
    found = slave.findings
    return drop_report.sealed(
        {
            "report": "drivebridge conformance",
            "version": __version__,
            "time": datetime.now(UTC).isoformat(timespec="seconds"),
            "node": {"name": node, "id": slave.id, "mapping": target.node.mapping, **identity},
            "slowest_sdo_ms": round(slave.slowest_ms, 1),
            "ok": not any(one.verdict is Verdict.FAILED for one in found),
            "checks": [asdict(one) for one in found],
        }
    )


def _summary(facts: Mapping[str, Any]) -> str:
    counts = Counter(one["verdict"] for one in facts["checks"])
    told = ", ".join(f"{counts[verdict]} {verdict}" for verdict in Verdict if counts[verdict])
    return f"{told}; the slowest SDO answer took {facts['slowest_sdo_ms']:g} ms"


def _markdown(facts: Mapping[str, Any]) -> Iterator[str]:
    node = facts["node"]
    yield f"# Conformance of {node['name']} to CiA 301: {'no fault found' if facts['ok'] else 'faults found'}"
    yield ""
    yield f"- **When**: {facts['time']}, by drivebridge {facts['version']}"
    yield f"- **Node**: {node['name']}, id {node['id']}, mapping {node['mapping']}"
    yield "- **Device**: " + ", ".join(f"{name} {node[name]:X}h" for name in IDENTITY if name in node)
    yield f"- **Result**: {_summary(facts)}"
    yield ""
    yield from ("| verdict | clause | rule | seen |", "|---|---|---|---|")
    for one in facts["checks"]:
        yield f"| {one['verdict']} | {one['clause']} | {one['rule']} | {one['seen'].replace('|', '/')} |"
    yield ""
    yield f"SHA-256 of the JSON report without `sha256`: `{facts['sha256']}`"
