"""Every table of the reference agrees with the code."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Any, get_args

import pytest
import typer.main
from asyncua.ua.status_codes import get_name_and_doc

from bridge import __version__
from bridge.catalogue import Catalogue
from bridge.catalogue.codes import CONTROLLER_STATES, NMT_STATES, NODE_STATES, WATCHDOG_STATES
from bridge.cli.app import make_app
from bridge.command import EventKind, Plant
from bridge.command.leg.state import Stage
from bridge.command.leg.table import TABLE
from bridge.command.messages.request import Code
from bridge.config import Reaction, Site
from bridge.drive import DRIVE_STATES
from bridge.image import Point, Quality
from bridge.mapping.model import Family, MappedObject, ObjectRef
from bridge.node.boot.error_status import ABSENT, HINTS
from bridge.northbound.modbus.dispatch import EXCEPTIONS
from bridge.northbound.modbus.pdu import Function
from bridge.northbound.modbus.registers import DriveMap, RegisterTable, Row
from bridge.northbound.modbus.units import drive_maps, units_of
from bridge.northbound.opcua.events.event_types import type_name
from bridge.northbound.opcua.space.data_values import OUTCOME_STATUS, QUALITY_STATUS
from bridge.northbound.opcua.space.nodes import MethodNode, ObjectNode, layout
from bridge.northbound.zenoh.commands import MALFORMED, METHODS, NODE_METHODS
from bridge.project import load_project
from bridge.uaserver.services import SERVICES
from bridge.uaserver.states import REFUSALS, Need, RequestSession
from tests.support.docs import (
    page,
)
from tests.support.model_facts import KeyFacts, model_tables
from tests.support.process import REPOSITORY
from tools import conformance_page, state_table

DEMO_SITE = REPOSITORY / "bridge" / "demo" / "site.toml"


# reference: files


@pytest.mark.parametrize(
    ("name", "model", "leaves"),
    [
        ("reference/site-file.md", Site, ()),
        ("reference/mapping-file.md", Family, (ObjectRef, MappedObject)),
    ],
)
def test_every_key_of_a_file_is_described(name: str, model: Any, leaves: tuple[type, ...]) -> None:
    reference = page(name)
    described: dict[str, dict[str, KeyFacts]] = {}
    for heading in reference.headings:
        headers = [""] if heading == "Top of the file" else re.findall(r"`(\[[^`]+\])`", heading)
        if headers:
            rows = reference.table(heading)
            facts = {row["key"]: KeyFacts(row["type"], row["default"], row["allowed"]) for row in rows}
            described |= dict.fromkeys(headers, facts)
    expected = model_tables(model, leaves)
    assert described.keys() == expected.keys()
    for header, keys in expected.items():
        assert described[header].keys() == keys.keys(), header
        for key, facts in keys.items():
            shown = described[header][key]
            assert (shown.type, shown.default) == (facts.type, facts.default), f"{header} {key}"
            if facts.allowed:
                assert shown.allowed == facts.allowed, f"{header} {key}"


def test_the_reactions_are_explained() -> None:
    explained = page("explanation/dead-man-chain.md").column("Reactions", "on_expiry")
    assert explained == list(get_args(Reaction))


# reference: points


@pytest.fixture(scope="module")
def plant() -> Plant:
    """The demo, with all that fu1 can have."""
    project = load_project(DEMO_SITE)
    drives = project.site.bus[0].node[0].drive
    drives[0] = drives[0].model_copy(update={"life_sign": True})
    return Plant(Catalogue.of(project.site, project.families), __version__)


def general_name(point: Point) -> str:
    name = point.name.replace("conveyor/fu1/", "<node>/<drive>/").replace("conveyor/node/", "<node>/node/")
    return name.replace("bus/can0/", "bus/<bus>/")


def test_every_point_is_described(plant: Plant) -> None:
    reference = page("reference/points.md")
    described = [
        (row["point"], row["type"], row["unit"], row["access"])
        for heading in reference.headings
        if heading.startswith("Points of")
        for row in reference.table(heading)
    ]
    expected = [
        (general_name(point), point.data_type.value, point.unit or "–", "rw" if point.writable else "r")
        for point in plant.image.points
        if re.match(r"(conveyor/(fu1|node)|bus|bridge)/", point.name)
    ]
    assert sorted(described) == sorted(expected)


@pytest.mark.parametrize(
    ("heading", "states"),
    [
        ("Drive states", DRIVE_STATES),
        ("Watchdog states", WATCHDOG_STATES),
        ("NMT states", NMT_STATES),
        ("Node states", NODE_STATES),
        ("CAN controller states", CONTROLLER_STATES),
        ("Quality", tuple((quality.value, quality.label) for quality in Quality)),
    ],
)
def test_states_have_their_numbers(heading: str, states: Iterable[tuple[int, str]]) -> None:
    rows = page("reference/points.md").table(heading)
    assert [(int(row["code"]), row["name"]) for row in rows] == list(states)


def test_the_letters_of_the_boot_status_are_listed() -> None:
    rows = page("reference/points.md").table("Boot status")
    assert "".join(row["letter"] for row in rows) == "ABCDEFGHIJKLMNO"
    assert {*HINTS, *ABSENT} <= {row["letter"] for row in rows}


def test_the_bits_of_the_words_are_listed(plant: Plant) -> None:
    for word, heading in (("command/control_word", "Control word"), ("status/status_word", "Status word")):
        point = plant.image.points[plant.image.index[f"conveyor/fu1/{word}"]]
        rows = page("reference/points.md").table(heading)
        assert [(row["bit"], row["name"]) for row in rows] == [
            (str(number), name or "–") for number, name in enumerate(point.bits)
        ]


# reference: Modbus


def registers(rows: Iterable[Row]) -> list[tuple[str, str, str, str, str]]:
    return [(str(row.address), row.name, row.type, row.access, row.unit or "–") for row in rows]


def test_the_register_map_is_that_of_the_export(plant: Plant) -> None:
    reference = page("reference/modbus.md")
    drive: DriveMap = drive_maps(plant.catalogue)[0]
    for heading, rows in (
        ("Input registers of a drive", [r for r in drive.rows if r.table is RegisterTable.INPUT_REGISTER]),
        (
            "Holding registers of a drive",
            [r for r in drive.rows if r.table is RegisterTable.HOLDING_REGISTER],
        ),
    ):
        shown = [
            (row["address"], row["name"], row["type"], row["access"], row["unit"])
            for row in reference.table(heading)
        ]
        assert shown == registers(rows), heading
    bridge = [row for row in units_of(plant.catalogue).bridge_rows if "/" not in row.name]
    shown = [(row["address"], row["name"], row["unit"]) for row in reference.table("The bridge's own unit")]
    assert shown[:-1] == [(str(row.address), row.name, row.unit or "–") for row in bridge]


def test_the_function_codes_are_those_that_are_served() -> None:
    shown = page("reference/modbus.md").column("Functions", "code")
    assert [int(code.partition("/")[0]) for code in shown] == [function.value for function in Function]


def test_each_outcome_has_its_exception() -> None:
    rows = page("reference/outcomes.md").table("Outcomes")
    assert [row["code"] for row in rows] == [code.value for code in Code]
    for row in rows[1:]:
        code = Code(row["code"])
        assert row["Modbus"] == f"{EXCEPTIONS[code].value:02X}h", code
        assert row["OPC UA"] == status_name(OUTCOME_STATUS[code]), code


# reference: OPC UA


def status_name(code: int) -> str:
    return get_name_and_doc(code)[0]


def test_each_quality_has_its_status() -> None:
    rows = page("reference/points.md").table("Quality")
    assert [row["OPC UA"] for row in rows] == [status_name(QUALITY_STATUS[q].value) for q in Quality]


def test_the_methods_are_those_of_the_address_space(plant: Plant) -> None:
    drives, _, _ = layout(plant.image.points)
    node = next(child for child in drives.objects if child.browse_name == "conveyor")
    drive = next(child for child in node.objects if child.browse_name == "fu1")
    reference = page("reference/opcua.md")
    assert reference.column("Methods of a drive", "method") == [call(method) for method in drive.methods]
    assert reference.column("Methods of a node", "method") == [call(method) for method in node.methods]
    assert reference.column("Address space", "BrowseName") == [
        child.browse_name for child in drive.objects if isinstance(child, ObjectNode)
    ]


def call(method: MethodNode) -> str:
    return f"{method.browse_name}({', '.join(argument.name for argument in method.arguments)})"


def test_the_events_are_those_that_are_sent() -> None:
    rows = page("reference/opcua-alarms.md").table("Events")
    assert [(row["type"], row["kind"]) for row in rows] == [
        (type_name(kind), kind.value) for kind in EventKind
    ]


def test_the_services_are_those_of_the_table_in_the_code() -> None:
    rows = page("reference/opcua.md").table("Services")
    assert [(row["set"], row["service"], row["answer"], row["how"]) for row in rows] == [
        (
            name,
            service.name,
            "done" if service.refused is None else status_name(service.refused),
            service.how.replace("`", ""),
        )
        for name, services in SERVICES.items()
        for service in services
    ]


def test_the_codes_of_sessions_are_those_of_the_table_in_the_code() -> None:
    needs = {
        "CreateSession": Need.CREATE,
        "ActivateSession": Need.ACTIVATE,
        "CloseSession": Need.CLOSE,
        "every other service": Need.USE,
    }
    rows = page("reference/opcua.md").table("Which code when")
    assert [row["session"] for row in rows] == [state.value for state in RequestSession]
    for row, state in zip(rows, RequestSession, strict=True):
        for name, need in needs.items():
            code = REFUSALS[need].get(state)
            is_elsewhere = need is Need.ACTIVATE and state in (
                RequestSession.NONE,
                RequestSession.ENDED,
                RequestSession.MOVED,
            )
            expected = status_name(code) if code else "BadSessionIdInvalid" if is_elsewhere else "done"
            assert row[name].partition(",")[0] == expected, (state, name)


# reference: zenoh


def test_the_commands_are_those_that_are_taken() -> None:
    reference = page("reference/zenoh.md")
    assert reference.column("Commands of a drive", "command") == [action.value for action in METHODS]
    assert reference.column("Commands of a node", "command") == [action.value for action in NODE_METHODS]
    assert reference.column("Further error codes", "code")[0] == MALFORMED


# reference: command line


def leaf_commands(command: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Every command that does something, by what is typed for it. (typer brings its own click.)"""
    if not hasattr(command, "commands"):
        yield path, command
        return
    for name, inner in command.commands.items():
        if not inner.hidden:
            yield from leaf_commands(inner, f"{path} {name}".strip())


