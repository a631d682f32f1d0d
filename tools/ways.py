#!/usr/bin/env python3
"""Draw the ways of values through the code into docs/explanation/architecture.md.

    .venv/bin/python -m tools.ways

A bus process runs here on a virtual bus with a simulated node, and an OPC UA server at the other end of its
link. A TPDO with a word that nothing else holds is followed into a register, an OPC UA node and a zenoh key,
and a word that a client writes by Modbus into an RPDO. The page says what counts as on the way; what stands
between its two marks is replaced. A test fails where it is not up to date.
"""

from __future__ import annotations

import asyncio
import socket
import struct
import tempfile
from collections.abc import AsyncIterator, Iterable
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

import zenoh
from asyncua.client.client import Client

from bridge.base import clock
from bridge.can.virtual import VirtualWire
from bridge.canopen.frame import Frame
from bridge.command import EventKind
from bridge.mirror.client import MirrorClient
from bridge.mirror.endpoint import socket_endpoint
from bridge.northbound.opcua.server import OpcUaServer
from bridge.northbound.zenoh import ZenohServer
from bridge.project import load_project
from bridge.service.bus_process import BusProcess
from bridge.sim.nord.nord_tu4 import NordTu4
from bridge.sim.runner import Simulation
from bridge.zenohlink import zenoh_config
from tools.marks import replaced
from tools.trace import Rest, Threads, Trace

ROOT: Final = Path(__file__).resolve().parents[1]
PAGE: Final = ROOT / "docs" / "explanation" / "architecture.md"
BEGIN: Final = "<!-- drawn by tools/ways.py: begin -->"
END: Final = "<!-- drawn by tools/ways.py: end -->"

_DRIVE: Final = "n/fu1"
_TPDO, _RPDO = 0x185, 0x205
_SWITCHED_ON_DISABLED, _DISABLED = 0x0B31, 0x047E
_READ, _WRITTEN = 0x2A5D, 0x2B6D
"""Words of which neither byte nor digits occur by chance."""
_PATIENCE_S: Final = 30.0

_SITE: Final = """
[site]
name = "ways"
state_dir = "{folder}"
runtime_dir = "{folder}/run"
[[bus]]
name = "can0"
interface = "virtual"
bitrate = 250000
deadman_ms = 10000
[[bus.node]]
name = "n"
id = 5
mapping = "nord/sk-tu4-cao"
supervision_ms = 5000
[[bus.node.drive]]
slot = "fu1"
control = "modbus"
unit_id = 1
fieldbus_timeout_ms = 0
[modbus]
listen = "127.0.0.1:{modbus}"
[opcua]
listen = "127.0.0.1:{opcua}"
no_security = true
anonymous = "operator"
[zenoh]
listen = ["tcp/127.0.0.1:{zenoh}"]
"""
"""With times that a traced process can keep."""


class Way(NamedTuple):
    word: int
    rests: tuple[Rest, ...]


_IMAGE: Final = Rest("image/image.py", "Image.set_values")
_LINK, _WORKER = "zenohlink/link.py", "zenohlink/worker.py"
_SESSION: Final = "northbound/modbus/connection.py"
_TO_A_FRONT: Final = (
    _IMAGE,
    Rest(_LINK, "ZenohLink.send"),
    Rest(_LINK, "_publish", "ZenohLink.send"),
    Rest(_WORKER, "CallQueue.take_in"),
    Rest("image/image.py", "Image.set"),
)
WAYS: Final = {
    "A TPDO into a Modbus register": Way(
        _READ, (_IMAGE, Rest(_SESSION, "Conversation._on_answer"), Rest(_SESSION, "ModbusConnection.serve"))
    ),
    "A TPDO into an OPC UA node": Way(
        _READ,
        (*_TO_A_FRONT, Rest("northbound/opcua/space/data_values.py", "present_value", gives=True)),
    ),
    "A TPDO to a zenoh key": Way(
        _READ,
        (
            *_TO_A_FRONT,
            Rest(_LINK, "ZenohLink.publish"),
            Rest(_WORKER, "Worker.do", "ZenohLink.submit"),
            Rest("zenohlink/publishers.py", "Publishers.put"),
        ),
    ),
    "A write by Modbus into an RPDO": Way(
        _WRITTEN,
        (
            Rest("command/leg/step.py", "_take"),
            Rest("command/channel.py", "Channel._take_in"),
            Rest("can/softbus.py", "SoftBus.burst"),
        ),
    ),
}

