"""The bridge of a plant: the cores of the real bus process, put together as ``bridge.service.bus_process``
does, in a process that may stand still or end."""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import Callable, Coroutine, Mapping
from functools import partial
from pathlib import Path
from random import Random
from typing import cast

from bridge.can import Bus
from bridge.catalogue import Catalogue
from bridge.command import Event, Identity, Outcome, Plant, PlantView, Request
from bridge.image import Quality
from bridge.lint import lint
from bridge.lint.own import WorstCase
from bridge.master.master import Master
from bridge.master.network import Network
from bridge.master.standby import Standby, listen_s
from bridge.mirror import MirrorPublisher, socket_endpoint
from bridge.northbound.modbus.server import ModbusServer
from bridge.northbound.modbus.units import units_of
from bridge.project import Project
from bridge.recorder.tape import Note, RecordingTape, TapedBus
from bridge.service.plant_condition import LOOK_EVERY_S, PlantCondition
from bridge.zenohlink import ZenohLink
from tests.plant.machine import Process, Watcher
from tests.plant.meeting import Link, Meeting
from tests.plant.stream import Stream
from tests.plant.wire import PlantBus, Wire
from tests.plant.world import Timer, World


class _Publisher(MirrorPublisher):
    """The real one, over the plant's socket."""

    def __init__(self, link: Link, view: PlantView, endpoint: str, clock: Callable[[], float]) -> None:
        self._link_of_plant = link
        super().__init__(view, endpoint, clock)

    def _new_link(self) -> ZenohLink:
        return cast("ZenohLink", self._link_of_plant)


def socket_of(project: Project) -> str:
    """The endpoint of this plant's socket, of which there is no more than a file."""
    site = project.site.site
    endpoint = socket_endpoint(Path(site.runtime_dir), site.name)
    Path(endpoint.partition("/")[2]).touch()
    return endpoint


