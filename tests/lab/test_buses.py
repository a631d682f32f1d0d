"""Two buses in one service, and a bus on which somebody babbles."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient

from tests.lab.test_dead_man import CYCLE_S, NOISE_S
from tests.support import sites
from tests.support.process import Process, drivebridge, free_port, until
from tests.support.sniffer import Sniffer, sniffing

GOOD, LOST = 1, 3
TIMEOUT_S = 1.0


class Lab:
    def __init__(self, bridge: Process, wires: list[Sniffer], client: ModbusTcpClient) -> None:
        self.bridge, self.wires, self._client = bridge, wires, client

    def inputs(self, unit: int, address: int, count: int = 1) -> list[int]:
        answer = self._client.read_input_registers(address, count=count, device_id=unit)
        assert not answer.isError(), answer
        return answer.registers

    def write(self, unit: int, *words: int) -> None:
        answer = self._client.write_registers(0, list(words), device_id=unit)
        assert not answer.isError(), answer


def bus(number: int) -> str:
    """One drive, Modbus unit 1 on can0 and 2 on can1."""
    drive = sites.drive("fu1", "modbus", 1000, f"unit_id = {number + 1}\n{sites.SCALED}")
    node = sites.node(drive, name=f"node{number}")
    return sites.socketcan(node, number=number, more="sync_counter = 8\ntime_period_s = 1")


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    port = free_port()
    path = sites.write(tmp_path, *(bus(number) for number in range(2)), sites.modbus(port), name="lab")
    with ExitStack() as stack:
        wires = [stack.enter_context(sniffing(f"vcan{n}")) for n in range(2)]
        simulation = stack.enter_context(drivebridge(tmp_path, "simulate", "simulate", str(path)))
        simulation.wait_output("simulating")
        bridge = stack.enter_context(
            drivebridge(tmp_path, "run", "run", str(path), "--role", "bus", "--role", "zenoh", notify=True)
        )
        bridge.wait_ready()
        until(lambda: bridge.output().count("node operational") == 2, 30.0, "both nodes operational")
        client = ModbusTcpClient("127.0.0.1", port=port, timeout=10)
        assert client.connect()
        stack.callback(client.close)
        lab = Lab(bridge, wires, client)
        for unit in (1, 2):
            lab.write(unit, 0x047E, 0, 0, 0)
            until(lambda unit=unit: lab.inputs(unit, 11) == [GOOD], 10.0, f"unit {unit} is good")
        yield lab
        ip("vcan1", "up")


def ip(channel: str, state: str) -> None:
    subprocess.run(["ip", "link", "set", channel, state], check=True)


def test_a_bus_that_goes_down_leaves_the_other_untouched(lab: Lab) -> None:
    begin = time.time()
    ip("vcan1", "down")
    until(lambda: lab.inputs(2, 11) == [LOST], 5.0, "the drive on can1 is lost")
    assert lab.inputs(1, 11) == [GOOD]
    lab.bridge.wait_output("bus can1 is down: interface vcan1 is down", 5.0)
    time.sleep(1.0)
    ip("vcan1", "up")
    until(lambda: lab.inputs(2, 11) == [GOOD], 20.0, f"can1 is back: {lab.bridge.output()}")
    # Making and unmaking interfaces stalls a machine with one slow CPU now and then, hence not all of them.
    syncs = lab.wires[0].of(0x080, begin)
    assert len(syncs) > 0.5 * (time.time() - begin) / CYCLE_S
    assert "node0: node lost" not in lab.bridge.output()


def test_sync_counts_and_time_is_told_on_both(lab: Lab) -> None:
    time.sleep(1.5)
    for wire in lab.wires:
        syncs = wire.of(0x080)
        assert {sync.data[0] for sync in syncs} == set(range(1, 9))
        # A bridge whose round came so late that its burst may have ended begins anew, and says so.
        was_late = "ms late" in lab.bridge.output()
        for before, after in pairwise(syncs):
            following = {before.data[0] % 8 + 1} | ({1} if was_late else set())
            assert after.data[0] in following
        stamps = wire.of(0x100)
        assert stamps
        days = (time.time() - 441_763_200) // 86_400
        assert int.from_bytes(stamps[-1].data[4:], "little") == days


def test_a_babbling_node_delays_neither_watchdog_nor_sync_and_fills_no_log(lab: Lab) -> None:
    """Emergencies, heartbeats and TPDOs of the wrong length of node 5, as fast as this machine can."""
    wire = lab.wires[0]
    until(lambda: lab.inputs(1, 0)[0] & 0x7F == 0x31, 5.0, "ready")
    lab.write(1, 0x047F, 0x1000, 0, 0)
    last = time.time()
    end, sent = time.monotonic() + TIMEOUT_S + 1.5, 0
    while time.monotonic() < end:
        for _ in range(20):
            wire.send(0x085, bytes((sent & 0xFF, 0x10, 0x11, 0, 0, 0, 0, 0)))
            wire.send(0x185, b"\x31\x0b")
            wire.send(0x705, b"\x05")
            sent += 3
        time.sleep(0.01)
    # On a slow machine the sniffer still has frames to read.
    until(lambda: any(not f.word & 0x0002 for f in wire.of(0x205, last + 0.1)), 10.0, "a stop is seen")
    stopped = next(f for f in wire.of(0x205, last + 0.1) if not f.word & 0x0002)
    assert TIMEOUT_S - 0.05 <= stopped.time - last <= TIMEOUT_S + 0.05 + NOISE_S
    syncs = [frame.time for frame in wire.of(0x080, last)]
    assert max(after - before for before, after in pairwise(syncs)) < NOISE_S
    lines = lab.bridge.output().splitlines()
    assert sent > 1000
    assert len(lines) < 120, "\n".join(lines[-30:])