_IN: Final = {
    "can/virtual.py": "gives the frames that have come",
    "master/line.py": "hands them to the network of its bus",
    "master/network.py": "finds the handler of the COB-ID",
    "node/process/process_data.py": "unpacks the TPDO into the drive's words, by the struct of its mapping",
    "command/actual.py": "keeps the words, and makes values of them",
    "image/image.py": "stores what has changed, and marks it for those who follow",
    "northbound/modbus/drive_unit.py": "lays the words out as registers",
    "northbound/modbus/dispatch.py": "finds the unit that is asked",
    "northbound/modbus/pdu.py": "makes the answer's PDU",
    "northbound/modbus/connection.py": "frames the answer and sends it",
    "northbound/zenoh/publication.py": "takes what was marked and somebody subscribes to",
    "northbound/zenoh/keys.py": "writes it as JSON",
    "zenohlink/link.py": "hands it to zenoh's thread, and there to zenoh",
    "zenohlink/publishers.py": "puts it on the key's publisher",
    "zenohlink/worker.py": "is that thread; and the way back from zenoh's threads to the event loop",
    "mirror/publisher.py": "takes what was marked",
    "mirror/protocol.py": "encodes it as MessagePack, and decodes it in the other process",
    "mirror/client.py": "stores it in the other process's image",
    "northbound/opcua/space/data_values.py": "is the node's value: the reading as a DataValue",
}
_OUT: Final = {
    "northbound/modbus/connection.py": "finds the request's frame in the stream",
    "northbound/modbus/dispatch.py": "plans the write with its unit, and submits it",
    "northbound/modbus/pdu.py": "parses the PDU",
    "northbound/modbus/drive_unit.py": "makes requests of the registers",
    "command/plant.py": "finds the drive",
    "command/channel.py": "keeps the state of the drive's leg",
    "command/leg/step.py": "does what the request asks, if it may",
    "command/messages/telegram.py": "decodes names and values into words",
    "command/leg/draft.py": "decides what is sent: these words or a stop",
    "node/process/process_data.py": "packs the words into the RPDO",
    "master/line.py": "compares it with what the bus repeats, and hands it over",
    "can/softbus.py": "sends it, and repeats it",
}
"""What each file does to the value. One that is on a way has to stand here."""
ON_SOCKETCAN: Final = {
    "can/virtual.py": ("can/socketcan.py", "can/receiver.py"),
    "can/softbus.py": ("can/socketcan.py", "can/kernelbursts.py", "can/burstend.py", "can/bcm.py"),
}
"""What stands in the place of the virtual bus there."""


class Bridge:
    """A running bus process with a front, and a client of each protocol."""

    def __init__(self, wire: VirtualWire, ports: dict[str, int]) -> None:
        self._wire = wire
        self._ports = ports
        self._end = wire.end("drive")
        self._end.open(lambda: None)
        endpoint = f"tcp/127.0.0.1:{ports['zenoh']}"
        self._zenoh = zenoh.open(zenoh_config(mode="client", connect=[endpoint]))
        self._opcua = Client(f"opc.tcp://127.0.0.1:{ports['opcua']}")

    async def connect(self) -> None:
        await self._opcua.connect()

    async def close(self) -> None:
        await self._opcua.disconnect()
        await asyncio.to_thread(self._zenoh.close)

    async def report(self, word: int) -> None:
        """Send TPDOs with this actual value until all three protocols show it."""
        shown = asyncio.Event()
        loop = asyncio.get_running_loop()

        def on_sample(sample: zenoh.Sample) -> None:
            if str(word).encode() in sample.payload.to_bytes():
                loop.call_soon_threadsafe(shown.set)

        subscriber = self._zenoh.declare_subscriber(f"drives/ways/{_DRIVE}/actual/value_1", on_sample)
        node = self._opcua.get_node(f"ns=2;s={_DRIVE}/actual/value_1")
        async with asyncio.timeout(_PATIENCE_S):
            while True:
                now = clock.now()
                data = struct.pack("<4H", _SWITCHED_ON_DISABLED, word, 0, 0)
                self._end.send(Frame(_TPDO, data, now), now, now)
                register = await self._modbus(struct.pack(">BHH", 4, 1, 1))
                if shown.is_set() and register[-2:] == struct.pack(">H", word) == await _read(node):
                    break
        subscriber.undeclare()

    async def write(self, word: int) -> None:
        """Write the word as a setpoint, and wait for the RPDO."""
        sent = asyncio.Event()

        def listen(frame: Frame) -> None:
            if frame.can_id == _RPDO and struct.pack("<H", word) in frame.data:
                sent.set()

        self._wire.listeners.append(listen)
        await self._modbus(struct.pack(">BHHB2H", 16, 0, 2, 4, _DISABLED, word))
        await asyncio.wait_for(sent.wait(), _PATIENCE_S)
        self._wire.listeners.remove(listen)

    async def _modbus(self, pdu: bytes) -> bytes:
        reader, writer = await asyncio.open_connection("127.0.0.1", self._ports["modbus"])
        writer.write(struct.pack(">HHHB", 1, 0, len(pdu) + 1, 1) + pdu)
        answer = await reader.read(300)
        writer.close()
        await writer.wait_closed()
        return answer


