"""The ASCII gateway (CiA 309-3) at a running bridge, and python-canopen through it, beside asyncua, pymodbus
and a zenoh client in a process of its own."""

from __future__ import annotations

import asyncio
import base64
import random
import socket
import stat
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import canopen
import pytest
from asyncua.client.client import Client
from pymodbus.client import ModbusTcpClient

from bridge.canclient import DrivebridgeBus
from bridge.dictionary import load_dictionary
from bridge.northbound.gateway.cia309_types import TYPES
from tests.support.process import drivebridge, free_port, until
from tests.support.zenoh_peer import zenoh_peer

MAPPING = """
extends = "cia402/velocity"
[family]
name = "press"
[[parameter]]
name = "T1"
object = "2100:00"
title = "table"
data_type = "bytes"
[[parameter]]
name = "T2"
object = "2101:00"
title = "another table"
data_type = "bytes"
"""
SITE = """
[site]
name = "shop"
state_dir = "{folder}/state"
runtime_dir = "{folder}/run"
[[bus]]
name = "can0"
interface = "virtual"
deadman_ms = 1000
gateway = "127.0.0.1:{gateway}"
[[bus.node]]
name = "conveyor"
id = 5
mapping = "nord/sk-tu4-cao"
[[bus.node.drive]]
slot = "fu1"
unit_id = 1
control = "modbus"
fieldbus_timeout_ms = 0
parameters = {{ P105 = 50.0, P112 = 10.0 }}
[[bus.node]]
name = "press"
id = 6
mapping = "press"
[[bus.node.drive]]
slot = "drive"
unit_id = 2
control = "modbus"
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
HOST = "127.0.0.1"
_SET = "[5] 5 w 0x2066 1 i16 103"
"""Carried out by a node in operation alone."""
TABLE = random.Random(1).randbytes(3000)
VALUES = {
    "b": "1",
    **{f"i{bits}": str(-(1 << bits - 1)) for bits in range(8, 65, 8)},
    **{f"u{bits}": str((1 << bits) - 1) for bits in range(8, 65, 8)},
    "r32": "-1.5",
    "r64": "0.1",
    "t": "14936 43200000",
    "td": "2 500",
    "vs": '"a ""press"" # 2"',
    "os": "AAEC/w==",
    "us": "ZADkAA==",
    "d": base64.b64encode(TABLE).decode(),
    "hex": "DE AD 00 BE EF",
}
LSS = (
    "lss_switch_glob 1",
    "lss_switch_sel 1 2 3 4",
    "lss_set_node 7",
    "lss_conf_bitrate 0 2",
    "lss_activate_bitrate 10",
    "lss_store",
    "lss_inquire_addr 0",
    "lss_get_node",
    "lss_identity 1 2 3 4 5 6",
    "lss_ident_nonconf",
    "_lss_fastscan 10",
)


@dataclass(frozen=True)
class Shop:
    folder: Path
    gateway: int
    modbus: int
    opcua: int
    zenoh: int

    @property
    def socket(self) -> Path:
        return self.folder / "run" / "shop-can0.gateway"


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shop]:
    folder = tmp_path_factory.mktemp("shop")
    shop = Shop(folder, *(free_port() for _ in range(4)))
    ports = {name: getattr(shop, name) for name in ("gateway", "modbus", "opcua", "zenoh")}
    (folder / "mappings").mkdir()
    (folder / "mappings" / "press.toml").write_text(MAPPING, encoding="utf-8")
    (folder / "site.toml").write_text(SITE.format(folder=folder, **ports), encoding="utf-8")
    with drivebridge(folder, "shop", "run", str(folder / "site.toml"), notify=True) as process:
        process.wait_ready()
        until(lambda: "OPC UA on" in process.output(), 60.0, "the OPC UA front is up")
        with closing(Tool.at(shop.socket)) as tool:
            for node in (5, 6):
                until(lambda node=node: tool.is_operational(node), 20.0, f"node {node} is operational")
        yield shop


class Tool:
    """Somebody's program at the gateway."""

    def __init__(self, sock: socket.socket) -> None:
        sock.settimeout(20)
        self._sock = sock
        self._file = sock.makefile("rwb")

    @classmethod
    def at(cls, path: Path) -> Tool:
        sock = socket.socket(socket.AF_UNIX)
        sock.connect(str(path))
        return cls(sock)

    def say(self, *lines: str) -> None:
        self._file.write("".join(f"{line}\r\n" for line in lines).encode())
        self._file.flush()

    def hear(self) -> str:
        return self._file.readline().decode().removesuffix("\r\n")

    def ask(self, line: str) -> str:
        self.say(line)
        return self.hear()

    def is_operational(self, node: int) -> bool:
        return not self.ask(f"[1] {node} r 0x1000 0 u32").startswith("[1] ERROR")

    def close(self) -> None:
        self._file.close()
        self._sock.close()


