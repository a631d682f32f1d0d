"""What README and docs say is so: every command and snippet runs, every table agrees with the code.

How a page marks its blocks is described in ``tests/support/docs.py``.
"""

from __future__ import annotations

import configparser
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import tomllib
import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, get_args

import pytest
import typer.main
import zenoh
from asyncua.sync import Client as OpcUaClient
from asyncua.ua.status_codes import get_name_and_doc
from pymodbus.client import ModbusTcpClient

from bridge import __version__
from bridge.cli.app import app
from bridge.command import Kind, Plant
from bridge.command.points import CONTROLLER_STATES, NMT_STATES
from bridge.command.request import Code
from bridge.command.watchdog import STATES as WATCHDOG_STATES
from bridge.command.watchdog import TABLE, Effect, Stimulus, WatchdogState
from bridge.config import Reaction, Site, load_site
from bridge.config.model import MappedObject
from bridge.drive import STATES
from bridge.image import Point, Quality
from bridge.mapping.model import Family, ObjectRef
from bridge.mapping.model import MappedObject as MappingObject
from bridge.northbound.modbus.dispatch import EXCEPTIONS
from bridge.northbound.modbus.pdu import Function
from bridge.northbound.modbus.registers import DriveMap, Row, Table, bridge_rows, drive_maps
from bridge.northbound.opcua.events import type_name
from bridge.northbound.opcua.nodes import MethodNode, ObjectNode, layout
from bridge.northbound.opcua.values import OUTCOME_STATUS, QUALITY_STATUS
from bridge.northbound.zenoh.commands import MALFORMED, METHODS, NODE_METHODS
from bridge.service import load_project
from bridge.southbound.boot.status import TEXTS as BOOT_TEXTS
from tests.support.docs import (
    Block,
    Command,
    KeyFacts,
    Page,
    commands,
    model_tables,
    output_pattern,
    squeezed,
)
from tests.support.process import REPOSITORY, Process, drivebridge

DOCS = REPOSITORY / "docs"
DEMO_SITE = REPOSITORY / "bridge" / "demo" / "site.toml"
DEMO_COMMANDS = ("make demo", "drivebridge demo")
DEMO_PORTS = {1502: "Modbus TCP", 4840: "OPC UA", 7447: "zenoh"}
COMMAND_LIMIT_S = 20.0
LANGUAGES = {"console", "python", "toml", "json", "ini", "sh", "text"}

RUN = [Page(path) for path in (REPOSITORY / "README.md", *sorted(DOCS.rglob("*.md")))]
LINKED = [*RUN, *(Page(REPOSITORY / name) for name in ("CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"))]


def page(name: str) -> Page:
    return Page(DOCS / name)


def with_blocks(*languages: str) -> list[Page]:
    return [page for page in RUN if any(block.language in languages for block in page.blocks)]


# the pages themselves


@pytest.mark.parametrize("page", LINKED, ids=repr)
def test_every_link_leads_somewhere(page: Page) -> None:
    for link in page.links:
        path, _, anchor = link.partition("#")
        target = (page.path.parent / path).resolve() if path else page.path
        assert target.exists(), f"{page}: there is no {link}"
        if anchor:
            assert anchor in Page(target).anchors, f"{page}: {link} has no such heading"


def test_every_page_can_be_found_from_the_index() -> None:
    index = page("index.md")
    linked = {(index.path.parent / link.partition("#")[0]).resolve() for link in index.links}
    missing = [str(page) for page in RUN[1:] if page.path not in linked and page.path != index.path]
    assert not missing


@pytest.mark.parametrize("page", RUN, ids=repr)
def test_what_is_not_run_says_why(page: Page) -> None:
    for block in page.blocks:
        assert block.language in LANGUAGES, f"{page}:{block.line}: language {block.language!r}"
        reason = block.note("not run")
        assert reason != "", f"{page}:{block.line}: not run, without a reason"
        if block.language == "sh":
            assert reason or page.is_not_run, f"{page}:{block.line}: commands that run are in console blocks"


# snippets


@pytest.mark.parametrize("page", with_blocks("json", "ini", "toml"), ids=repr)
def test_snippets_are_what_they_say(page: Page, tmp_path: Path) -> None:
    for block in page.blocks:
        where = f"{page}:{block.line}"
        if block.language == "json":
            for line in block.text.splitlines() if block.text.count("\n{") else [block.text]:
                json.loads(line)
        elif block.language == "ini":
            configparser.ConfigParser(strict=False, interpolation=None).read_string(block.text)
        elif block.language == "toml":
            source = block.note("from")
            if source:
                check_quotation(block.text, REPOSITORY / source, where)
            else:
                load_fragment(block.text, tmp_path, where)


def check_quotation(text: str, source: Path, where: str) -> None:
    """Every line stands in ``source``, in this order; ``# …`` leaves lines out."""
    lines = iter(source.read_text(encoding="utf-8").splitlines())
    for line in text.splitlines():
        if line.strip() and line.strip() != "# …":
            assert line in lines, f"{where}: {line!r} is not in {source.name}"


