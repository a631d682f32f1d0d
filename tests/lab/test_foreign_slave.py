"""A slave that we did not write: canopen.LocalNode on real SocketCAN."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient

from tests.lab.sites import lab_site
from tests.support.process import Process, drivebridge, peer, until
from tests.support.sniffer import Seen, Sniffer, sniffing

GOOD, LOST, DEAD = 1, 3, 4
READY, RUNNING = 0x0B31, 0x0B37


class Foreign:
    def __init__(self, bus: Sniffer, slave: Process, bridge: Process, client: ModbusTcpClient) -> None:
        self.bus, self.slave, self.bridge, self._client = bus, slave, bridge, client

    def inputs(self, address: int, count: int = 1) -> list[int]:
        answer = self._client.read_input_registers(address, count=count, device_id=1)
        assert not answer.isError(), answer
        return answer.registers

    def write(self, *words: int) -> None:
        answer = self._client.write_registers(0, list(words), device_id=1)
        assert not answer.isError(), answer

    def until_quality(self, quality: int) -> None:
        until(lambda: self.inputs(11) == [quality], 20.0, f"quality {quality}: {self.bridge.output()}")


@pytest.fixture
def foreign(tmp_path: Path) -> Iterator[Foreign]:
    site = lab_site(tmp_path, timeout_ms=2000, controls=("modbus",))
    with ExitStack() as stack:
        bus = stack.enter_context(sniffing())
        slave = stack.enter_context(peer(tmp_path, "foreign_slave", "vcan0", "5"))
        slave.wait_output("is there")
        arguments = ("run", str(site.path), "--role", "bus", "--role", "zenoh")
        bridge = stack.enter_context(drivebridge(tmp_path, "run", *arguments, notify=True))
        bridge.wait_ready()
        bridge.wait_output("node operational")
        client = ModbusTcpClient("127.0.0.1", port=site.modbus_port, timeout=10)
        assert client.connect()
        stack.callback(client.close)
        yield Foreign(bus, slave, bridge, client)


def within(seconds: float, condition: Callable[[], bool], what: str) -> None:
    until(condition, seconds, what)


def resets(bus: Sniffer, since: float) -> list[Seen]:
    """The NMT commands "reset communication" since that time."""
    return [frame for frame in bus.of(0, since) if frame.data[:1] == b"\x82"]


def test_it_is_booted_supervised_read_written_and_exchanges_pdos(foreign: Foreign) -> None:
    # written by SDO: its heartbeat producer; read by SDO: identity and name
    heartbeats = [frame for frame in foreign.bus.of(0x705) if frame.data == b"\x05"]
    within(5.0, lambda: len(foreign.bus.of(0x705)) > 5, "heartbeats")
    assert bytes.fromhex("2B17100042000000") in [frame.data for frame in foreign.bus.of(0x605)]
    assert bytes.fromhex("6017100000000000") in [frame.data for frame in foreign.bus.of(0x585)]
    assert heartbeats, "it was heard before it counted as operational"
    # exchanged: RPDO and TPDO
    foreign.write(0x047E, 0, 0, 0)
    within(5.0, lambda: foreign.inputs(0) == [READY], "ready to switch on")
    foreign.write(0x047F, 0x2000, 0, 0)
    within(5.0, lambda: foreign.inputs(0, 2) == [RUNNING, 0x2000], "runs at its setpoint")
    foreign.write(0x047E, 0, 0, 0)
    within(5.0, lambda: foreign.inputs(0, 2) == [READY, 0], "stands")


@pytest.mark.landing
def test_one_that_keeps_an_error_is_back_by_itself(tmp_path: Path) -> None:
    """One SYNC of two bytes, and it refuses Operational until its communication is reset."""
    site = lab_site(tmp_path, timeout_ms=2000, controls=("modbus",), bus='on_intruder = "report"')
    with ExitStack() as stack:
        bus = stack.enter_context(sniffing())
        slave = stack.enter_context(peer(tmp_path, "foreign_slave", "vcan0", "5", "latches"))
        slave.wait_output("is there")
        arguments = ("run", str(site.path), "--role", "bus", "--role", "zenoh")
        bridge = stack.enter_context(drivebridge(tmp_path, "run", *arguments, notify=True))
        bridge.wait_ready()
        bridge.wait_output("node operational")
        begun = time.time()
        bus.send(0x80, b"\0\0")
        bridge.wait_output("1001h is 11h (generic error, communication), 1003h: 8240h", 30.0)
        bridge.wait_output("reset communication by the bridge, once", 30.0)
        # What is said of a round may be read before the round's frames are.
        within(5.0, lambda: bool(resets(bus, begun)), "the reset is on the bus")
        within(
            20.0,
            lambda: any(frame.data == b"\x05" for frame in bus.of(0x705, resets(bus, begun)[0].time)),
            "operational again",
        )
        assert [frame.data for frame in resets(bus, begun)] == [b"\x82\x05"], "once, and this node alone"


@pytest.mark.landing
def test_it_is_lost_when_it_dies_and_back_when_it_is_back(foreign: Foreign, tmp_path: Path) -> None:
    foreign.write(0x047E, 0, 0, 0)
    within(5.0, lambda: foreign.inputs(11) == [GOOD], "good")
    foreign.slave.popen.kill()
    died = time.time()
    foreign.until_quality(LOST)
    assert foreign.bus.of(0x205, died), "stopped words go on"
    foreign.until_quality(DEAD)
    with peer(tmp_path, "foreign_slave", "vcan0", "5"):
        foreign.bridge.wait_output("E010/10.9")
        within(20.0, lambda: foreign.bridge.output().count("node operational") == 2, "booted again")
        # Its controller was silent meanwhile: acknowledge first.
        foreign.write(0x04FE, 0, 0, 0)
        foreign.write(0x047E, 0, 0, 0)
        within(5.0, lambda: foreign.inputs(0, 1) == [READY], "ready to switch on")