def test_every_command_and_option_is_described() -> None:
    reference = page("reference/command-line.md")
    headings = {
        re.sub(r" (\[?SITE|FILE|RECORDING).*", "", heading.strip("`").removeprefix("drivebridge ")): heading
        for heading in reference.headings
        if heading.startswith("`drivebridge ")
    }
    expected = dict(leaf_commands(typer.main.get_command(make_app())))
    assert headings.keys() == expected.keys()
    for name, command in expected.items():
        shown = "\n".join(reference.section(headings[name]))
        takes_site = any(
            parameter.name == "site" or "[SITE]" in (getattr(parameter, "metavar", None) or "")
            for parameter in command.params
        )
        assert ("SITE" in headings[name]) == takes_site, name
        options = {
            option
            for parameter in command.params
            if parameter.param_type_name == "option" and not parameter.hidden
            for option in parameter.opts
            if option.startswith("--")
        }
        assert set(re.findall(r"--[a-z0-9-]+", shown)) == options, name


def test_the_conformance_units_are_those_of_the_code() -> None:
    text = conformance_page.PAGE.read_text(encoding="utf-8")
    assert text == conformance_page.drawn(text), "draw it anew: python -m tools.conformance_page"


# explanation


def test_the_tables_of_the_controller_leg_are_those_of_the_code() -> None:
    text = state_table.PAGE.read_text(encoding="utf-8")
    assert text == state_table.drawn(text), "draw it anew: python -m tools.state_table"
    shown = page("reference/decision-tables.md")
    stages = shown.column("The controller leg", "stage")
    assert [stage.strip("*") for stage in stages] == list(Stage)
    cells = {
        (stage, row["event"].partition(" (on_expiry = ")[0]): cell
        for heading in state_table.PARTS
        for row in shown.table(heading)
        for stage, cell in row.items()
        if stage != "event"
    }
    assert {stage for stage, _ in cells} == set(Stage)
    for (stage, stimulus), (after, deed) in TABLE.items():
        cell = cells.get((stage.value, stimulus.value), "–")
        assert (f"**{after}**" in cell) is (after is not stage), "where it leads to can be read"
        assert deed in cell
    events = shown.column("Neither tripped nor in a start", "event")
    named = [names for event in events for names in re.findall(r" \(on_expiry = ([^)]+)\)$", event)]
    assert sorted(", ".join(named).split(", ")) == sorted(get_args(Reaction)), "each reaction has its event"