BEFORE = (
    ("[site]", '[site]\nname = "docs"\n'),
    ("[[bus]]", '[[bus]]\nname = "can0"\ninterface = "socketcan"\nchannel = "can0"\n'),
    ("[[bus.node]]", '[[bus.node]]\nname = "conveyor"\nid = 5\nmapping = "nord/sk-tu4-cao"\n'),
    ("[[bus.node.drive]]", '[[bus.node.drive]]\nslot = "fu4"\n'),
)


def load_fragment(text: str, folder: Path, where: str) -> Site:
    """A site file, or a part of one, is one that drivebridge takes."""
    tomllib.loads(text)
    whole = text
    if "[site]" not in text:
        known = [position for position, (header, _) in enumerate(BEFORE) if header in text]
        before = BEFORE[: known[0]] if known else BEFORE
        after = BEFORE[known[-1] + 1 :] if known else ()
        whole = "\n".join([part for _, part in before] + [text] + [part for _, part in after])
        for control in set(re.findall(r'^control = "(modbus|opcua|zenoh)"', text, re.MULTILINE)):
            whole += "" if f"[{control}]" in text else f"\n[{control}]\n"
    path = folder / f"{where.replace('/', '-')}.toml"
    path.write_text(whole, encoding="utf-8")
    return load_site(path)


# commands and scripts


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Process]:
    for port, name in DEMO_PORTS.items():
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                pytest.fail(f"port {port} ({name}) is taken: end the demo or bridge that runs here")
    with drivebridge(tmp_path_factory.mktemp("demo"), "demo", "demo", notify=True) as process:
        process.wait_ready()
        process.wait_output("node operational")
        process.wait_output("OPC UA on")
        yield process


@pytest.fixture
def calm(demo: Process) -> None:
    """The demo's drives as they are at its start: no fault, no owner, switch-on inhibited."""
    with ModbusTcpClient("127.0.0.1", port=1502) as modbus:
        for address, word in ((11, 1), (0, 0x0400), (10, 0)):
            modbus.write_register(address, word, device_id=1)
    with OpcUaClient("opc.tcp://127.0.0.1:4840") as client:
        namespace = client.get_namespace_index("urn:drivebridge:points")
        fu2 = client.get_node(f"ns={namespace};s=conveyor/fu2")
        for method in ("ResetFault", "DisableVoltage", "ReleaseControl"):
            fu2.call_method(f"{namespace}:{method}")
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", '["tcp/127.0.0.1:7447"]')
    with zenoh.open(config) as session:
        for leaf in ("reset_fault", "disable_voltage", "release_control"):
            list(session.get(f"drives/demo/conveyor/fu3/command/{leaf}", payload="{}"))
    time.sleep(0.3)  # the acknowledge edge is on the bus that long, and the drives answer


@pytest.fixture
def reader(tmp_path: Path) -> Iterator[Reader]:
    reader = Reader(tmp_path)
    yield reader
    reader.end()


