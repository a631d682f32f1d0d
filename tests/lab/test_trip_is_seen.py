"""A controller that fell silent is seen in all three protocols, whoever it was."""

from __future__ import annotations

import asyncio
import signal
import time
from pathlib import Path

from asyncua import Client
from pymodbus.client import ModbusTcpClient

from tests.lab.sites import LabSite, ask, lab_site
from tests.support.process import drivebridge, peer, until
from tests.support.sniffer import sniffing

TPDO1 = 0x185
FAULT = 0x08
TRIPPED = 3


async def test_e010_10_3_is_visible_by_modbus_opcua_and_zenoh(tmp_path: Path) -> None:
    site = lab_site(tmp_path, timeout_ms=200, bus="deadman_ms = 400")
    with (
        drivebridge(tmp_path, "simulate", "simulate", str(site.path)),
        drivebridge(tmp_path, "run", "run", str(site.path), notify=True) as bridge,
        sniffing() as bus,
    ):
        bridge.wait_output("node operational")
        bridge.wait_output("OPC UA on")
        arguments = (str(site.modbus_port), "1", "0.05", str(tmp_path / "stamps"), "0x047F", "0x2000")
        with peer(tmp_path, "modbus_owner", *arguments) as owner:
            owner.wait_output("it runs", 30.0)
            owner.signal(signal.SIGSTOP)
            until(lambda: bus.of(TPDO1)[-1].word & 0x04 == 0, 10.0, "the drive has stopped")
            by_modbus(site)
            await by_opcua(site)
            by_zenoh(site)


def by_modbus(site: LabSite) -> None:
    client = ModbusTcpClient("127.0.0.1", port=site.modbus_port, timeout=10)
    assert client.connect()
    words = client.read_input_registers(0, count=21, device_id=1).registers
    client.close()
    assert words[0] & 0x4F == FAULT, "the served status word says fault"
    assert words[9] & 0x4F != FAULT, "the drive's own does not: it was stopped in time"
    assert words[13] == 103
    assert words[14] == TRIPPED


async def by_opcua(site: LabSite) -> None:
    async with Client(site.opcua_url, timeout=20) as client:
        namespace = await client.get_namespace_index("urn:drivebridge:points")

        async def value(name: str) -> object:
            return await client.get_node(f"ns={namespace};s=conveyor/fu1/{name}").read_value()

        # It is another process with a mirror of the values, which may be a few ms behind.
        end = time.monotonic() + 5.0
        while await value("supervision/last_fault") != 10.3:
            assert time.monotonic() < end, "the front never hears of the fault"
            await asyncio.sleep(0.02)
        assert await value("supervision/watchdog_state") == TRIPPED
        assert str(await value("status/fault_text")).startswith("E010/10.3")


def by_zenoh(site: LabSite) -> None:
    keys = [f"drives/lab/conveyor/fu1/{leaf}=" for leaf in ("supervision/last_fault", "status/state")]
    [[fault], [state]] = ask(site, *keys)
    assert fault["v"] == 10.3
    assert state["s"] == "fault"
