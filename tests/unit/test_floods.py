"""Whatever can be brought about from a wire, a bus or by a slow machine, a thousand times within a minute:
the log has a line of each kind and source, and a count for each a minute later."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, cast

import pytest

from bridge.base.notify import Notifier
from bridge.base.quietlog import A_FEW
from bridge.base.sources import source_of
from bridge.can.interface import ControllerState
from bridge.canopen.frame import Frame
from bridge.command import Action, Identity, Plant, Rejection, Request, Source, command_of
from bridge.command.drive_link import NodeState
from bridge.config import ModbusTable, ZenohTable
from bridge.mirror.client import MirrorClient
from bridge.northbound.modbus.connection import ModbusConnection
from bridge.northbound.modbus.server import ModbusServer
from bridge.northbound.modbus.units import units_of
from bridge.northbound.zenoh.server import ZenohServer
from bridge.service.event_log import log_event
from bridge.service.parts import Supervisor
from bridge.text import Text
from bridge.zenohlink import Sample, zenoh_config
from bridge.zenohlink.worker import Worker
from tests.support import sites
from tests.support.bench import Bench, write_site
from tests.support.node_states import node_goes, run_timers
from tests.support.quiet import QuietLog, quiet_log
from tests.support.rig import ENABLE, ENGINEER, OTHER_PLC, PLC, SHUT_DOWN, emergency
from tests.support.views import dispatcher_of, view_of

TIMES: Final = 1000
STEP_S: Final = 0.05
SITE: Final = sites.site(
    sites.bus(sites.node(sites.drive("fu1", "modbus", 200), sites.drive("fu2", "lease", 200))),
    sites.modbus(),
)
FU1, FU2 = "conveyor/fu1", "conveyor/fu2"


@pytest.fixture
def log() -> Iterator[QuietLog]:
    with quiet_log() as log:
        yield log


class Hall:
    """A plant whose events are logged; each step is 50 ms."""

    def __init__(self, log: QuietLog) -> None:
        self.plant = sites.plant_of(SITE)
        self.plant.on_event(log_event)
        self.log = log
        self.node = self.plant.nodes["conveyor"]
        node_goes(self.plant, self.node, NodeState.OPERATIONAL, self.now)
        self.dispatcher = dispatcher_of(self.plant, lambda: self.now)

    @property
    def now(self) -> float:
        return self.log.now

    def step(self) -> None:
        self.log.now += STEP_S
        run_timers(self.plant, self.now)

    def ask(self, action: Action, who: Identity = PLC, target: str = FU1, **more: object) -> None:
        request = Request(who, target, command_of(action, **more))
        self.plant.submit(request, self.now, lambda outcome: None)


# by clients


def refused_writes(hall: Hall, number: int) -> None:
    hall.ask(Action.WRITE, OTHER_PLC, values={"control_word": ENABLE})


def invalid_words(hall: Hall, number: int) -> None:
    hall.ask(Action.WRITE, values={"control_word": number})


def made_up_drives(hall: Hall, number: int) -> None:
    hall.ask(Action.STOP, target=f"attic/fu{number}")
    hall.ask(Action.RESET, target=f"attic{number}")


def made_up_units(hall: Hall, number: int) -> None:
    hall.dispatcher.handle(
        10 + number % 240, struct.pack(">BHH", 6, number, 1), OTHER_PLC, lambda answer: None
    )


def made_up_names(hall: Hall, number: int) -> None:
    who = Identity(Source.ZENOH, f"nobody{number}")
    hall.plant.rejected(Rejection(who, f"attic/{number}", "write", "malformed", f"{number}"), hall.now)


def parameters(hall: Hall, number: int) -> None:
    hall.ask(Action.WRITE_PARAMETER, parameter=f"P{number}", value=number)


def leases_taken_and_given_back(hall: Hall, number: int) -> None:
    who = Identity(Source.OPCUA, f"operator{number % 2}")
    hall.ask(Action.TAKE_CONTROL, who, FU2, ttl_ms=1000)
    hall.ask(Action.RELEASE_CONTROL, who, FU2)


def leases_taken_away(hall: Hall, number: int) -> None:
    who = Identity(Source.OPCUA, f"engineer{number % 2}", ENGINEER.role)
    hall.ask(Action.TAKE_CONTROL, who, FU2, ttl_ms=1000)


def leases_that_run_out(hall: Hall, number: int) -> None:
    hall.ask(Action.TAKE_CONTROL, Identity(Source.OPCUA, "ann"), FU2, ttl_ms=100)
    hall.log.now += 0.001
    run_timers(hall.plant, hall.now + 0.2)


def stops_by_others(hall: Hall, number: int) -> None:
    hall.ask(Action.WRITE, values={"control_word": SHUT_DOWN})
    hall.ask(Action.QUICK_STOP, OTHER_PLC)


def trips(hall: Hall, number: int) -> None:
    hall.ask(Action.WRITE, values={"control_word": SHUT_DOWN})
    run_timers(hall.plant, hall.now + 0.3)
    hall.ask(Action.RESET_FAULT)


# by drives and nodes


def emergencies(hall: Hall, number: int) -> None:
    hall.plant.drives[FU1].channel.on_emcy(emergency(0x1000 + number % 3 * 0x100), hall.now)


def lost_nodes(hall: Hall, number: int) -> None:
    node_goes(hall.plant, hall.node, NodeState.LOST, hall.now)
    node_goes(hall.plant, hall.node, NodeState.OPERATIONAL, hall.now)


def late_process_data(hall: Hall, number: int) -> None:
    hall.plant.drives[FU1].channel.link.pdo_deadline_s = 0.01
    hall.plant.drives[FU1].on_process_data([0, 0, 0, 0], hall.now)
    run_timers(hall.plant, hall.now + 5)


@pytest.mark.landing(5)
@pytest.mark.parametrize(
    ("provoke", "most"),
    [
        (refused_writes, 1),
        (invalid_words, 2),
        (made_up_drives, 1),
        (made_up_units, 1),
        (made_up_names, 1),
        (parameters, 1),
        (leases_taken_and_given_back, 1 * A_FEW),
        (leases_taken_away, 2 * A_FEW),
        (leases_that_run_out, 2 * A_FEW),
        (stops_by_others, 2 * A_FEW),
        (trips, 3 * A_FEW),
        (emergencies, 2),
        (lost_nodes, 4 * A_FEW),
        (late_process_data, 2 * A_FEW),
    ],
)
def test_a_plant_says_a_line_of_each_kind_and_drive(
    log: QuietLog, provoke: Callable[[Hall, int], None], most: int
) -> None:
    hall = Hall(log)
    before = len(log.lines)
    for number in range(TIMES):
        hall.step()
        provoke(hall, number)
    assert 1 <= len(log.lines) - before <= most
    assert len(log.pass_minute()) <= most


# on a bus


class Line:
    """A bench whose events are logged."""

    def __init__(self, folder: Path, log: QuietLog) -> None:
        self.bench = Bench(write_site(folder))
        self.bench.run(2.0)
        self.log = log
        self.bench.plant.on_event(log_event)
        self._began = self.bench.now
        self._log_began = log.now

    def step(self) -> None:
        self.bench.now += STEP_S
        self.log.now = self._log_began + self.bench.now - self._began

    def receive(self, can_id: int, data: bytes = b"") -> None:
        self.bench.receive(Frame(can_id, data))
        self.bench.master.pump()


def bus_states(line: Line, number: int) -> None:
    states = (ControllerState.WARNING, ControllerState.OK, ControllerState.BUS_OFF, ControllerState.PASSIVE)
    line.bench.bus.status.state = states[number % 4]
    line.bench.master.pump()


def refused_bursts(line: Line, number: int) -> None:
    line.bench.bus.status.bursts_refused = "no room" if number % 2 else ""
    line.bench.master.pump()


def error_frames(line: Line, number: int) -> None:
    line.bench.bus.status.error_frames += 1
    line.bench.master.pump()


def hangs(line: Line, number: int) -> None:
    line.bench.now += 0.2
    line.bench.master.pump()


def second_masters(line: Line, number: int) -> None:
    line.receive(0x000, bytes((1, number % 128)))


def strangers(line: Line, number: int) -> None:
    line.receive(0x700 + 10 + number % 100, b"\x05")


def intruders(line: Line, number: int) -> None:
    line.receive(0x205, struct.pack("<HHHH", number & 0xFFFF, 0, 0, 0))


def restarts(line: Line, number: int) -> None:
    line.receive(0x705, b"\0")


def nonsense(line: Line, number: int) -> None:
    line.receive(0x85, bytes(number % 8))
    line.receive(0x185, bytes(number % 8))
    line.receive(0x585, bytes(number % 9))
    line.receive(0x705, bytes(2))


ON_THE_BUS: Final = (
    bus_states,
    refused_bursts,
    error_frames,
    hangs,
    second_masters,
    strangers,
    intruders,
    restarts,
    nonsense,
)
_LINES: Final = 30
"""A node that is not asked for a minute is lost, the round was late, and so on; hangs take four minutes."""


@pytest.mark.landing(3)
@pytest.mark.parametrize("provoke", ON_THE_BUS)
def test_a_bus_says_a_line_of_each_kind_and_source(
    tmp_path: Path, log: QuietLog, provoke: Callable[[Line, int], None]
) -> None:
    line = Line(tmp_path, log)
    for number in range(TIMES):
        line.step()
        provoke(line, number)
    assert 1 <= len(log.lines) <= _LINES
    assert len(log.pass_minute()) <= _LINES


def test_that_the_bus_is_well_again_is_no_warning(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    bench.run(1.0)
    for state in (ControllerState.WARNING, ControllerState.OK):
        bench.bus.status.state = state
        bench.run(0.1)
    (event,) = [event for event in bench.events if "is ok" in event.message]
    assert event.severity < 300


# by connections


@dataclass(eq=False)
class _Visitor:
    """Session, with as much of it as the server uses."""

    identity: Identity | None = None
    heard_at: float = 0.0
    address: str = "10.0.0.9:50000"
    source: str = "10.0.0.9"
    has_spoken: bool = True

    def close(self) -> None: ...


@pytest.mark.landing(2)
@pytest.mark.parametrize(
    ("stranger", "guest"),
    [("192.168.1.1", "10.0.0.9"), ("2001:db8::{:x}", "fd00::{:x}")],
    ids=["of one address each", "of every address of a network"],
)
async def test_connections_that_come_and_go(log: QuietLog, stranger: str, guest: str) -> None:
    plant = sites.plant_of(SITE)
    table = ModbusTable.model_validate({"allow": ["10.0.0.0/8", "fd00::/8"], "max_connections": 2})
    server = ModbusServer(view_of(plant, lambda: log.now), units_of(plant.catalogue), table, lambda: log.now)
    for number in range(TIMES):
        host = guest.format(number)
        visitor = cast(ModbusConnection, _Visitor(source=source_of(host)))
        server.admit(visitor, stranger.format(number), number)
        server.admit(visitor, host, number)
        server.on_fault(visitor, f"protocol id {number}")
    assert len(log.lines) == 3
    assert len(log.pass_minute()) == 3
    counts = [plant.image.read(f"bridge/modbus_{kind}_connections").value for kind in ("refused", "broken")]
    assert counts[0] == TIMES
    assert cast(int, counts[1]) >= 2 * TIMES - 2


async def test_puts_that_are_no_commands(log: QuietLog) -> None:
    plant = sites.plant_of(SITE)
    table = ZenohTable.model_validate({"accept_put": True})
    server = ZenohServer(view_of(plant, lambda: log.now), table, "hall", lambda: log.now)
    for number in range(TIMES):
        server._on_put(Sample(f"drives/hall/attic/{number}", b"\xff"))
    assert len(log.lines) == 1
    assert len(log.pass_minute()) == 1


async def test_messages_between_processes(log: QuietLog) -> None:
    mirror = MirrorClient("unixsock-stream/none", lambda: log.now)
    for _ in range(TIMES):
        mirror._on_event(Sample("mirror/event", b"\xff"))
    assert mirror.malformed == TIMES
    assert len(log.lines) == 1


def test_what_zenoh_cannot_send(log: QuietLog) -> None:
    worker = Worker(zenoh_config(), "zenoh", lambda error: None, lambda: None)
    for number in range(TIMES):
        worker.complain(ValueError(f"{number}"))
    assert len(log.lines) == 1


class _Broken:
    name, title = "modbus", Text.of("front.modbus")

    async def run_once(self, serves: Callable[[], None]) -> Text:
        raise KeyError("a fault of ours")


async def test_a_part_that_fails_again_and_again(log: QuietLog, monkeypatch: pytest.MonkeyPatch) -> None:
    plant: Plant = sites.plant_of(SITE)
    plant.on_event(log_event)
    monkeypatch.setenv("NOTIFY_SOCKET", "")
    parts = Supervisor(plant, Notifier(), lambda: log.now, "")
    left = TIMES

    async def sleep(seconds: float) -> None:
        nonlocal left
        left -= 1
        if not left:
            raise asyncio.CancelledError

    monkeypatch.setattr("bridge.service.parts.asyncio.sleep", sleep)
    with pytest.raises(asyncio.CancelledError):
        await parts.keep(_Broken())
    assert sum("Traceback" in line for line in log.lines) == 1
    assert sum(not line.startswith((" ", "Traceback", "KeyError")) for line in log.lines) == 2