class Reader:
    """Somebody who sits in the repository with .venv activated and does what a page says."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in ("bridge", "deploy", "mappings"):
            (folder / name).symlink_to(REPOSITORY / name)
        (folder / ".venv").symlink_to(sys.prefix)
        self._environment = {
            **os.environ,
            "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
            "PYTHONUNBUFFERED": "1",
            "PYTHONWARNINGS": "ignore",
            "COLUMNS": "100",
        }
        self._up: list[subprocess.Popen[str]] = []
        self.skipped: list[str] = []

    def work_through(self, page: Page, demo: Process) -> None:
        for block in page.blocks:
            where = f"{page}:{block.line}"
            if block.file_name:
                (self.folder / block.file_name).write_text(block.text, encoding="utf-8")
            if block.note("Ctrl-C") is not None:
                self._end_last()
            if block.note("not run") is not None or (page.is_not_run and block.language == "console"):
                self._check_demo(block, demo)
            elif block.language == "python" and not block.file_name:
                self._run(Command(block.line, f"python - <<'END'\n{block.text}END", ""), where)
            elif block.language == "console":
                for command in commands(block):
                    self._do(command, f"{page}:{command.line}", stays_up=block.note("stays up") is not None)

    def _check_demo(self, block: Block, demo: Process) -> None:
        """`make demo` is not started a second time, but what it prints is compared."""
        if block.language == "console":
            for command in commands(block):
                if command.text in DEMO_COMMANDS:
                    compare(command, demo.output(), f"line {command.line}")

    def _do(self, command: Command, where: str, *, stays_up: bool) -> None:
        if "mbpoll" in command.text and not shutil.which("mbpoll"):
            self.skipped.append(where)
        elif stays_up:
            self._start(command, where)
        else:
            self._run(command, where)

    def _run(self, command: Command, where: str) -> None:
        done = subprocess.run(
            ["bash", "-c", command.text],
            cwd=self.folder,
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=COMMAND_LIMIT_S,
            check=False,
        )
        if done.returncode:
            pytest.fail(f"{where}: {command.text}\n{done.stdout}", pytrace=False)
        if command.expected:
            compare(command, done.stdout, where)

    def _start(self, command: Command, where: str) -> None:
        """A command that stays up: until it has said all that the page shows."""
        log = self.folder / f"{len(self._up)}.log"
        with log.open("w", encoding="utf-8") as output:
            process = subprocess.Popen(
                ["bash", "-c", command.text],
                cwd=self.folder,
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                text=True,
                start_new_session=True,  # so that Ctrl-C reaches what the shell has started
            )
        self._up.append(process)
        pattern = output_pattern(command.expected)
        end = time.monotonic() + COMMAND_LIMIT_S
        while not pattern.match(squeezed(log.read_text(encoding="utf-8"))):
            if time.monotonic() > end or process.poll() is not None:
                said = log.read_text(encoding="utf-8")
                pytest.fail(
                    f"{where}: {command.text}\nexpected:\n{command.expected}\nsaid:\n{said}", pytrace=False
                )
            time.sleep(0.05)

    def _end_last(self) -> None:
        if not self._up:  # it was skipped
            return
        process = self._up.pop()
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGINT)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()

    def end(self) -> None:
        while self._up:
            self._end_last()


def compare(command: Command, output: str, where: str) -> None:
    expected, is_there = command.expected, re.Pattern.fullmatch
    if command.text in DEMO_COMMANDS:
        expected, is_there = f"…\n{expected}", re.Pattern.match
    if not is_there(output_pattern(expected), squeezed(output)):
        pytest.fail(f"{where}: {command.text}\nexpected:\n{command.expected}\nwas:\n{output}", pytrace=False)


@pytest.mark.parametrize("page", with_blocks("console", "python"), ids=repr)
def test_what_a_page_does_can_be_done(page: Page, demo: Process, calm: None, reader: Reader) -> None:
    reader.work_through(page, demo)
    if reader.skipped:
        warnings.warn(f"mbpoll is missing; not run: {', '.join(reader.skipped)}", stacklevel=1)


# reference: files


@pytest.mark.parametrize(
    ("name", "model", "leaves"),
    [
        ("reference/site-file.md", Site, (MappedObject,)),
        ("reference/mapping-file.md", Family, (ObjectRef, MappingObject)),
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
    project = load_project(DEMO_SITE)
    return Plant(project.site, project.families, __version__)


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
        if not re.match(r"conveyor/fu[2-9]/", point.name)
    ]
    assert sorted(described) == sorted(expected)


@pytest.mark.parametrize(
    ("heading", "states"),
    [
        ("Drive states", STATES),
        ("Watchdog states", WATCHDOG_STATES),
        ("NMT states", NMT_STATES),
        ("CAN controller states", CONTROLLER_STATES),
        ("Quality", tuple((quality.value, quality.label) for quality in Quality)),
    ],
)
def test_states_have_their_numbers(heading: str, states: Iterable[tuple[int, str]]) -> None:
    rows = page("reference/points.md").table(heading)
    assert [(int(row["code"]), row["name"]) for row in rows] == list(states)


def test_the_letters_of_the_boot_status_are_listed() -> None:
    rows = page("reference/points.md").table("Boot status")
    assert {row["letter"]: row["meaning"] for row in rows} == BOOT_TEXTS


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
    drive: DriveMap = drive_maps(plant)[0]
    for heading, rows in (
        ("Input registers of a drive", [r for r in drive.rows if r.table is Table.INPUT_REGISTER]),
        ("Holding registers of a drive", [r for r in drive.rows if r.table is Table.HOLDING_REGISTER]),
    ):
        shown = [
            (row["address"], row["name"], row["type"], row["access"], row["unit"])
            for row in reference.table(heading)
        ]
        assert shown == registers(rows), heading
    bridge = [row for row in bridge_rows(plant) if "/" not in row.name]
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
    (node,) = drives.objects
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
    rows = page("reference/opcua.md").table("Events")
    assert [(row["type"], row["kind"]) for row in rows] == [(type_name(kind), kind.value) for kind in Kind]


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
        re.sub(r" (\[?SITE|FILE).*", "", heading.strip("`").removeprefix("drivebridge ")): heading
        for heading in reference.headings
        if heading.startswith("`drivebridge ")
    }
    expected = dict(leaf_commands(typer.main.get_command(app)))
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
        assert set(re.findall(r"--[a-z-]+", shown)) == options, name


# explanation


def test_the_state_table_is_that_of_the_watchdog() -> None:
    shown = page("explanation/dead-man-chain.md").table("The controller leg as a table")
    assert shown == watchdog_table()


def watchdog_table() -> list[dict[str, str]]:
    return [
        {"event": stimulus.value} | {state.label: cell(state, stimulus) for state in WatchdogState}
        for stimulus in Stimulus
    ]


def cell(state: WatchdogState, stimulus: Stimulus) -> str:
    after, effect = TABLE[state, stimulus]
    what = "–" if effect is Effect.NOTHING else effect.value
    return what if after is state else f"→ **{after.label}**: {what}"
