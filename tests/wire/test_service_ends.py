"""However the service ends by itself: every drive is sent a stopped word before anything else is ended."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from pymodbus.client import AsyncModbusTcpClient

from bridge.can.virtual import VirtualWire
from bridge.canopen.frame import Frame
from bridge.command import Event, EventKind, Identity, Request, Source, Write
from bridge.project import load_project
from bridge.service.bus_process import BusProcess
from bridge.sim.nord.nord_tu4 import NordTu4
from bridge.sim.runner import Simulation
from bridge.text import Text
from tests.support import sites
from tests.support.process import free_port
from tests.support.zenoh_peer import until

RPDO1 = 0x205
PLC = Identity(Source.MODBUS, "127.0.0.1")
TASKS = {"master", "EEPROM counts", "audit log", "condition", "start", "modbus", "mirror", "slow"}
"""What the service runs side by side."""
PARTS = {"modbus", "mirror", "slow"}
"""What is started again where it fails."""


class SlowFront:
    """Takes its time to end."""

    name = "slow"
    title = Text.of("front.front", role="slow")

    def __init__(self, ended: Callable[[], None]) -> None:
        self._ended = ended

    def announce_end(self) -> None: ...

    async def run_once(self, serves: Callable[[], None]) -> Text:
        serves()
        try:
            await asyncio.get_running_loop().create_future()
        finally:
            self._ended()
            await asyncio.sleep(0.3)
        return Text.of("front.has_ended")


class Moving:
    """A service in this process whose drive runs, and what happened in which order."""

    def __init__(self, service: BusProcess, running: asyncio.Task[None]) -> None:
        self.service = service
        self.running = running
        self.happened: list[str] = []
        self.events: list[Event] = []
        service.plant.on_event(self.events.append)

    def task(self, name: str) -> asyncio.Task[object]:
        [task] = [task for task in asyncio.all_tasks() if task.get_name() == name]
        return task

    def on_frame(self, frame: Frame) -> None:
        if frame.can_id == RPDO1:
            self.note("enabled" if frame.data[0] & 0x0F == 0x0F else "stopped")

    def note(self, what: str) -> None:
        if self.happened[-1:] != [what]:
            self.happened.append(what)

    def ends(self) -> list[str]:
        """In which order: a drive is enabled no more once it was stopped."""
        return self.happened[self.happened[0] == "enabled" :]

    async def end(self) -> BaseException | None:
        [result] = await asyncio.gather(asyncio.wait_for(self.running, 15), return_exceptions=True)
        return result


@asynccontextmanager
async def moving(folder: Path) -> AsyncIterator[Moving]:
    node = sites.node(sites.drive("fu1", "modbus", 20_000), more="supervision_ms = 1000")
    path = sites.write(folder, sites.bus(node), sites.modbus(free_port()))
    wire = VirtualWire()
    service = BusProcess(load_project(path), lambda table: wire.end(table.name))
    booted, enabled = asyncio.Event(), asyncio.Event()
    service.plant.on_event(lambda event: booted.set() if event.kind is EventKind.NODE_BACK else None)
    simulating = asyncio.create_task(Simulation(wire.end("simulation"), [NordTu4(5)]).run())

    move = Moving(service, asyncio.create_task(service.run(), name="service"))
    service.fronts.append(SlowFront(lambda: move.note("front ends")))  # type: ignore[arg-type]
    wire.listeners.append(move.on_frame)
    wire.listeners.append(lambda _: enabled.set() if move.happened[-1:] == ["enabled"] else None)
    try:
        await asyncio.wait_for(booted.wait(), 15)
        for word in (0x047E, 0x047F):
            request = Request(PLC, "conveyor/fu1", Write({"control_word": word}))
            service.view.submit(request, lambda outcome: None)
        await asyncio.wait_for(enabled.wait(), 15)
        move.happened.clear()
        yield move
    finally:
        for task in (move.running, simulating):
            task.cancel()
        await asyncio.gather(move.running, simulating, return_exceptions=True)


async def fail(task: asyncio.Task[object]) -> None:
    """What the task waits for raises, as a fault of our own or of a library would."""
    while (waited_for := task._fut_waiter) is None or waited_for.done():  # type: ignore[attr-defined]  # noqa: ASYNC110
        await asyncio.sleep(0)
    waited_for.set_exception(RuntimeError("broken"))


def test_each_task_is_tried(tmp_path: Path) -> None:
    async def look() -> None:
        async with moving(tmp_path) as move:
            assert {task.get_name() for task in move.service._tasks} == TASKS

    asyncio.run(look())


@pytest.mark.landing(5)
@pytest.mark.parametrize("name", sorted(TASKS - PARTS))
async def test_drives_stop_first_when_a_task_fails(tmp_path: Path, name: str) -> None:
    async with moving(tmp_path) as move:
        await fail(move.task(name))
        assert isinstance(await move.end(), RuntimeError), "it is told"
        assert move.ends() == ["stopped", "front ends"]


@pytest.mark.landing(4)
@pytest.mark.parametrize("name", sorted(TASKS))
async def test_drives_stop_first_when_a_task_is_lost(tmp_path: Path, name: str) -> None:
    async with moving(tmp_path) as move:
        move.task(name).cancel()
        assert f"has lost a task: {name}" in str(await move.end())
        if name == "slow":
            # It is the one that has ended.
            assert move.ends()[-1] == "stopped"
        else:
            assert move.ends() == ["stopped", "front ends"]


@pytest.mark.landing(3)
@pytest.mark.parametrize("name", sorted(PARTS))
async def test_no_drive_stops_when_a_part_fails(tmp_path: Path, name: str) -> None:
    async with moving(tmp_path) as move:
        await fail(move.task(name))
        failing = move.service.plant.image.index["bridge/fronts_failing"]
        await until(lambda: name in str(move.service.plant.image[failing].value), "it is said")
        await until(lambda: not move.service.plant.image[failing].value, "it serves again")
        told = [event.message for event in move.events if event.kind is EventKind.FRONT]
        assert "broken" in told[0]
        assert told[1].endswith(" serves again")
        assert not move.running.done()
        assert "stopped" not in move.happened


async def test_a_listening_socket_that_ends_is_opened_again_and_connections_go_on(tmp_path: Path) -> None:
    async with moving(tmp_path) as move:
        server = move.service.modbus
        assert server
        port = server.port
        plc = AsyncModbusTcpClient("127.0.0.1", port=port)
        assert await plc.connect()
        # As `ss --kill` does it: nobody can connect, and no call says so.
        assert server._socket
        server._socket.shutdown(socket.SHUT_RDWR)
        await until(lambda: any("listens no more" in event.message for event in move.events), "it is said")
        await until(
            lambda: any(event.message.endswith("serves again") for event in move.events), "it is back"
        )
        assert not (await plc.read_input_registers(0, count=1, device_id=1)).isError(), "the same connection"
        other = AsyncModbusTcpClient("127.0.0.1", port=port)
        assert await other.connect()
        for client in (plc, other):
            client.close()
        assert "stopped" not in move.happened


async def test_drives_stop_first_when_the_service_is_cancelled_again_and_again(tmp_path: Path) -> None:
    async with moving(tmp_path) as move:
        for _ in range(3):
            move.running.cancel()
            await asyncio.sleep(0.02)
        assert isinstance(await move.end(), asyncio.CancelledError)
        assert move.ends() == ["stopped", "front ends"]


async def test_a_fault_in_a_round_of_the_master_stops_the_drives_in_that_round(tmp_path: Path) -> None:
    async with moving(tmp_path) as move:
        move.service.master._plant.enforcements = broken  # type: ignore[method-assign]
        assert "the master has failed" in str(await move.end())
        assert move.ends() == ["stopped", "front ends"]


def broken(*_: object) -> None:
    raise RuntimeError("a fault of our own")
