"""Outputs of a node that we did not write, on real SocketCAN: their stop is read back from it."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient

from tests.support.process import Process, drivebridge, free_port, peer, until
from tests.support.sniffer import Sniffer, sniffing

NODE, VALVES = 20, 0x81
UNIT, STOP = 1, 13
BOUND_S = 0.26
"""One RPDO period of 10 ms, and 250 ms."""
NOISE_S = 1.0
MAPPING = """\
extends = "generic/device"
[family]
name = "I/O block"
vendor = "Acme"
source = "CiA 401"

[[output]]
name = "valves"
object = "6200:01"
data_type = "uint8"
"""
SITE = """\
[site]
name = "hall"
[[bus]]
name = "can0"
interface = "socketcan"
channel = "vcan0"
[[bus.node]]
name = "io"
id = 20
mapping = "acme/io"
unit_id = 1
[bus.node.outputs]
control = "modbus"
fieldbus_timeout_ms = 2000
[modbus]
listen = "127.0.0.1:{port}"
"""


class Block:
    """A bridge that commands it, its valves open."""

    def __init__(self, folder: Path, stack: ExitStack, *how: str) -> None:
        mapping = folder / "mappings" / "acme" / "io.toml"
        mapping.parent.mkdir(parents=True)
        mapping.write_text(MAPPING, encoding="utf-8")
        site, port = folder / "site.toml", free_port()
        site.write_text(SITE.format(port=port), encoding="utf-8")
        self.bus: Sniffer = stack.enter_context(sniffing())
        slave = stack.enter_context(peer(folder, "output_slave", "vcan0", str(NODE), *how))
        slave.wait_output("is there")
        arguments = ("run", str(site), "--role", "bus", "--role", "zenoh")
        self.bridge: Process = stack.enter_context(drivebridge(folder, "run", *arguments, notify=True))
        self.bridge.wait_ready()
        self.bridge.wait_output("node operational")
        self._client = ModbusTcpClient("127.0.0.1", port=port, timeout=10)
        assert self._client.connect()
        stack.callback(self._client.close)
        self.write(32, 0)
        self.write(32, VALVES)
        until(lambda: self.sent(VALVES), 5.0, "open valves")

    def write(self, register: int, value: int) -> None:
        answer = self._client.write_registers(register, [value], device_id=UNIT)
        assert not answer.isError(), answer

    def sent(self, value: int, since: float = 0.0) -> list[float]:
        return [frame.time for frame in self.bus.of(0x200 + NODE, since) if frame.data == bytes((value,))]

    def nmt_stops(self, since: float = 0.0) -> list[float]:
        return [frame.time for frame in self.bus.of(0x000, since) if frame.data == bytes((2, NODE))]

    def reads(self, since: float) -> int:
        read = bytes.fromhex("4000620100000000")
        return sum(frame.data == read for frame in self.bus.of(0x600 + NODE, since))


Open = Callable[..., Block]


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Open]:
    with ExitStack() as stack:
        yield lambda *how: Block(tmp_path, stack, *how)


def test_a_stop_is_read_back_once(opened: Open) -> None:
    block = opened()
    since = time.time()
    block.write(STOP, 1)
    until(lambda: block.reads(since), 5.0, "the read")
    time.sleep(2 * BOUND_S)
    assert (block.reads(since), block.nmt_stops(since)) == (1, [])
    assert "ignores its stop" not in block.bridge.output()


@pytest.mark.landing
def test_a_valve_that_sticks_is_named_and_its_node_stopped(opened: Open) -> None:
    block = opened("deaf")
    since = time.time()
    block.write(STOP, 1)
    block.bridge.wait_output("6200h:01 (valves) holds 81h instead of 00h; NMT stop of io", 10.0)
    until(lambda: block.nmt_stops(since), 5.0, "NMT stop")
    (stopped,) = block.nmt_stops(since)
    took_s = stopped - block.sent(0, since)[0]
    assert BOUND_S <= took_s <= BOUND_S + NOISE_S


@pytest.mark.landing
def test_a_node_that_does_not_let_them_be_read_is_not_accused_and_named_at_the_end(opened: Open) -> None:
    block = opened("secret")
    since = time.time()
    block.write(STOP, 1)
    time.sleep(3 * BOUND_S)
    assert (block.reads(since), block.nmt_stops(since)) == (2, [])
    block.bridge.signal(signal.SIGTERM)
    block.bridge.popen.wait(15)
    assert "known to be followed: io (the node does not let 6200h:01 be read" in block.bridge.output()
