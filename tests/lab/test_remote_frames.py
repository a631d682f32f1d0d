"""TPDOs that come on a remote frame only (types 252 and 253), from a slave that we did not write."""

from __future__ import annotations

import time
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient

from tests.lab.sites import lab_site
from tests.support.process import drivebridge, peer, until
from tests.support.sniffer import sniffing

ASKED = 0x4000_0185
TPDO = 0x185
ASKED_EVERY_S = 0.1
GOOD, STALE = 1, 2
READY, RUNNING = 0x0B31, 0x0B37


@pytest.mark.landing
def test_a_tpdo_of_type_253_is_asked_for_and_read_and_stale_where_no_answer_comes(tmp_path: Path) -> None:
    site = lab_site(
        tmp_path, timeout_ms=2000, controls=("modbus",), node='supervision = "none"\nhold_ms = 60000'
    )
    with ExitStack() as stack:
        bus = stack.enter_context(sniffing())
        slave = stack.enter_context(peer(tmp_path, "foreign_slave", "vcan0", "5", "asked"))
        slave.wait_output("is there")
        arguments = ("run", str(site.path), "--role", "bus", "--role", "zenoh")
        bridge = stack.enter_context(drivebridge(tmp_path, "run", *arguments, notify=True))
        bridge.wait_ready()
        bridge.wait_output("node operational")
        client = ModbusTcpClient("127.0.0.1", port=site.modbus_port, timeout=10)
        assert client.connect()
        stack.callback(client.close)

        def inputs(address: int, count: int = 1) -> list[int]:
            answer = client.read_input_registers(address, count=count, device_id=1)
            assert not answer.isError(), answer
            return answer.registers

        def write(*words: int) -> None:
            assert not client.write_registers(0, list(words), device_id=1).isError()

        until(lambda: inputs(11) == [GOOD], 10.0, "good")
        write(0x047E, 0, 0, 0)
        until(lambda: inputs(0) == [READY], 5.0, "ready to switch on")
        write(0x047F, 0x2000, 0, 0)
        until(lambda: inputs(0, 2) == [RUNNING, 0x2000], 5.0, "runs at its setpoint")
        assert inputs(11) == [GOOD]

        since = time.time()
        time.sleep(1.0)
        asked = [frame.time for frame in bus.of(ASKED, since)]
        assert len(asked) > 5
        assert sum(b - a for a, b in pairwise(asked)) / (len(asked) - 1) == pytest.approx(
            ASKED_EVERY_S, rel=0.3
        )
        answers = bus.of(TPDO)
        assert answers
        assert len(answers) <= len(bus.of(ASKED)), "nothing comes that was not asked for"

        slave.popen.kill()
        until(lambda: inputs(11) == [STALE], 5.0, "stale")
        killed = time.time()
        until(lambda: len(bus.of(ASKED, killed)) > 3, 5.0, "asked again all the same")
