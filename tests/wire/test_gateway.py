"""The ASCII gateway (CiA 309-3) at a running bridge, beside clients of other protocols."""

from __future__ import annotations

import socket
import stat
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient

from tests.support.process import drivebridge, free_port

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
[modbus]
listen = "127.0.0.1:{modbus}"
"""
READS = 1000


@dataclass(frozen=True)
class Shop:
    path: Path
    gateway: int
    modbus: int


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shop]:
    folder = tmp_path_factory.mktemp("shop")
    found = Shop(folder / "run" / "shop-can0.gateway", free_port(), free_port())
    (folder / "site.toml").write_text(
        SITE.format(folder=folder, gateway=found.gateway, modbus=found.modbus), encoding="utf-8"
    )
    with drivebridge(folder, "shop", "run", str(folder / "site.toml"), notify=True) as process:
        process.wait_ready()
        process.wait_output("node operational")
        yield found


class Tool:
    def __init__(self, sock: socket.socket) -> None:
        sock.settimeout(20)
        self._sock = sock
        self._file = sock.makefile("rwb")

    def say(self, *lines: str) -> None:
        self._file.write("".join(f"{line}\r\n" for line in lines).encode())
        self._file.flush()

    def hear(self) -> str:
        return self._file.readline().decode().removesuffix("\r\n")

    def ask(self, line: str) -> str:
        self.say(line)
        return self.hear()

    def close(self) -> None:
        self._file.close()
        self._sock.close()


@pytest.fixture
def tool(shop: Shop) -> Iterator[Tool]:
    sock = socket.socket(socket.AF_UNIX)
    sock.connect(str(shop.path))
    with closing(Tool(sock)) as tool:
        yield tool


def test_a_session(tool: Tool) -> None:
    assert tool.ask("[1] set node 5") == "[1] OK"
    assert tool.ask("[2] r 0x1000 0 u32").startswith("[2] ")
    assert tool.ask("[3] r 0x1008 0 vs").startswith('[3] "')
    assert tool.ask("[4] w 0x2066 1 i16 103") == "[4] OK"
    assert tool.ask("[5] r 0x2066 1 i16") == "[5] 103"
    assert tool.ask("[6] r 0x5FFF 0 u8") == "[6] ERROR:0x06020000"
    assert tool.ask("[7] w 0x1017 0 u16 0") == "[7] ERROR:0x08000021"
    assert tool.ask("[8] w 0x3000 1 u16 1151") == "[8] ERROR:0x08000021"
    assert tool.ask("[9] preop") == "[9] OK"
    assert tool.ask("[10] r 0x1000 0 u32") == "[10] ERROR:102"
    assert tool.ask("[11] start") == "[11] OK"


def test_the_socket_is_its_users_alone(shop: Shop) -> None:
    assert stat.S_IMODE(shop.path.stat().st_mode) == 0o600


def test_whoever_comes_by_tcp_reads_and_sets_no_parameters(shop: Shop) -> None:
    with closing(Tool(socket.create_connection(("127.0.0.1", shop.gateway)))) as tool:
        assert tool.ask("[1] 5 r 0x1001 0 u8") == "[1] 0"
        assert tool.ask("[2] 5 w 0x2066 1 i16 103") == "[2] ERROR:0x08000021"


def test_no_transfer_is_lost_beside_reads_of_another_protocol(shop: Shop, tool: Tool) -> None:
    with ModbusTcpClient("127.0.0.1", port=shop.modbus) as modbus:
        for number in range(READS):
            tool.say(f"[{number}] 5 r 0x2069 1 i16")
            assert not modbus.read_input_registers(0, count=8, device_id=1).isError()
            assert tool.hear() == f"[{number}] 500"
