"""Composition root of the bus process: the only place that knows all parts."""

from __future__ import annotations

import asyncio
import gc
import logging
from collections.abc import Awaitable, Callable, Collection, Iterator, Mapping
from contextlib import AsyncExitStack, suppress
from functools import partial
from pathlib import Path
from typing import Any, Final

from bridge import __version__
from bridge.base import clock
from bridge.base.errors import BridgeError, OperationFailed, Unavailable
from bridge.base.notify import Notifier
from bridge.can import Bus, open_bus
from bridge.can.softbus import SoftBus
from bridge.can.wiretap import Wiretap
from bridge.catalogue import Catalogue
from bridge.command import Plant, PlantView
from bridge.config import BusTable
from bridge.lint import Severity, lint
from bridge.master.ending import Ending
from bridge.master.master import Master
from bridge.master.network import Network
from bridge.master.standby import Standby, listen_s
from bridge.master.standstill import WatchdogTimer
from bridge.mirror.endpoint import socket_endpoint, tap_path
from bridge.mirror.publisher import MirrorPublisher
from bridge.northbound.gateway.nets import net_of
from bridge.northbound.gateway.server import GatewayServer
from bridge.northbound.listening import Port
from bridge.northbound.modbus.server import ModbusServer
from bridge.northbound.modbus.units import units_of
from bridge.project import Project, count
from bridge.recorder.recorder import Recorder
from bridge.recorder.tape import RecordingTape, machine_tape
from bridge.service.audit_log import AuditLog
from bridge.service.event_log import log_event
from bridge.service.front_process import Front
from bridge.service.fronts import FRONTS, FrontKind, Settings
from bridge.service.parts import Ports, SupervisedServer, Supervisor
from bridge.service.plant_condition import PlantCondition
from bridge.service.preflight import check_files
from bridge.service.wear import WearKeeper
from bridge.text import Text

_log = logging.getLogger(__name__)

_START_S: Final = 45.0
"""Longest time that "ready" waits for fronts that neither serve nor fail, seconds; less than the unit's
TimeoutStartSec."""

_NOBODY_HURRIES_MS: Final = 1000

MakeBus = Callable[[BusTable], Bus]


def make_bus(table: BusTable) -> Bus:
    """The bus of a site file. Raises ``BridgeError`` for a virtual one, which only a demo can have."""
    if table.interface == "virtual":
        raise BridgeError(
            f"bus {table.name} is virtual: it exists only inside one process; use `drivebridge demo`"
        )
    return open_bus(table.name, table.interface, table.channel or "", table.bitrate)