@pytest.fixture
def tool(shop: Shop) -> Iterator[Tool]:
    with closing(Tool.at(shop.socket)) as tool:
        yield tool


def test_the_socket_is_its_users_alone(shop: Shop) -> None:
    assert stat.S_IMODE(shop.socket.stat().st_mode) == 0o600


def test_whoever_comes_by_tcp_reads_and_sets_no_parameters(shop: Shop) -> None:
    with closing(Tool(socket.create_connection((HOST, shop.gateway)))) as tool:
        assert tool.ask("[1] 5 r 0x1001 0 u8") == "[1] 0"
        assert tool.ask("[2] 5 w 0x2066 1 i16 103").startswith("[2] ERROR:0x08000021 #2066h:01: ")


def test_nmt_is_a_request_of_the_bridge(tool: Tool) -> None:
    assert tool.ask("[1] set node 5") == "[1] OK"
    for command in ("preop", "stop", "reset comm", "reset node"):
        assert tool.ask(f"[2] {command}") == "[2] OK"
        if command in ("preop", "stop"):
            asked = tool.ask("[3] r 0x1000 0 u32")
            # A node in Stopped answers no SDO (CiA 301 §7.3.2.2.4).
            assert asked.startswith("[3] ERROR:0x05040000 #") == (command == "stop"), asked
            assert asked.startswith("[3] ERROR") == (command == "stop"), asked
            assert tool.ask(_SET).startswith("[5] ERROR:102 #2066h:01: ")
            assert tool.ask("[4] start") == "[4] OK"
        until(lambda: tool.ask(_SET) == "[5] OK", 20.0, f"operational after {command}")


# a session beside a thousand reads


def every_type(tool: Tool) -> None:
    assert VALUES.keys() == TYPES
    for kind, text in VALUES.items():
        assert tool.ask(f"[1] 6 w 0x2100 0 {kind} {text}") == "[1] OK", kind
        assert tool.ask(f"[2] 6 r 0x2100 0 {kind}") == f"[2] {text}", kind


def errors(tool: Tool) -> None:
    for number, command in enumerate(LSS, 1):
        assert tool.ask(f"[{number}] {command}") == f"[{number}] ERROR:100", command
    for line, code in (
        ("5 set sdo_timeout 100", "106"),
        ("set sdo_timeout 100", "100"),
        ("5 enable guarding 100 3", "100"),
        ("5 rise 1", "101"),
        ("5 w 0x2066 1 i8 300", "101"),
        ("r 0x1000 0", "105"),
        ("2 5 r 0x1000 0", "106"),
        ("9 r 0x1000 0", "107"),
        ("5 r 0x5FFF 0", "0x06020000"),
        ("5 w 0x22BC 1 i16 1", "0x06010002"),
        ("5 w 0x1017 0 u16 0", "0x08000021"),
        ("5 w 0x3000 1 u16 1151", "0x08000021"),
        ("5 r 0x2066 1 i64", "0x06070010"),
    ):
        assert tool.ask(f"[7] {line}").partition(" #")[0] == f"[7] ERROR:{code}", line
    tool.say(*(f"[{number}] 5 r 0x2069 1 i16" for number in range(40)))
    heard = sorted(tool.hear().partition("] ")[2].partition(" #")[0] for _ in range(40))
    assert heard.count("500") >= 8, "as many as may wait"
    assert 0 < heard.count("ERROR:600") == 40 - heard.count("500")


def session(shop: Shop, is_over: Callable[[], bool]) -> int:
    """How often the whole session was gone through while others read."""
    rounds = 0
    with closing(Tool.at(shop.socket)) as tool:
        while not rounds or not is_over():
            every_type(tool)
            errors(tool)
            rounds += 1
    return rounds


