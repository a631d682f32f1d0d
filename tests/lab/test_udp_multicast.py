"""A bus over python-can's ``udp_multicast``, which gives every process its own frames back without a mark."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import can
import pytest
from pymodbus.client import ModbusTcpClient

from tests.support import sites
from tests.support.process import Process, drivebridge, free_port, until

pytestmark = pytest.mark.nightly

GROUP = "239.74.163.2"
HEARTBEAT = 0x77F
PREOPERATIONAL = b"\x7f"
GOOD = 1
PASSIVE, INTRUDER = "another bridge is in charge", "the id seems to be used twice"


@pytest.fixture
def multicast() -> Iterator[None]:
    """The lab's machine has loopback alone, which is no way to a group by itself."""
    route = ["ip", "route", "add", "239.0.0.0/8", "dev", "lo"]
    subprocess.run(route, check=True)
    yield
    subprocess.run([word.replace("add", "del") for word in route], check=True)


@pytest.fixture
def bridge(tmp_path: Path, multicast: None) -> Iterator[tuple[Process, ModbusTcpClient]]:
    port = free_port()
    node = sites.node(sites.drive("fu1", "modbus", 1000, f"unit_id = 1\n{sites.SCALED}"))
    bus = sites.bus(node, interface="udp_multicast", more=f'channel = "{GROUP}"\nbitrate = 1000000')
    path = sites.write(tmp_path, bus, sites.modbus(port))
    with ExitStack() as stack:
        simulation = stack.enter_context(drivebridge(tmp_path, "simulate", "simulate", str(path)))
        simulation.wait_output("simulating")
        run = stack.enter_context(
            drivebridge(tmp_path, "run", "run", str(path), "--role", "bus", notify=True)
        )
        run.wait_ready()
        run.wait_output("node operational")
        client = ModbusTcpClient("127.0.0.1", port=port, timeout=10)
        assert client.connect()
        stack.callback(client.close)
        yield run, client


def test_the_bridge_is_in_charge_though_it_hears_itself(bridge: tuple[Process, ModbusTcpClient]) -> None:
    run, client = bridge

    def quality() -> list[int]:
        answer = client.read_input_registers(11, count=1, device_id=1)
        assert not answer.isError(), answer
        return answer.registers

    until(lambda: quality() == [GOOD], 10.0, "good")
    time.sleep(2.0)
    assert quality() == [GOOD]
    assert not any(text in run.output() for text in (PASSIVE, INTRUDER))
    with can.Bus(interface="udp_multicast", channel=GROUP) as stranger:
        stranger.send(can.Message(arbitration_id=HEARTBEAT, data=PREOPERATIONAL, is_extended_id=False))
        run.wait_output(INTRUDER, 5.0)
