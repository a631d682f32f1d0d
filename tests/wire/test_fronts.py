"""The OPC UA front as a process of its own: it may die, and nothing else does."""

from __future__ import annotations

import asyncio
import csv
import os
import signal
import subprocess
import time
from datetime import UTC, datetime
from pathlib import Path

import pytest
from asyncua import Client, ua
from asyncua.client.ua_file import UaFile
from pymodbus.client import AsyncModbusTcpClient

from tests.support import sites
from tests.support.process import Process, drivebridge, free_port, only_demo, until

BACK_S = 5.0
NOISE_S = 5.0
KEPT_S = 3.0
"""Until the state of the alarms is in its file."""
"""A machine that is busy with other things."""
KEEP_ALIVE, UNIT = 10, 1
STATE = "conveyor/fu1/supervision/watchdog_state"
OPERATION_ENABLED, NO_VOLTAGE = 4, 0x0474
"""A state as Modbus numbers it, and a control word of NORD's (BU 2500 §6.8)."""


def children(pid: int) -> list[int]:
    found = subprocess.run(["pgrep", "-P", str(pid)], capture_output=True, text=True, check=False)
    return [int(child) for child in found.stdout.split()]


async def device_name(url: str) -> str:
    async with Client(url, timeout=10) as client:
        namespace = await client.get_namespace_index("urn:drivebridge:points")
        return await client.get_node(f"ns={namespace};s=conveyor/fu1/identity/device_name").read_value()


@pytest.fixture
def ports() -> tuple[int, int]:
    return free_port(), free_port()


def start(folder: Path, ports: tuple[int, int]) -> Path:
    node = sites.node(sites.drive("fu1", "modbus", 2000, f"unit_id = 1\n{sites.SCALED}"))
    bus = sites.bus(node, more="deadman_ms = 500")
    return sites.write(folder, bus, sites.modbus(ports[0]), sites.opcua(ports[1]))


def starts(bridge: Process) -> int:
    """How often the front has started to serve."""
    return bridge.output().count("INFO    OPC UA on")


def wait_for_front(bridge: Process) -> None:
    until(lambda: starts(bridge) == 1, 30.0, "the front serves")


async def test_a_killed_front_is_back_and_the_drive_never_noticed(
    tmp_path: Path, ports: tuple[int, int]
) -> None:
    path = start(tmp_path, ports)
    with drivebridge(tmp_path, "run", "run", str(path), notify=True) as bridge:
        bridge.wait_ready()
        bridge.wait_output("node operational")
        wait_for_front(bridge)
        url = f"opc.tcp://127.0.0.1:{ports[1]}"
        assert await device_name(url) == "SK TU4-CAO"
        plc = AsyncModbusTcpClient("127.0.0.1", port=ports[0])
        assert await plc.connect()
        for words in ([0x047E, 0], [0x047F, 0x2000]):
            assert not (await plc.write_registers(0, words, device_id=UNIT)).isError()
        [front] = children(bridge.pid)
        os.kill(front, signal.SIGKILL)
        killed = time.monotonic()
        while starts(bridge) < 2:
            answer = await plc.write_register(KEEP_ALIVE, 1, device_id=UNIT)
            assert not answer.isError(), "the controller goes on meanwhile"
            assert time.monotonic() - killed <= BACK_S + NOISE_S, bridge.output()
            time.sleep(0.05)  # noqa: ASYNC251 - nothing else runs in this loop
        assert await device_name(url) == "SK TU4-CAO"
        inputs = (await plc.read_input_registers(0, count=21, device_id=UNIT)).registers
        assert inputs[0] & 0x6F == 0x27, "still running"
        plc.close()
        assert "hung" not in bridge.output()


@pytest.mark.landing
async def test_a_trip_is_in_the_history_after_a_restart_of_front_and_service(
    tmp_path: Path, ports: tuple[int, int]
) -> None:
    path = start(tmp_path, ports)
    with path.open("a") as file:
        file.write("[opcua.history]\nafter_s = 0\n")
    silent = "modbus:127.0.0.1 was silent for 2000 ms"
    url = f"opc.tcp://127.0.0.1:{ports[1]}"

    async def past() -> tuple[list[str], bytes]:
        """Messages of the drive's events, and its newest black box."""
        async with Client(url, timeout=10) as client:
            space = await client.get_namespace_index("urn:drivebridge:points")
            drive = client.get_node(f"ns={space};s=conveyor/fu1")
            events = await drive.read_event_history(datetime(2020, 1, 1, tzinfo=UTC), None, 1000)
            async with UaFile(client.get_node(f"ns={space};s=conveyor/fu1/BlackBox/1"), "r") as file:
                return [event.Message.Text for event in events], await file.read()

    with drivebridge(tmp_path, "run", "run", str(path), notify=True) as bridge:
        bridge.wait_ready()
        bridge.wait_output("node operational")
        wait_for_front(bridge)
        plc = AsyncModbusTcpClient("127.0.0.1", port=ports[0])
        assert await plc.connect()
        for words in ([0x047E, 0], [0x047F, 0x2000]):
            assert not (await plc.write_registers(0, words, device_id=UNIT)).isError()
        bridge.wait_output("was silent for 2000 ms")
        plc.close()
        before, table = await past()
        while not any("Its controller fell silent" in message for message in before):
            await asyncio.sleep(0.2)
            before, table = await past()
        # A front that is killed before the alarm is in its file tells it again.
        await asyncio.sleep(KEPT_S)
        assert any(silent in message for message in before), before
        rows = list(csv.DictReader(table.decode("utf-8-sig").splitlines()))
        assert float(rows[-1]["conveyor/fu1/actual/frequency [Hz]"]) > 0
        [front] = children(bridge.pid)
        os.kill(front, signal.SIGKILL)
        until(lambda: starts(bridge) == 2, 30.0, "the front serves again")
        assert await past() == (before, table)
    with drivebridge(tmp_path, "again", "run", str(path), notify=True) as bridge:
        bridge.wait_ready()
        wait_for_front(bridge)
        after, same = await past()
        assert after[: len(before)] == before
        assert same == table