class Bridge:
    """One bridge on its wires. ``start`` begins a new process; what listens to it stays."""

    def __init__(
        self,
        world: World,
        project: Project,
        wires: Mapping[str, Wire],
        name: str,
        rng: Random,
        records: Callable[[bytes], None] | None = None,
        meeting: Meeting | None = None,
    ) -> None:
        """``meeting``: where it meets its fronts."""
        self._world = world
        self._meeting = meeting
        self._link: Link | None = None
        self._project = project
        self._catalogue = Catalogue.of(project.site, project.families)
        self._worst_cases: list[WorstCase] = list(
            lint(project.site, project.families, project.path, project.downloads).worst_cases
        )
        self._wires = wires
        self._name = name
        self._rng = rng
        self._buses: list[PlantBus] = []
        self._timer: Timer | None = None
        self._streams: list[Stream] = []
        self._ports = 0
        self.on_event: list[Callable[[Event], None]] = []
        self.on_start: list[Callable[[], None]] = []
        self.on_request: list[Callable[[int, Request], None]] = []
        """Called with each request that is submitted, and its number; ``on_answer`` with its outcome."""
        self.on_answer: list[Callable[[int, Outcome], None]] = []
        self._requests = 0
        self._endings: list[tuple[asyncio.Task[None], Coroutine[None, None, None]]] = []
        self._told_to_end: Process | None = None
        self.watchers: list[Watcher] = []
        self.tape: RecordingTape | None = None
        """Tape of the process that is on, where ``records`` has it recorded."""
        self._records = records
        self.before_round: Callable[[], None] = lambda: None
        """Called once before the next round that is due."""
        self.starts = 0
        """How many of its processes have started; the last of them at ``started_at``."""
        self.started_at = world.now
        self.faults: list[str] = []
        """What has failed in any of its processes."""
        self.process = self._begin()

    # life

    def _begin(self) -> Process:
        """A process with everything in it, as after ``drivebridge run``."""
        world = self._world
        process = self.process = Process(world, self, self.faults)
        chance = self._rng.random
        tape = self.tape = (
            RecordingTape(self._records, now=process.clock, epoch_ns=world.epoch_ns, chance=chance)
            if self._records
            else None
        )
        self.plant = Plant(self._catalogue, "0", world.now, tape)
        if tape:
            self.plant.on_event(tape.on_event)
            process.alarm.told = partial(tape.tell, Note.RANG)
        self.plant.on_event(self._tell)
        self._buses = [
            PlantBus(world, self._wires[table.name], process, self._name) for table in self._project.site.bus
        ]
        self.taped = [TapedBus(bus, tape) for bus in self._buses] if tape else []
        buses: list[Bus] = [*(self.taped or self._buses)]
        clock = tape.now if tape else process.clock
        networks = [
            Network(
                table,
                self.plant.side_of(table),
                tape.epoch_ns if tape else world.epoch_ns,
                self._project.downloads,
                Standby(listen_s(table), tape.chance if tape else chance),
            )
            for table in self._project.site.bus
        ]
        self.master = Master(list(zip(buses, networks, strict=True)), self.plant, clock, alarm=process.alarm)
        self.view = PlantView(self.plant, clock, world.epoch_ns, self.master.carry_out, self.master.wake)
        self.condition = PlantCondition(self.plant, process.clock, world.epoch_ns)
        self.modbus = None
        if self._project.site.modbus:
            units = units_of(self._catalogue)
            self.modbus = ModbusServer(self.view, units, self._project.site.modbus, process.clock)
        self._link = self._meeting.link(process) if self._meeting else None
        process.post(self._start)
        return process

    def _start(self) -> None:
        commanded = {one.name: one for node in self.plant.nodes.values() for one in node.commanded}
        for case in self._worst_cases:
            commanded[case.drive].on_wire(case.wire, self._world.now)
        if self.modbus:
            self.modbus.pulse.start()
        if self._link:
            publisher = _Publisher(self._link, self.view, socket_of(self._project), self.process.clock)
            self.process.loop.create_task(publisher.start())
        for bus in self._buses:
            bus.open(self.master.on_bus)
        self.master.attach(self._arm)
        self.master.wake()
        self._judge()
        self.starts, self.started_at = self.starts + 1, self._world.now
        for tell in self.on_start:
            tell()

    def _judge(self) -> None:
        """Judge the condition of the plant, again and again, as ``PlantCondition.run`` does."""
        self.condition.look()
        process = self.process
        self._world.after(LOOK_EVERY_S, lambda: process.post(self._judge))

    def _arm(self, at: float) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._world.at(at, self._round)

    def _round(self) -> None:
        before, self.before_round = self.before_round, lambda: None
        before()
        self.process.post(self.master.on_bus)

    def on_still(self, now: float) -> None:
        for watcher in self.watchers:
            watcher.on_still(now)

    def on_going_on(self, since: float, now: float) -> None:
        for watcher in self.watchers:
            watcher.on_going_on(since, now)

    def on_end(self, now: float) -> None:
        """The kernel closes what the process had open."""
        for _, work in self._endings:
            if inspect.getcoroutinestate(work) == inspect.CORO_CREATED:
                work.close()
        if self._timer is not None:
            self._timer.cancel()
        for bus in self._buses:
            bus.end_kernel()
        if self._link:
            self._link.drop()
        streams, self._streams = self._streams, []
        for stream in streams:
            stream.close()
        for watcher in self.watchers:
            watcher.on_end(now)

    def end(self, told: Callable[[], None], ended: Callable[[], None]) -> None:
        """End the service, as a signal does. ``told`` is called when it has been told, and ``ended`` when it
        has done all that it does then. A second signal changes nothing (docs: "Ending")."""
        if self.is_ending:
            return
        process = self._told_to_end = self.process

        async def ending() -> None:
            self.master.halt(process.clock())
            told()
            await self.master.stop_drives(process.clock())
            await self.master.close()
            ended()
            process.kill(in_turn=False)

        def begin() -> None:
            # One whose process is killed meanwhile is never done.
            work = ending()
            self._endings.append((asyncio.Task(work, loop=process.loop), work))

        process.post(begin)

    @property
    def is_ending(self) -> bool:
        """Its process has been told to end, and is still there."""
        return self._told_to_end is self.process and not self.process.is_dead

    def restart(self) -> None:
        """Another process in place of one that has ended."""
        assert self.process.is_dead
        self._begin()

    def _tell(self, event: Event) -> None:
        self._world.tell(f"{self._name} {event.kind} {event.source} {event.severity} {event.text}")
        for tell in self.on_event:
            tell(event)

    # who asks

    def connect(
        self,
        host: str,
        delay_s: float,
        *,
        take: Callable[[bytes], None],
        on_closed: Callable[[], None],
    ) -> Stream | None:
        """A Modbus connection; None where nobody listens."""
        if self.process.is_dead or self.modbus is None:
            return None
        self._ports += 1
        peer = host, 40_000 + self._ports
        stream = Stream(
            self._world,
            self.process,
            self.modbus.connection,
            peer,
            delay_s,
            take=take,
            on_closed=on_closed,
        )
        self._streams.append(stream)
        return stream

    def ask(
        self,
        request: Request,
        delay_s: float,
        arrived: Callable[[], None],
        reply: Callable[[Outcome], None],
    ) -> None:
        """A request of a client of OPC UA or zenoh, as its server submits it. ``reply`` is called when the
        outcome is given. One that dies with the process has none."""

        def arrive() -> None:
            if self.process.is_dead:
                return
            arrived()
            self._requests += 1
            number = self._requests
            for tell in self.on_request:
                tell(number, request)
            self.process.post(lambda: self.view.submit(request, partial(self._answer, number, reply)))

        self._world.after(delay_s, arrive)

    def _answer(self, number: int, reply: Callable[[Outcome], None], outcome: Outcome) -> None:
        for tell in self.on_answer:
            tell(number, outcome)
        reply(outcome)

    def connected(self, identity: Identity, *, is_there: bool) -> None:
        process = self.process
        process.post(lambda: self.view.on_connection(identity, is_there=is_there))

    # what is done to it

    @property
    def buses(self) -> list[PlantBus]:
        return self._buses

    def good_number(self, name: str) -> float | None:
        """Value of a point that is a number, and good."""
        reading = self.plant.image.read(name)
        is_number = reading.quality is Quality.GOOD and isinstance(reading.value, int | float)
        return reading.value if is_number else None  # type: ignore[return-value]

    def text(self, name: str) -> str:
        """Text of a point; nothing where it has none."""
        value = self.plant.image.read(name).value
        return value if isinstance(value, str) else ""
