"""What ``drivebridge export`` says of access is what the running bridge does, and what the reference says of
registers after a stop is what is read."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pytest

from bridge.catalogue import Catalogue, rights_of
from bridge.cli.audit_command import audit_drives
from bridge.command import (
    Action,
    Code,
    Identity,
    Outcome,
    Plant,
    Request,
    Role,
    SetTimeout,
    Source,
    TakeControl,
    Write,
    WriteParameter,
)
from bridge.command.channel import Channel
from bridge.command.commanded import Commanded
from bridge.command.leg.state import Timer
from bridge.config import load_site
from bridge.exports import dbc_file, modbus_table, opcua_table, zenoh_table
from bridge.image import Image, Point, Quality
from bridge.lint import lint
from bridge.mapping import family_names
from bridge.northbound.modbus.registers import STOP, RegisterTable, Row
from bridge.northbound.modbus.units import drive_maps, units_of
from bridge.project import load_project
from tests.support import sites
from tests.support.bench import Bench
from tests.support.process import REPOSITORY
from tests.support.rig import ENABLE, SHUT_DOWN
from tests.support.views import dispatcher_of

NOT_ALLOWED: Final = (0x01, 0x02, 0x0A)
"""Exceptions that say that this is never written here, by this client."""
FU1, FU2 = "conveyor/fu1", "conveyor/fu2"
ENGINEER: Final = f"""
[[opcua.user]]
name = "eve"
role = "engineer"
password_hash = "{"x" * 20}"
"""


@dataclass(frozen=True)
class Kind:
    """A site. ``name`` is for the test's id."""

    name: str
    control: str = "modbus"
    drive: str = ""
    node: str = ""
    modbus: str = ""
    zenoh: str = ""
    opcua: str = ""

    def bench(self, folder: Path) -> Bench:
        more = f"{sites.SCALED}\nfieldbus_timeout_range_ms = [0, 32767]\n{self.drive}"
        drives = [sites.drive(slot, self.control, 0, more) for slot in ("fu1", "fu2")]
        servers = (sites.modbus() + self.modbus, sites.opcua() + self.opcua, sites.zenoh() + self.zenoh)
        node = sites.node(*drives, more=f'supervision = "none"\n{self.node}')
        slow = "sync_period_ms = 0\nheartbeat_ms = 0\nrpdo_period_ms = 1000\ndeadman_ms = 10000"
        bench = Bench(load_site(sites.write(folder, sites.bus(node, more=slow), *servers)))
        bench.run(2.0)
        return bench


KINDS: Final = (
    Kind("modbus"),
    Kind("its time-out, too", drive="fieldbus_timeout_writable = true"),
    Kind("stops are the owner's", drive="stop_by_anyone = false"),
    Kind("parameters are read", modbus='parameters = "read"\n', zenoh='parameters = "read"\n'),
    Kind("both drives are reached", node="sdo_channels = [2]"),
    Kind("opcua", control="opcua", drive="fieldbus_timeout_writable = true"),
    Kind("zenoh", control="zenoh"),
    Kind("lease", control="lease", drive="fieldbus_timeout_writable = true"),
    Kind("none", control="none"),
    Kind("none, nor stops", control="none", drive="stop_by_anyone = false"),
    Kind("an engineer", control="opcua", opcua=ENGINEER),
)
kinds = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)


