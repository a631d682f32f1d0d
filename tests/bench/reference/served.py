"""What both reference bridges serve, and how their libraries are started: by the libraries' documentation.

The plant is that of ``tests/peers/traffic.py``. Names, registers and keys are those of drivebridge, so that
the same clients can watch all three.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import signal
import socket
import struct
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import canopen
import zenoh
from asyncua import Node, Server, ua
from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from tests.bench.pair import PairCan

EDS = Path(__file__).resolve().parents[3] / "mappings" / "nord" / "sk-tu4-cao.eds"
HEARTBEAT_MS = 100
INPUT_REGISTERS = 4
"""The function code by which pymodbus names the table."""
COMMANDS = ("control_word", "setpoint_1", "setpoint_2", "setpoint_3")
_REGISTERS = 100
_WRITES = (6, 16)


@dataclass(frozen=True, slots=True)
class Point:
    """A value of a drive: its name, where it is in the input registers, and how it follows from the words."""

    name: str
    register: int
    word: int
    scale: float | None = None

    def value(self, words: list[int]) -> int | float:
        word = words[self.word]
        if self.scale is None:
            return word
        return (word - 0x10000 if word & 0x8000 else word) * self.scale

    def registers(self, value: int | float) -> list[int]:
        return [int(value)] if self.scale is None else list(struct.unpack(">HH", struct.pack(">f", value)))

    def data_value(self, value: int | float) -> ua.DataValue:
        kind = ua.VariantType.UInt16 if self.scale is None else ua.VariantType.Double
        return ua.DataValue(ua.Variant(value, kind))


POINTS = (
    Point("status/status_word", 0, 0),
    Point("actual/value_1", 1, 1),
    Point("actual/value_2", 2, 2),
    Point("actual/value_3", 3, 3),
    Point("actual/frequency", 32, 1, 50.0 / 0x4000),
    Point("actual/current", 34, 2, 10.0 / 0x4000),
)


@dataclass(slots=True)
class Drive:
    """fu1 of a node, and where its values go."""

    number: int
    node: canopen.RemoteNode
    variables: dict[str, Node] = field(default_factory=dict[str, Node])

    @property
    def name(self) -> str:
        return f"n{self.number}/fu1"

    def key(self, point: str) -> str:
        return f"drives/bench/{self.name}/{point}"

    def command(self, first: int, words: list[int]) -> None:
        """Send an RPDO in which these words are new."""
        rpdo = self.node.rpdo[1]
        for place, word in enumerate(words, first):
            rpdo[place].raw = word
        rpdo.transmit()


def words_of(message: canopen.pdo.base.PdoMap) -> list[int]:
    return [variable.raw & 0xFFFF for variable in message]


def drives_on(network: canopen.Network, count: int) -> list[Drive]:
    drives: list[Drive] = []
    for number in range(1, count + 1):
        node = network.add_node(number, str(EDS))
        node.tpdo.read(from_od=True)
        node.rpdo.read(from_od=True)
        drives.append(Drive(number, node))
    return drives


def start_nodes(drives: list[Drive]) -> None:
    for drive in drives:
        drive.node.sdo[0x1017].raw = HEARTBEAT_MS
        drive.node.nmt.state = "OPERATIONAL"


BeforeRead = Callable[[Drive, list[int]], None]


async def opcua_server(port: int, drives: list[Drive]) -> Server:
    """Give each drive its variables; what clients write into those of its command is an RPDO."""
    server = Server()
    await server.init()
    server.set_endpoint(f"opc.tcp://127.0.0.1:{port}/drivebridge")
    space = await server.register_namespace("urn:drivebridge:points")
    handler = _Written()
    subscription = await server.create_subscription(10, handler)
    for drive in drives:
        folder = await server.nodes.objects.add_folder(space, drive.name)
        for point in POINTS:
            where = ua.NodeId(f"{drive.name}/{point.name}", space)
            first = point.data_value(point.value([0] * 4)).Value
            drive.variables[point.name] = await folder.add_variable(where, point.name, first)
        for place, command in enumerate(COMMANDS):
            where = ua.NodeId(f"{drive.name}/command/{command}", space)
            variable = await folder.add_variable(where, command, ua.Variant(0, ua.VariantType.UInt16))
            await variable.set_writable()
            handler.places[variable.nodeid] = drive, place
            await subscription.subscribe_data_change(variable)
    return server


class _Written:
    """asyncua's way to hear of writes: a subscription of the server's own."""

    def __init__(self) -> None:
        self.places: dict[ua.NodeId, tuple[Drive, int]] = {}
        self._seen: set[ua.NodeId] = set()

    def datachange_notification(self, node: Node, value: int, data: object) -> None:
        if node.nodeid in self._seen:
            drive, place = self.places[node.nodeid]
            drive.command(place, [value])
        self._seen.add(node.nodeid)  # the first is the value that it is made with


def modbus_server(port: int, drives: list[Drive], before_read: BeforeRead | None = None) -> ModbusTcpServer:
    """A device for each drive: what clients write into its holding registers is an RPDO. ``before_read`` may
    bring the drive's input registers up to date."""
    devices = [_device(drive, before_read) for drive in drives]
    return ModbusTcpServer(devices, address=("127.0.0.1", port))


def _device(drive: Drive, before_read: BeforeRead | None) -> SimDevice:
    async def action(
        function: int, start: int, address: int, count: int, registers: list[int], values: list[int] | None
    ) -> ExcCodes | None:
        if function == INPUT_REGISTERS and before_read:
            before_read(drive, registers)
        elif values and function in _WRITES and address + count <= len(COMMANDS):
            drive.command(address, values)
        return None

    bits = [SimData(0, values=False, count=16, datatype=DataType.BITS)]
    tables = (*([SimData(0, count=_REGISTERS, datatype=DataType.REGISTERS)] for _ in range(2)),)
    return SimDevice(drive.number, simdata=(bits, list(bits), *tables), action=action)


def zenoh_session(port: int, drives: list[Drive]) -> zenoh.Session:
    """A peer that answers commands: a query with words by name is an RPDO for each."""
    config = zenoh.Config()
    config.insert_json5("mode", '"peer"')
    config.insert_json5("listen/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/gossip/enabled", "false")
    session = zenoh.open(config)

    def commanding(drive: Drive) -> Callable[[zenoh.Query], None]:
        def on_query(query: zenoh.Query) -> None:
            words = json.loads(query.payload.to_string()) if query.payload else {}
            for name, word in words.items():
                drive.command(COMMANDS.index(name), [word])
            query.reply(query.key_expr, '{"ok": true}')

        return on_query

    for drive in drives:
        session.declare_queryable(drive.key("command"), commanding(drive))
    return session


@contextlib.contextmanager
def connected(channel: str) -> Iterator[canopen.Network]:
    """canopen's network on an interface, or on one end of a pair of sockets."""
    number = channel.removeprefix("fd:").partition(",")[0]
    if number == channel:
        network = canopen.Network()
        network.connect(interface="socketcan", channel=channel)
    else:
        network = canopen.Network(PairCan(socket.socket(fileno=int(number))))
        network.connect()
    try:
        yield network
    finally:
        network.disconnect()


def until_terminated(work: Callable[[], Awaitable[None]]) -> None:
    """Run ``work`` until SIGTERM."""

    async def run() -> None:
        task = asyncio.ensure_future(work())
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)
        with contextlib.suppress(asyncio.CancelledError):
            await task

    asyncio.run(run())