def canopen_session(shop: Shop, is_over: Callable[[], bool]) -> int:
    rounds = 0
    network = canopen.Network()
    network.bus = DrivebridgeBus("shop/can0", runtime_dir=str(shop.folder / "run"))
    network.connect()
    try:
        conveyor, press = (
            network.add_node(canopen.RemoteNode(number, load_dictionary(what, number)))
            for number, what in ((5, "nord/sk-tu4-cao"), (6, shop.folder / "mappings" / "press.toml"))
        )
        conveyor.sdo.RESPONSE_TIMEOUT = press.sdo.RESPONSE_TIMEOUT = 10
        conveyor.sdo["P103.1"].phys = 2.5
        while not rounds or not is_over():
            assert (conveyor.sdo["P103.1"].phys, conveyor.sdo["P105.1"].phys) == (2.5, 50.0)
            assert conveyor.sdo.upload(0x1008, 0).startswith(b"SK TU4-CAO")
            with pytest.raises(canopen.SdoAbortedError, match="0x06020000"):
                conveyor.sdo.upload(0x5FFF, 0)
            by_segments, by_blocks = TABLE[:100], TABLE[rounds % 100 :]
            press.sdo["T2"].raw = by_segments
            assert press.sdo["T2"].raw == by_segments
            with press.sdo["T2"].open("wb", size=len(by_blocks), block_transfer=True) as file:
                file.write(by_blocks)
            with press.sdo["T2"].open("rb", block_transfer=True) as file:
                assert file.read() == by_blocks
            rounds += 1
    finally:
        network.disconnect()
    return rounds


def test_python_canopen_hears_what_the_nodes_send(shop: Shop, tool: Tool) -> None:
    network = canopen.Network()
    network.bus = DrivebridgeBus("shop/can0", runtime_dir=str(shop.folder / "run"))
    network.connect()
    try:
        conveyor, press = (
            network.add_node(canopen.RemoteNode(n, canopen.ObjectDictionary())) for n in (5, 6)
        )
        states: list[int] = []
        press.nmt.add_heartbeat_callback(states.append)
        press.nmt.state = "RESET"
        until(lambda: 0 in states, 20.0, "the boot-up of node 6 is heard")
        until(lambda: conveyor.nmt.state == press.nmt.state == "OPERATIONAL", 20.0, "both are operational")
        until(lambda: tool.is_operational(6), 20.0, "the bridge serves node 6 again")
    finally:
        network.disconnect()


async def read_by_opcua(shop: Shop, times: int) -> None:
    async with Client(f"opc.tcp://{HOST}:{shop.opcua}", timeout=10) as client:
        ns = await client.get_namespace_index("urn:drivebridge:points")
        drive = client.get_node(f"ns={ns};s=conveyor/fu1")
        for _ in range(times):
            assert await drive.call_method(f"{ns}:ReadParameter", "P105") == 50.0


async def read_by_zenoh(shop: Shop, times: int) -> None:
    async with zenoh_peer(f"tcp/{HOST}:{shop.zenoh}", mode="client") as peer:
        for _ in range(times):
            answer: dict[str, Any] = await peer.value("drives/shop/conveyor/fu1/parameter/P105")
            assert (answer["v"], answer["q"]) == (50.0, "good"), answer


def read_by_modbus(shop: Shop, times: int) -> None:
    with ModbusTcpClient(HOST, port=shop.modbus, timeout=5) as client:
        for _ in range(times):
            assert not client.read_input_registers(0, count=8, device_id=1).isError()


@pytest.mark.landing
async def test_no_transfer_is_lost_on_either_side(shop: Shop) -> None:
    over = asyncio.Event()
    sessions = (session, canopen_session)
    ours = [asyncio.create_task(asyncio.to_thread(run, shop, over.is_set)) for run in sessions]
    try:
        await asyncio.gather(
            read_by_opcua(shop, 500), read_by_zenoh(shop, 500), asyncio.to_thread(read_by_modbus, shop, 1000)
        )
    finally:
        over.set()
        rounds = await asyncio.gather(*ours)
    assert all(rounds)