class Client:
    """A Modbus client, as the server would make it."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._dispatcher = dispatcher_of(bench.plant, lambda: bench.now, view=bench.view)
        assert bench.plant.site.modbus is not None
        sets = bench.plant.site.modbus.parameters == "write"
        self._who = Identity(Source.MODBUS, "10.0.0.5", address="10.0.0.5:4000", sets_parameters=sets)

    def ask(self, unit: int, pdu: bytes) -> bytes:
        answers: list[bytes] = []
        self._dispatcher.handle(unit, pdu, self._who, answers.append)
        self._bench.run(0.0 if answers else 1.0)
        (answer,) = answers
        return answer

    def read(self, unit: int, function: int, start: int, count: int) -> list[int]:
        answer = self.ask(unit, struct.pack(">BHH", function, start, count))
        return [] if answer[0] & 0x80 else list(struct.unpack(f">{count}H", answer[2:]))

    def write(self, unit: int, start: int, *words: int) -> int:
        count = len(words)
        answer = self.ask(unit, struct.pack(f">BHHB{count}H", 16, start, count, 2 * count, *words))
        return answer[1] if answer[0] & 0x80 else 0

    def write_row(self, unit: int, row: Row) -> int:
        """0 or the exception; what is written is what is there, or something harmless."""
        if row.table is RegisterTable.COIL:
            answer = self.ask(unit, struct.pack(">BHH", 5, row.address, 0))
            return answer[1] if answer[0] & 0x80 else 0
        if row.address == STOP:
            return self.write(unit, STOP, 1)
        words = self.read(unit, 3, row.address, row.size) or [0] * row.size
        return self.write(unit, row.address, *words)


@pytest.mark.landing(11)
@kinds
def test_a_register_is_exported_as_writable_where_it_can_be_written(tmp_path: Path, kind: Kind) -> None:
    bench = kind.bench(tmp_path)
    client = Client(bench)
    for drive_map in drive_maps(bench.plant.catalogue):
        image, name = bench.plant.image, drive_map.drive_name
        unserved = {
            point.name.removeprefix(f"{name}/")
            for point in image.points
            if point.name.startswith(f"{name}/command/")
            and image.read(point.name).quality in (Quality.CONFIG_ERROR, Quality.DISABLED)
        }
        for row in drive_map.rows:
            if row.name in unserved:
                continue  # of what its words carry the site file says nothing
            if row.table in (RegisterTable.HOLDING_REGISTER, RegisterTable.COIL):
                code = client.write_row(drive_map.unit_id, row)
                is_writable = code not in NOT_ALLOWED
                assert (row.access == "rw") == is_writable, f"{drive_map.drive_name} {row}: {code:02X}h"
            else:
                assert row.access == "r"


class Asker:
    """A client of a protocol, with the most that one of this site may have."""

    def __init__(self, bench: Bench, source: Source) -> None:
        self._bench = bench
        site = bench.plant.site
        is_engineer = source is Source.OPCUA and site.opcua is not None and bool(site.opcua.user)
        tables = {Source.MODBUS: site.modbus, Source.ZENOH: site.zenoh}
        table = tables.get(source)
        sets = table is not None and table.parameters == "write"
        role = Role.ENGINEER if is_engineer else Role.OPERATOR
        self._who = Identity(source, "somebody", role, sets_parameters=sets)
        if source is not Source.MODBUS:
            for drive in bench.plant.drives:
                self.ask(Request(self._who, drive, TakeControl(ttl_ms=600_000)))

    def ask(self, request: Request) -> Outcome:
        outcomes: list[Outcome] = []
        self._bench.view.submit(request, outcomes.append)
        self._bench.run(0.0 if outcomes else 1.0)
        (outcome,) = outcomes
        return outcome

    def write(self, point: Point) -> Outcome:
        owner, _, leaf = point.name.rpartition("/")
        drive, _, group = owner.rpartition("/")
        value = self._bench.plant.image.read(point.name).value
        if group == "parameter":
            request = Request(self._who, drive, WriteParameter(parameter=leaf, value=value))
        elif group == "supervision":
            request = Request(self._who, drive, SetTimeout(timeout_ms=int(value)))
        else:
            request = Request(self._who, drive, Write({leaf: value}))
        return self.ask(request)


NEVER: Final = (Code.NOT_ALLOWED, Code.NOT_CONFIGURED, Code.READ_ONLY)


@pytest.mark.landing(8)
@kinds
@pytest.mark.parametrize("source", [Source.OPCUA, Source.ZENOH])
def test_a_point_is_exported_as_writable_where_it_can_be_written(
    tmp_path: Path, kind: Kind, source: Source
) -> None:
    bench = kind.bench(tmp_path)
    plant = bench.plant
    asker, rights = Asker(bench, source), rights_of(plant.catalogue, source)
    for point in plant.image.points:
        if point.writable:
            outcome = asker.write(point)
            if outcome.code is Code.NOT_CONFIGURED and "/command/" in point.name:
                continue  # as above
            assert rights.may_write(plant.catalogue, point) == (outcome.code not in NEVER), (
                f"{point.name}: {outcome}"
            )


@pytest.mark.parametrize("mapping", family_names())
def test_every_row_says_what_it_is(mapping: str) -> None:
    family = sites.family(mapping)
    text = sites.site(
        sites.bus(sites.node(sites.drive(family.slot[0].name, "modbus", 0, ""), mapping=mapping))
    )
    plant: Plant = sites.plant_of(text, mapping)
    rows = list(
        itertools.chain(
            units_of(plant.catalogue).bridge_rows, *(one.rows for one in drive_maps(plant.catalogue))
        )
    )
    assert [row.name for row in rows if not row.description] == []
    assert [point.name for point in plant.image.points if not point.description] == []
    bits = [row for row in rows if row.type == "bool"]
    assert len(bits) == 16 + 8 + 16


# the reference: holding registers after a stop


def command(bench: Bench, client: Client) -> None:
    """fu1 is enabled and follows a setpoint."""
    client.write(1, 0, SHUT_DOWN, 0)
    bench.run(0.2)
    client.write(1, 0, ENABLE, 0x2000)
    bench.run(0.2)
    assert client.read(1, 3, 0, 2) == [ENABLE, 0x2000]


def by_register(bench: Bench, client: Client) -> None:
    assert client.write(1, STOP, 1) == 0


def by_quick_stop(bench: Bench, client: Client) -> None:
    assert client.write(1, STOP, 2) == 0


def by_disable_voltage(bench: Bench, client: Client) -> None:
    assert client.write(1, STOP, 3) == 0


def by_somebody_else(bench: Bench, client: Client) -> None:
    assert bench.ask(Action.STOP, FU1, Identity(Source.OPCUA, "ann")).ok


def by_release(bench: Bench, client: Client) -> None:
    assert client.write(1, 10, 0) == 0


def by_a_restart(bench: Bench, client: Client) -> None:
    bench.node.start(bench.now)
    bench.run(2.0)


STOPS: Final = (by_register, by_quick_stop, by_disable_voltage, by_somebody_else, by_release, by_a_restart)


@pytest.mark.landing(6)
@pytest.mark.parametrize("stop", STOPS)
def test_after_a_stop_the_holding_registers_have_the_stop(
    tmp_path: Path, stop: Callable[[Bench, Client], None]
) -> None:
    bench = KINDS[0].bench(tmp_path)
    client = Client(bench)
    command(bench, client)
    stop(bench, client)
    words = bench.plant.drives[FU1].channel.words
    word, *setpoints = client.read(1, 3, 0, 5)
    assert not words.enables(word)
    assert word == bench.value(f"{FU1}/command/control_word")
    assert setpoints == [0] * 4
    assert client.read(1, 3, 32, 2) == [0, 0]


def test_after_a_trip_the_control_word_is_still_the_owners_and_the_setpoints_are_gone(tmp_path: Path) -> None:
    bench = Kind("short").bench(tmp_path)
    client = Client(bench)
    command(bench, client)
    client.write(1, 0, ENABLE, 0x2000)
    channel = bench.plant.drives[FU1].channel
    heard_at = channel.leg.timer.heard_at
    assert heard_at is not None
    channel.leg = channel.leg._replace(timer=Timer(100, heard_at, heard_at + 0.1))
    bench.run(0.5)
    assert bench.value(f"{FU1}/supervision/trips") == 1
    assert client.read(1, 3, 0, 2) == [ENABLE, 0]
    assert client.read(1, 4, 9, 1) != client.read(1, 4, 0, 1)


def test_input_register_9_differs_while_the_bridge_has_tripped_and_only_then(tmp_path: Path) -> None:
    bench = Kind("short").bench(tmp_path)
    client = Client(bench)
    command(bench, client)
    assert client.read(1, 4, 9, 1) == client.read(1, 4, 0, 1)
    by_quick_stop(bench, client)
    bench.run(0.5)
    assert client.read(1, 4, 9, 1) == client.read(1, 4, 0, 1)


def test_holding_register_9_reads_0_and_takes_0_within_a_longer_write(tmp_path: Path) -> None:
    bench = KINDS[0].bench(tmp_path)
    client = Client(bench)
    assert client.write(1, 0, SHUT_DOWN, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1) == 0
    assert client.write(1, 0, SHUT_DOWN, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1) == 0x03
    assert client.write(1, 9, 0) == 0x02
    assert client.read(1, 3, 9, 1) == [0]


# no run time


class RunTime(Exception):
    """Somebody has made one."""


def refused(*_: object, **__: object) -> None:
    raise RunTime


@pytest.fixture
def no_run_time(monkeypatch: pytest.MonkeyPatch) -> None:
    for one in (Plant, Image, Commanded, Channel):
        monkeypatch.setattr(one, "__init__", refused)


@pytest.mark.usefixtures("no_run_time")
def test_nothing_that_is_told_of_a_site_builds_its_run_time() -> None:
    project = load_project(REPOSITORY / "bridge" / "demo" / "site.toml")
    with pytest.raises(RunTime):
        Plant(Catalogue.of(project.site, project.families), "0")
    for table in (modbus_table, opcua_table, zenoh_table):
        assert len(table(project).rows) > 100
    assert "BO_ " in dbc_file(project, 0)
    verdict = lint(project.site, project.families, project.path, project.downloads)
    assert verdict.worst_cases
    audited = list(audit_drives(project, None, [], offline=True))
    assert len(audited) == len(verdict.worst_cases)
