"""A STÖBER 5000 on real SocketCAN: guarded, started, turned, in fault, acknowledged, stopped, bereft."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException

from tests.support.process import Process, drivebridge, free_port, peer, until
from tests.support.sniffer import Sniffer, sniffing

NODE = 7
RPDO, TPDO, EMCY, GUARD = 0x207, 0x187, 0x087, 0x707
REMOTE = 1 << 30
GUARD_MS, FACTOR = 200, 3
NOISE_S = 0.5

SITE = """
[site]
name = "lab"
state_dir = "{folder}/state"
runtime_dir = "{folder}/run"

[[bus]]
name = "can0"
interface = "socketcan"
channel = "vcan0"
bitrate = 250000
deadman_ms = 400

[[bus.node]]
name = "lift"
id = 7
mapping = "stoeber/5000"
supervision = "guarding"
supervision_ms = {guard_ms}
life_time_factor = {factor}

[[bus.node.drive]]
slot = "axis1"
unit_id = 1
control = "modbus"
fieldbus_timeout_ms = 5000

[modbus]
listen = "127.0.0.1:{port}"
"""


class Owner:
    """A PLC in a thread: writes its words every 50 ms."""

    def __init__(self, port: int) -> None:
        self.words = [0, 0]
        self._client = ModbusTcpClient("127.0.0.1", port=port, timeout=10)
        assert self._client.connect()
        self._running = True
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while self._running:
            try:
                self._client.write_registers(0, list(self.words), device_id=1)
            except (ModbusException, OSError):  # the bridge has been killed
                return
            time.sleep(0.05)

    def stop(self) -> None:
        self._running = False
        self._thread.join(15.0)
        self._client.close()


class Lab:
    def __init__(self, folder: Path, stack: ExitStack) -> None:
        port = free_port()
        site = folder / "site.toml"
        text = SITE.format(folder=folder, port=port, guard_ms=GUARD_MS, factor=FACTOR)
        site.write_text(text, encoding="utf-8")
        self.bus: Sniffer = stack.enter_context(sniffing())
        self.drive: Process = stack.enter_context(peer(folder, "stoeber_slave", "vcan0", str(NODE), "250000"))
        self.drive.wait_output("is there")
        arguments = ("run", str(site), "--role", "bus", "--role", "zenoh")
        self.bridge: Process = stack.enter_context(drivebridge(folder, "run", *arguments, notify=True))
        self.bridge.wait_ready()
        self.bridge.wait_output("node operational")
        until(lambda: bool(self.bus.of(TPDO)), 10.0, "the drive sends")
        self.owner = Owner(port)
        stack.callback(self.owner.stop)

    @property
    def answer(self) -> tuple[int, int]:
        """E48 and the speed in 1/min, of the newest TPDO."""
        data = self.bus.of(TPDO)[-1].data
        return data[0], int.from_bytes(data[2:4], "little", signed=True)

    def command(self, control: int, setpoint: int, state: int, rpm: int) -> None:
        """Give this command and wait until the drive is there."""
        self.owner.words = [control, setpoint & 0xFFFF]
        until(lambda: self.answer == (state, rpm), 15.0, f"E48 = {state} at {rpm} 1/min")


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    with ExitStack() as stack:
        yield Lab(tmp_path, stack)


def test_from_boot_up_to_a_fault_and_back(lab: Lab) -> None:
    assert lab.bus.of(GUARD)[0].data == b"\0", "boot-up"
    until(lambda: len(lab.bus.of(GUARD)) > 4, 10.0, "it answers to being guarded")
    toggles = [frame.data[0] & 0x80 for frame in lab.bus.of(GUARD)[1:]]
    assert toggles[:4] == [0x00, 0x80, 0x00, 0x80]
    lab.command(0, 0, 2, 0)
    lab.command(1, 500, 4, 1500)
    lab.command(1, -250, 4, -750)
    assert {len(frame.data) for frame in lab.bus.of(RPDO)} == {3}
    lab.drive.signal(signal.SIGUSR1)
    until(lambda: lab.answer[0] == 5, 10.0, "fault")
    lab.bridge.wait_output("temperature of the motor", 10.0)
    lab.command(0, 0, 5, 0)
    lab.owner.words = [2, 0]
    until(lambda: lab.answer[0] == 2, 10.0, "acknowledged")
    emergencies = [frame.data.hex(" ") for frame in lab.bus.of(EMCY)]
    assert emergencies == ["10 43 08 29 02 00 00 00", "00 00 00 1e 00 00 00 00"]
    lab.command(0, 0, 2, 0)
    lab.command(1, 500, 4, 1500)
    lab.command(5, 0, 1, 0)  # quick stop


def test_killing_the_master_stops_the_drive_by_life_guarding(lab: Lab) -> None:
    lab.command(0, 0, 2, 0)
    lab.command(1, 500, 4, 1500)
    lab.bridge.signal(signal.SIGKILL)
    lab.bridge.popen.wait()
    killed = time.time()
    until(lambda: bool(lab.bus.of(EMCY, killed)), 10.0, "the drive has noticed")
    (emergency,) = lab.bus.of(EMCY, killed)
    assert emergency.data.hex(" ") == "00 81 10 34 01 00 00 00", "event 52, cause 1"
    last = lab.bus.of(GUARD | REMOTE)[-1].time
    life_time_s = GUARD_MS * FACTOR / 1000
    assert life_time_s <= emergency.time - last <= life_time_s + NOISE_S
    assert not lab.bus.of(RPDO, killed + 0.1)
    # Nobody guards or commands it any more: ask it by hand, over its SDO server.
    speed = bytes.fromhex("4008280000000000")

    def stands_still() -> bool:
        lab.bus.send(0x607, speed)
        time.sleep(0.05)
        answers = lab.bus.of(0x587, killed)
        return bool(answers) and answers[-1].data.hex() == "4b08280000000000"

    until(stands_still, 10.0, "the motor stands still")
