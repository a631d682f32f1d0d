"""``audit``: what each drive would do if the bridge fell silent."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from bridge.base.errors import Unavailable
from bridge.bustools.own_check import OwnCheck
from bridge.catalogue import Catalogue, MemberSpec, NodeSpec
from bridge.cli.bus_runner import AsJson, BusName, CliBus, carry_out, print_table, tell
from bridge.cli.kinds import words_of
from bridge.cli.terminal import progress
from bridge.drive import OwnJudgement, OwnVerdict
from bridge.lint import WorstCase, lint
from bridge.mapping.own_places import OwnWant, channels_needed, suggested, suggested_ms
from bridge.project import Project, load_project

_COLUMNS = ("drive", "watches", "setting", "reaction", "dead controller", "dead bridge", "verdict")
_WATCHES = {
    "process_data": "process data",
    "heartbeat": "our heartbeat",
    "guarding": "our guarding",
    "link": "its interface",
}


_Answers = tuple[dict[str, OwnJudgement], dict[str, str]]
"""Judgements by drive, and reasons why a node could not be asked by node."""


@dataclass(frozen=True, slots=True)
class Audited:
    """One drive. ``failure``: why its node could not be asked."""

    node: NodeSpec
    one: MemberSpec
    case: WorstCase
    was_read: bool
    failure: str = ""

    @property
    def own(self) -> OwnJudgement:
        return self.case.own

    @property
    def is_ok(self) -> bool:
        stops = self.own.verdict is OwnVerdict.STOPS
        return not self.failure and (stops or bool(self.own.accepted))

    @property
    def verdict(self) -> str:
        if self.failure:
            return "no answer"
        is_accepted = self.own.accepted and self.own.verdict is not OwnVerdict.STOPS
        return f"{self.own.verdict}, accepted" if is_accepted else str(self.own.verdict)


def audit(
    site: Annotated[Path, typer.Argument(metavar="SITE", help="the site file")],
    bus: BusName = None,
    offline: Annotated[
        bool, typer.Option("--offline", help="ask no drive: use site file and factory settings")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Show what drives and outputs would do if the bridge fell silent; exit code 1 where one would run on."""
    project = load_project(site)
    names = [table.name for table in project.site.bus]
    if bus is not None and bus not in names:
        raise typer.BadParameter(f"which bus? One of {', '.join(names)}")
    unavailable: list[str] = []
    found = list(audit_drives(project, bus, unavailable, offline=offline))
    if as_json:
        print(
            json.dumps(
                {"ok": all(one.is_ok for one in found), "drives": [*map(audit_facts, found)]}, indent=2
            )
        )
    else:
        print_table([_COLUMNS, *(row for one in found for row in _rows(one))])
        _explain(found, site)
    if unavailable:
        raise Unavailable("\n".join(unavailable))
    if not all(one.is_ok for one in found):
        raise typer.Exit(1)


def audit_drives(
    project: Project, only: str | None, unavailable: list[str], *, offline: bool = False, of_node: str = ""
) -> Iterator[Audited]:
    """Each drive of the site, or of the bus ``only``, or of one node alone; ``unavailable`` gets a line for
    each bus that cannot be opened."""
    verdict = lint(project.site, project.families, project.path, project.downloads)
    cases = {case.drive: case for case in verdict.worst_cases}
    catalogue = Catalogue.of(project.site, project.families)
    for table in project.site.bus:
        if only not in (None, table.name):
            continue
        nodes = [one for one in catalogue.nodes.values() if one.bus is table and one.table.enabled]
        nodes = [one for one in nodes if of_node in ("", one.name)]
        answers: _Answers | None = None
        if not offline and table.interface == "virtual":
            tell(f"bus {table.name} is virtual: by site file and factory settings alone")
        elif not offline:
            answers = _ask(CliBus(table, project.families, is_of_site=True), nodes, unavailable)
        for node in nodes:
            for drive in node.commanded:
                case = cases.get(drive.name)
                if case is None:  # nobody commands it
                    continue
                if answers is None:
                    yield Audited(node, drive, case, was_read=False)
                    continue
                judgements, failed = answers
                own = judgements.get(drive.name)
                failure = failed.get(node.name, "" if own else "interrupted")
                unknown = OwnJudgement(accepted=case.own.accepted)
                found = replace(case, own=own or unknown)
                yield Audited(node, drive, found, own is not None, failure)


def _ask(line: CliBus, nodes: Sequence[NodeSpec], unavailable: list[str]) -> _Answers:
    try:
        with progress(f"bus {line.table.name}"):
            task = carry_out(line, lambda now: OwnCheck(nodes, now))
    except Unavailable as error:
        unavailable.append(str(error))
        return {}, {node.name: "its bus cannot be opened" for node in nodes}
    return task.found, task.failed