async def _read(node: Any) -> bytes:
    return struct.pack(">H", await node.read_value())


def _ports() -> dict[str, int]:
    """Free ports of loopback."""
    probes = {name: socket.create_server(("127.0.0.1", 0)) for name in ("modbus", "opcua", "zenoh")}
    ports = {name: int(probe.getsockname()[1]) for name, probe in probes.items()}
    for probe in probes.values():
        probe.close()
    return ports


@asynccontextmanager
async def running(folder: Path) -> AsyncIterator[Bridge]:
    """A bus process with a booted node, and the OPC UA and zenoh servers at the other end of its link."""
    ports = _ports()
    path = folder / "ways.toml"
    path.write_text(_SITE.format(folder=folder, **ports), encoding="utf-8")
    wire = VirtualWire()
    project = load_project(path)
    service = BusProcess(project, lambda table: wire.end(table.name), fronts=())
    booted = asyncio.Event()
    service.plant.on_event(lambda event: booted.set() if event.kind is EventKind.NODE_BACK else None)
    async with AsyncExitStack() as stack:
        for work in (Simulation(wire.end("simulation"), [NordTu4(5)]).run(), service.run()):
            stack.push_async_callback(_end, asyncio.create_task(work))
        await asyncio.wait_for(booted.wait(), _PATIENCE_S)
        site = project.site
        mirror = MirrorClient(socket_endpoint(Path(site.site.runtime_dir), "ways"), clock.now)
        await mirror.open()
        stack.push_async_callback(mirror.close)
        stack.push_async_callback(_end, asyncio.create_task(mirror.run()))
        assert site.opcua is not None and site.zenoh is not None
        opcua = OpcUaServer(mirror, site.opcua, folder, "ways")
        for server in (opcua, ZenohServer(mirror, site.zenoh, "ways", clock.now)):
            await server.start()
            stack.push_async_callback(server.close)
        bridge = Bridge(wire, ports)
        stack.push_async_callback(bridge.close)
        await bridge.connect()
        yield bridge


async def _end(task: asyncio.Task[None]) -> None:
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


async def follow(folder: Path) -> dict[str, dict[str, str]]:
    """For each way its files, with the first function of each that has the value."""
    threads = Threads()
    traces = {word: Trace(word) for word in (_READ, _WRITTEN)}
    with threads.prepared():
        async with running(folder) as bridge:
            # The status is known then, and a telegram is one of many.
            await bridge.report(_READ - 1)
            await bridge.write(_WRITTEN - 1)
            with threads.following(traces[_READ]):
                await bridge.report(_READ)
            with threads.following(traces[_WRITTEN]):
                await bridge.write(_WRITTEN)
    return {name: traces[way.word].steps(way.rests) for name, way in WAYS.items()}


def drawing(ways: dict[str, dict[str, str]]) -> str:
    """What the three ways of a TPDO have in common once, then the rest of each. Raises KeyError for a file of
    which nothing says what it does."""
    read = {name: list(steps.items()) for name, steps in ways.items() if WAYS[name].word == _READ}
    shared = [step for step in next(iter(read.values())) if all(step in steps for steps in read.values())]
    parts = [_list(f"A TPDO into the image: {_counted(file for file, _ in shared)}", shared, _IN)]
    for name, steps in read.items():
        more = [step for step in steps if step not in shared]
        parts.append(
            _list(f"{name}: {len(more)} more, together {_counted(file for file, _ in steps)}", more, _IN)
        )
    parts += [
        _list(f"{name}: {_counted(ways[name])}", ways[name].items(), _OUT) for name in ways.keys() - read
    ]
    return "\n\n".join(parts)


def _counted(files: Iterable[str]) -> str:
    """How many files that are, here and on SocketCAN."""
    found = list(files)
    real = sum(len(ON_SOCKETCAN.get(file, (file,))) for file in found)
    return f"{len(found)} files, {real} on SocketCAN"


def _list(heading: str, steps: Iterable[tuple[str, str]], does: dict[str, str]) -> str:
    lines = [f"{file:<34}{function.replace('.<locals>', ''):<32}{does[file]}" for file, function in steps]
    return "\n".join((f"**{heading}**", "", "```text", *lines, "```"))


def drawn(text: str, ways: dict[str, dict[str, str]]) -> str:
    """``text`` of the page with the ways as they are now. Raises ValueError where the page has no marks."""
    return replaced(text, BEGIN, END, drawing(ways))


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        found = asyncio.run(follow(Path(name)))
    PAGE.write_text(drawn(PAGE.read_text(encoding="utf-8"), found), encoding="utf-8")
    for way, files in found.items():
        print(f"{len(files):3} {way}")