class BusProcess:
    """The bus process of one site.

    ``make_bus`` gives the buses. Of what the site serves by fronts, ``fronts`` are started: without any, this
    process serves Modbus alone. ``alarm`` is the master's. ``recorder`` records the core; without one nothing
    does.
    """

    def __init__(
        self,
        project: Project,
        make_bus: MakeBus = make_bus,
        *,
        fronts: Collection[FrontKind[Any]] = FRONTS,
        alarm: WatchdogTimer | None = None,
        recorder: Recorder | None = None,
    ) -> None:
        self.project = project
        self._recorder = recorder
        tape = recorder.tape if recorder else machine_tape()
        site = project.site
        catalogue = Catalogue.of(site, project.families)
        self.plant = Plant(catalogue, __version__, clock.now(), tape)
        if recorder:
            # Before all others: what they do upon an event comes after it.
            self.plant.on_event(tape.on_event)
        self.plant.on_event(log_event)
        self.wear = WearKeeper(self.plant.eeprom_writes, Path(site.site.state_dir))
        self.audit = AuditLog(self.plant, site, clock.now, clock.epoch_ns)
        self.notifier = Notifier()
        networks = [(make_bus(table), self._network(table, tape)) for table in site.bus]
        self._networks = [network for _, network in networks]
        lines = [(recorder.taped(bus) if recorder else bus, network) for bus, network in networks]
        self.master = Master(lines, self.plant, tape.now, self.notifier.alive, alarm, tape.slept)
        self.view = PlantView(self.plant, tape.now, clock.epoch_ns, self.master.carry_out, self.master.wake)
        self.condition = PlantCondition(self.plant, clock.now, clock.epoch_ns)
        self.modbus = None
        if site.modbus:
            self.modbus = ModbusServer(self.view, units_of(catalogue), site.modbus, clock.now)
        endpoint = socket_endpoint(Path(site.site.runtime_dir), site.site.name)
        period_ms = site.zenoh.period_ms if site.zenoh else _NOBODY_HURRIES_MS
        self.mirror = MirrorPublisher(self.view, endpoint, clock.now, period_ms / 1000)
        folder = Path(site.site.runtime_dir)
        taps = {table.name: tap_path(folder, site.site.name, table.name) for table in site.bus}
        self.gateways = self._make_gateways(taps)
        self._taps = [
            Wiretap(bus, taps[bus.name])
            for bus, _ in networks
            if (site.page or bus.name in self.gateways) and isinstance(bus, SoftBus)
        ]
        """Taps for the page and for clients of the gateway, of buses that no other process can listen to."""
        self._tasks: list[asyncio.Task[None]] = []
        self._ending: Ending | None = None
        drives, buses = count(len(self.plant.drives), "drive"), count(len(site.bus), "bus")
        self.supervisor = Supervisor(self.plant, self.notifier, clock.now, f"{drives} on {buses}")
        self._opened = Ports()
        self.fronts: list[Front] = []
        self._ports: list[Port] = []
        """Listening sockets of the fronts; kept open, so that a restarted front serves at once."""
        self._openings: dict[str, Callable[[], Awaitable[None]]] = {}
        """Opens or looks at the ports of each front, by its role."""
        for kind in fronts:
            if (settings := kind.settings(site)) is not None:
                self._add_front(kind, settings)

    def _network(self, table: BusTable, tape: RecordingTape) -> Network:
        """The nodes of a bus, with the tape around them."""
        side, listening = self.plant.side_of(table), Standby(listen_s(table), tape.chance)
        return Network(table, side, tape.epoch_ns, self.project.downloads, listening)

    def _make_gateways(self, taps: Mapping[str, Path]) -> dict[str, GatewayServer]:
        """Gateways by bus; ``taps`` are the sockets on which the frames of each are passed on."""
        site = self.project.site
        folder = Path(site.site.runtime_dir).absolute()
        return {
            table.name: GatewayServer(
                self.view,
                net_of(table, number, self.plant.catalogue.nodes.values(), taps[table.name]),
                folder / f"{site.site.name}-{table.name}.gateway",
                None if table.gateway == "socket" else table.gateway,
                clock.now,
            )
            for number, table in enumerate(site.bus, 1)
            if table.gateway
        }

    def _add_front(self, kind: FrontKind[Settings], settings: Settings) -> None:
        """Add a front to the parts, and its ports to those that are opened first."""
        listening = None
        if kind.port:
            port = kind.port(settings)
            self._ports.append(port)
            self._openings[kind.role], listening = port.open, port.socket
        elif kind.check_ports:
            self._openings[kind.role] = partial(kind.check_ports, settings)
        command = ["run", str(self.project.path), "--role", kind.role]
        most_mb = self.project.site.site.front_memory_mb
        notice_s = kind.notice_s(settings) if kind.notice_s else None
        self.fronts.append(
            Front(kind.role, command, watched=True, listening=listening, most_mb=most_mb, notice_s=notice_s)
        )

    async def run(self, ready: Callable[[], None] = lambda: None) -> None:
        """Serve until cancelled; ``ready`` is called as soon as the buses are open.

        Raises ``FileFaults`` where a file cannot be used, ``Unavailable`` where a bus or all ports cannot be
        opened (with ``site.all_ports``: one of them), and ``OperationFailed`` when the master has failed. A
        server or a front that cannot be started or fails later is started again.
        """
        self._say_what_is_doubtful()
        async with AsyncExitStack() as stack:
            stack.callback(self._say_end)
            check_files(self.project.site, self.project.path, fronts=bool(self.fronts))
            self.wear.keep()
            stack.callback(self.wear.keep)
            self.audit.start()
            stack.callback(self.audit.close)
            await self._open_ports(stack)
            stack.push_async_callback(self._end_tasks)
            # What is there now stays: the collector need not look at it again and again. Before the bus is
            # opened, because the first look takes longer than a round may be late.
            gc.collect()
            gc.freeze()
            if self._recorder:
                stack.callback(self._recorder.close)
                self._recorder.start(self.master, self.view, self.plant)
            await self.master.start()
            # Whatever ends the service: the drives stop before anything else ends.
            stack.push_async_callback(self._stop)
            ready()
            await self._serve()

    async def _open_ports(self, stack: AsyncExitStack) -> None:
        """Open the ports, before the buses: a service that cannot be reached must not command a bus. A port
        that cannot be opened is tried again while the others are served, unless the site needs all."""
        ports, needs_all = self._opened, self.project.site.site.all_ports
        if self.modbus:
            stack.push_async_callback(self.modbus.close)
            await ports.open("modbus", self.modbus.start)
        for port in self._ports:
            stack.callback(port.close)
        for role, opening in self._openings.items():
            await ports.open(role, opening)
        ports.check(needs_all=needs_all)
        await self.mirror.start()
        stack.push_async_callback(self.mirror.close)
        # After the mirror, which sees that the folder of their sockets is ours alone.
        for name, gateway in self.gateways.items():
            stack.push_async_callback(gateway.close)
            await ports.open(f"gateway {name}", gateway.start)
        ports.check(needs_all=needs_all)
        for tap in self._taps:
            stack.push_async_callback(tap.close)
            try:
                await tap.start()
            except Unavailable as error:
                _log.warning("the page will not show the traffic of a bus: %s", error)

    def halt(self) -> None:
        """Stop all drives now, take no command any more but stops, and have the clients told. ``run`` is to
        be cancelled next."""
        self.master.halt(clock.now())
        for front in self.fronts:
            front.announce_end()

    async def _serve(self) -> None:
        """Run all tasks until cancelled or one ends: each runs for ever, or raises when its part has
        failed."""
        parts = [*self._servers(), *self.fronts]
        self.supervisor.expect(parts)
        works = {
            "master": self.master.failed(),
            "EEPROM counts": self.wear.run(),
            "audit log": self.audit.run(),
            "condition": self.condition.run(),
            **({"recorder": self._recorder.run()} if self._recorder else {}),
            "start": self._start(),
            **{part.name: self.supervisor.keep(part) for part in parts},
        }
        self._tasks = [asyncio.create_task(work, name=name) for name, work in works.items()]
        done, _ = await asyncio.wait(self._tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            if not task.cancelled():
                task.result()
        raise OperationFailed(f"the service has lost a task: {', '.join(task.get_name() for task in done)}")

    def _servers(self) -> Iterator[SupervisedServer]:
        has = self._opened.has
        if self.modbus:
            yield SupervisedServer("modbus", Text.of("front.modbus"), self.modbus, is_started=has("modbus"))
        for bus, gateway in self.gateways.items():
            name = f"gateway {bus}"
            yield SupervisedServer(name, Text.of("front.gateway", bus=bus), gateway, is_started=has(name))
        yield SupervisedServer("mirror", Text.of("front.link"), self.mirror)

    async def _start(self) -> None:
        """Report "ready" once each part serves or is known not to, and wait for ever."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self.supervisor.all_known(), _START_S)
        self.notifier.ready(self.supervisor.status)
        await asyncio.get_running_loop().create_future()

    async def _end_tasks(self) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def _say_what_is_doubtful(self) -> None:
        """Log doubtful predictions. The site runs all the same: stopping a plant over them would be worse.
        The prediction for each bus becomes part of the published times of what is commanded there."""
        verdict = lint(self.project.site, self.project.families, self.project.path, self.project.downloads)
        for finding in verdict.findings:
            level = logging.ERROR if finding.severity is Severity.ERROR else logging.WARNING
            _log.log(level, "%s", finding.fault)
        for load in verdict.loads:
            _log.info("%s", load)
        commanded = {one.name: one for node in self.plant.nodes.values() for one in node.commanded}
        for case in verdict.worst_cases:
            commanded[case.drive].on_wire(case.wire, clock.now())

    async def _stop(self) -> None:
        self.halt()
        passive = [network.bus.name for network in self._networks if network.mastership.is_passive]
        if passive:
            _log.info("passive on %s: another bridge is in charge, nothing is sent there", ", ".join(passive))
        if len(passive) < len(self._networks):
            _log.info("stopping all drives%s", " of the other buses" if passive else "")
        self.notifier.stopping()
        try:
            self._ending = await self.master.stop_drives(clock.now())
        finally:
            await self.master.close()

    def _say_end(self) -> None:
        """Write the last lines of the log."""
        if self._ending is not None:
            level = logging.INFO if self._ending.is_good else logging.ERROR
            for line in self._ending.lines:
                _log.log(level, "%s", line)
        _log.info("stopped")