def _rows(one: Audited) -> Iterator[tuple[str, ...]]:
    """A row for each thing that the drive supervises; the first has the verdict."""
    controller = "not known" if one.case.stop.unknown else str(one.case.stop)
    bridge = f"{one.own.bridge_ms} ms" if one.own.bridge_ms else "never"
    ends = (controller, bridge, one.verdict)
    heads = (one.case.drive,)
    if one.failure or not one.own.watches:
        yield (
            *heads,
            "–",
            one.failure or "its mapping says nothing",
            "–",
            controller,
            "not known",
            one.verdict,
        )
        return
    for watch in one.own.watches:
        yield (*heads, _WATCHES[watch.watches], watch.setting, watch.reaction or "–", *ends)
        heads, ends = ("",), ("", "", "")


def _explain(found: list[Audited], site: Path) -> None:
    """The sums, then for each drive why it is an error and what would be right, or why it is accepted."""
    for one in found:
        for terms in one.case.terms:
            print(terms)
        if one.case.stop.unknown:
            print(f"warning: {one.case.drive}: dead controller: {one.case.stop}")
        for watch in one.own.watches:
            if watch.verdict is None and watch.why:
                print(f"warning: {one.case.drive}: {watch.setting}: {watch.why}")
        if one.failure:
            print(f"error: {one.case.drive} could not be asked: {one.failure}")
        elif one.own.verdict is not OwnVerdict.STOPS:
            _tell(one)
    failing = [one for one in found if not one.is_ok and not one.failure]
    for node in dict.fromkeys(one.node.name for one in failing):
        print(f"in {site}, below [[bus.node]] {node}:")
        for line in _remedy([one for one in failing if one.node.name == node]):
            print(f"  {line}")


def _tell(one: Audited) -> None:
    would = f"{'would' if one.own.verdict is OwnVerdict.RUNS_ON else 'may'} {words_of(one.one).runs_on}"
    word, why = ("accepted", one.own.accepted) if one.own.accepted else ("error", one.own.reason)
    print(f"{word}: {one.case.drive} {would} when the bridge falls silent: {why}")


def _remedy(drives: list[Audited]) -> Iterator[str]:
    """Lines of the site file to write for these drives of one node."""
    node = drives[0].node
    names = {one.case.drive for one in drives}
    slots = [drive.slot for drive in node.drives if drive.name in names]
    wants = suggested(node.family, node.bus, node.table)
    of_axes = [
        want
        for drive in node.drives
        for want in suggested(drive.family, node.bus, node.table)
        if drive.name in names and want not in wants
    ]
    if not wants:
        guards = any(entry.watches == "guarding" for entry in node.family.own_supervision)
        yield 'supervision = "guarding"' if guards else "# its mapping needs an [[own_supervision]]"
        return
    channels = channels_needed(node.family, node.table, slots)
    if channels:
        yield f"sdo_channels = {channels}    # to read each drive's own parameters"
    for want in (*wants, *of_axes):
        is_on_first = not want.place.per_drive or node.family.is_per_axis(want.place.ref)
        if not want.only_if or (is_on_first and any(_runs_on_by(one, want) for one in drives)):
            yield from _configure(want)
    time_ms = suggested_ms(node.family, node.bus, node.table)
    yield f"# or, for the same: own_timeout_ms = {time_ms} and enforce = true"


def _runs_on_by(one: Audited, want: OwnWant) -> bool:
    """Whether the drive runs on with this reaction, or the reaction is not known."""
    nothing = {want.place.shown(value) for value in want.only_if}
    shown = [watch.reaction for watch in one.own.watches if watch.reaction.startswith(want.place.name)]
    return any(text in nothing or text.endswith("not known") for text in shown)


def _configure(want: OwnWant) -> Iterator[str]:
    text = f"0x{want.value:X}" if want.place.data_type == "uint32" else str(want.value)
    yield "[[bus.node.configure]]"
    yield f'object = "{want.place.ref}"    # {want.place.name}'
    yield f'type = "{want.place.data_type}"'
    yield f"value = {text}"


def audit_facts(one: Audited) -> dict[str, Any]:
    """JSON object of one drive for ``--json``."""
    own = one.own
    is_stopped = own.verdict is OwnVerdict.STOPS
    wants = [] if is_stopped else suggested(one.one.family, one.node.bus, one.node.table)
    return {
        "drive": one.case.drive,
        "ok": one.is_ok,
        "read": one.was_read,
        "verdict": "no answer" if one.failure else str(own.verdict),
        "reason": one.failure or own.reason,
        "accepted": own.accepted or None,
        **one.case.facts,
        "own_ms": own.own_ms,
        "watches": [
            {
                "name": watch.name,
                "watches": watch.watches,
                "setting": watch.setting,
                "time_ms": watch.time_ms,
                "reaction": watch.reaction,
                "verdict": None if watch.verdict is None else str(watch.verdict),
                "why": watch.why,
            }
            for watch in own.watches
        ],
        "configure": [
            {"object": str(want.place.ref), "type": want.place.data_type, "value": want.value}
            for want in wants
        ],
    }