@pytest.mark.landing
async def test_after_good_nobody_reads_the_value_of_before(tmp_path: Path, ports: tuple[int, int]) -> None:
    node = sites.node(sites.drive("fu1", "lease", 5000))
    path = sites.write(tmp_path, sites.bus(node, more="deadman_ms = 500"), sites.opcua(ports[1]))
    with drivebridge(tmp_path, "run", "run", str(path), notify=True) as bridge:
        bridge.wait_ready()
        bridge.wait_output("node operational")
        wait_for_front(bridge)
        async with Client(f"opc.tcp://127.0.0.1:{ports[1]}", timeout=10, watchdog_intervall=10) as client:
            space = await client.get_namespace_index("urn:drivebridge:points")

            async def shown(name: str) -> object:
                return await client.get_node(f"ns={space};s=conveyor/fu1/{name}").read_value()

            async def call(method: str, *arguments: ua.Variant) -> None:
                drive = client.get_node(f"ns={space};s=conveyor/fu1")
                await drive.call_method(f"{space}:{method}", *arguments)

            await call("TakeControl", ua.Variant(600_000, ua.VariantType.UInt32))
            assert await shown("supervision/owner") == "opcua:anonymous"
            setpoint = client.get_node(f"ns={space};s=conveyor/fu1/command/setpoint_1")
            for value in range(100):
                await setpoint.write_value(ua.DataValue(ua.Variant(value, ua.VariantType.UInt16)))
                assert await shown("command/setpoint_1") == value
            for _ in range(3):
                await call("Start", ua.Variant(0, ua.VariantType.Int32))
                assert await shown("status/state") == OPERATION_ENABLED
                await call("DisableVoltage")
                assert await shown("supervision/sent_control_word") == NO_VOLTAGE
            await call("ReleaseControl")
            assert await shown("supervision/owner") == ""


class LastWords:
    """What a client of the OPC UA front was told while the service ended."""

    def __init__(self) -> None:
        self.told: list[str] = []

    def datachange_notification(self, node: object, value: object, data: object) -> None:
        self.told.append(f"level {value}" if isinstance(value, int) else "good")

    def status_change_notification(self, status: object) -> None:
        self.told.append("bad")


async def test_clients_are_told_of_the_end_before_anything_is_bad(
    tmp_path: Path, ports: tuple[int, int]
) -> None:
    path = start(tmp_path, ports)
    with drivebridge(tmp_path, "run", "run", str(path), notify=True) as bridge:
        bridge.wait_ready()
        wait_for_front(bridge)
        client = Client(f"opc.tcp://127.0.0.1:{ports[1]}/drivebridge", timeout=5)
        words = LastWords()
        async with client:
            space = await client.get_namespace_index("urn:drivebridge:points")
            subscription = await client.create_subscription(100, words)
            await subscription.subscribe_data_change(
                [client.get_node(ua.ObjectIds.Server_ServiceLevel), client.get_node(f"ns={space};s={STATE}")]
            )
            await asyncio.sleep(0.3)
            assert "level 255" in words.told
            bridge.signal(signal.SIGTERM)
            began = time.monotonic()
            while "level 0" not in words.told:
                assert time.monotonic() - began < 1.5, words.told
                await asyncio.sleep(0.02)
            state = await client.get_node(ua.ObjectIds.Server_ServerStatus_State).read_value()
            assert state == ua.ServerState.Shutdown
            assert words.told[:3].count("bad") == 0
        # Its only client has gone: nobody is waited for any more.
        assert bridge.popen.wait(10) == 0
        assert "Traceback" not in bridge.output()


@pytest.mark.landing
def test_a_front_does_not_outlive_the_bus_process(tmp_path: Path, ports: tuple[int, int]) -> None:
    path = start(tmp_path, ports)
    with drivebridge(tmp_path, "run", "run", str(path), notify=True) as bridge:
        bridge.wait_ready()
        wait_for_front(bridge)
        [front] = children(bridge.pid)
        bridge.signal(signal.SIGKILL)
        bridge.popen.wait()
        until(lambda: not Path(f"/proc/{front}").exists(), 10.0, "the front ends too")


@pytest.mark.landing
@pytest.mark.timeout(300)  # the tests of the documentation may have the demo
def test_the_demo_stops_without_leaving_anything_behind(tmp_path: Path) -> None:
    with only_demo(), drivebridge(tmp_path, "demo", "demo", notify=True) as demo:
        demo.wait_ready()
        wait_for_front(demo)
        demo.wait_output("conveyor/fu4: controlled by zenoh:demo")
        started = children(demo.pid)
        assert len(started) == 4, "three fronts and the controller"
        demo.signal(signal.SIGINT)
        assert demo.popen.wait(15) == 0
        assert not any(Path(f"/proc/{child}").exists() for child in started)
        assert "Traceback" not in demo.output()
