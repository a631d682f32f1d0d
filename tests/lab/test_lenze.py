"""A simulated 8400 motec on vcan0 under the whole bus process, commanded through Modbus; and its own
supervision, when the bridge is gone."""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.support.process import Process, drivebridge, free_port, until
from tests.support.sniffer import Sniffer, sniffing

RPDO1, TPDO1, EMCY, HEARTBEAT = 0x205, 0x185, 0x085, 0x705
NODE_PARAMETER = 0x605
STOP, RUN, RESET = 0x0001, 0x0009, 0x0081
HALF = 0x2000
READY, SWITCHED_ON, ENABLED, FAULT = 3, 4, 5, 8

_SITE = """
[site]
name = "lab"
state_dir = "{folder}/state"
runtime_dir = "{folder}/run"
[[bus]]
name = "can0"
interface = "socketcan"
channel = "vcan0"
bitrate = 500000
deadman_ms = 400
on_intruder = "report"
[[bus.node]]
name = "pump"
id = 5
mapping = "lenze/8400-motec"
sdo_channels = [2]
{configure}
[[bus.node.drive]]
slot = "drive"
control = "modbus"
fieldbus_timeout_ms = 10000
telegram_downtime_s = 0
[modbus]
listen = "127.0.0.1:{modbus}"
"""
_SUPERVISED = """
configure = [
  { object = "1016:01", type = "uint32", value = 0x7F012C },
  { object = "5DAF:05", type = "uint8", value = 1 },
]
"""


class Lab:
    """The drive, the bridge and a witness."""

    def __init__(self, folder: Path, stack: ExitStack, configure: str) -> None:
        self.port = free_port()
        path = folder / "site.toml"
        path.write_text(_SITE.format(folder=folder, modbus=self.port, configure=configure), encoding="utf-8")
        self.bus: Sniffer = stack.enter_context(sniffing())
        simulation = stack.enter_context(drivebridge(folder, "simulate", "simulate", str(path)))
        simulation.wait_output("simulating")
        arguments = ("run", str(path), "--role", "bus", "--role", "zenoh")
        self.bridge: Process = stack.enter_context(drivebridge(folder, "run", *arguments, notify=True))
        self.bridge.wait_ready()
        self.bridge.wait_output("node operational")

    def write(self, control_word: int, setpoint: int = 0) -> None:
        command = ["mbpoll", "-m", "tcp", "-p", str(self.port), "-a", "1", "-t", "4:hex", "-r", "1"]
        values = [f"0x{word:04X}" for word in (control_word, setpoint)]
        done = subprocess.run([*command, "127.0.0.1", *values], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr

    def wait_for(self, state: int, speed: int | None = None) -> None:
        """Until the drive says this device state, and this speed word."""

        def there() -> bool:
            seen = self.bus.of(TPDO1)
            if not seen or seen[-1].word >> 8 & 0x0F != state:
                return False
            return speed is None or int.from_bytes(seen[-1].data[2:4], "little") == speed

        until(there, 15.0, f"device state {state}, speed {speed}")

    def run_drive(self) -> None:
        self.wait_for(READY)
        self.write(STOP)
        self.wait_for(SWITCHED_ON)
        self.write(RUN, HALF)
        self.wait_for(ENABLED, HALF)


@pytest.fixture
def make_lab(tmp_path: Path) -> Iterator[object]:
    with ExitStack() as stack:
        yield lambda configure="": Lab(tmp_path, stack, configure)


def test_boot_up_start_setpoint_fault_acknowledge_stop(make_lab) -> None:
    lab = make_lab()
    lab.bridge.wait_output("does nothing by itself when the bridge falls silent", 5.0)
    assert any(frame.data == b"\0" for frame in lab.bus.of(HEARTBEAT))
    assert any(frame.data[:4] == b"\x23\x01\x12\x01" for frame in lab.bus.of(NODE_PARAMETER)), (
        "SDO2 is opened"
    )
    lab.run_drive()
    # A telegram that is too short, with C00592/1 = 1 a fault: what a test outside the process can provoke.
    lab.bus.send(NODE_PARAMETER, bytes.fromhex("2FAF5D0101000000"))
    time.sleep(0.2)
    lab.bus.send(RPDO1, b"\x09\x00")
    lab.wait_for(FAULT)
    until(lambda: len(lab.bus.of(EMCY)) >= 2, 5.0, "the emergency messages")
    codes = {int.from_bytes(frame.data[:2], "little") for frame in lab.bus.of(EMCY)}
    assert {0x8210, 0xF000} <= codes
    lab.wait_for(FAULT, 0)
    lab.write(STOP)
    lab.write(RESET)
    lab.wait_for(SWITCHED_ON)
    lab.write(STOP)
    lab.write(RUN, HALF)
    lab.wait_for(ENABLED, HALF)
    lab.write(STOP)
    lab.wait_for(SWITCHED_ON, 0)


@pytest.mark.landing
def test_a_dead_bridge_stops_the_drive_where_its_heartbeat_is_watched(make_lab) -> None:
    lab = make_lab(_SUPERVISED)
    lab.run_drive()
    lab.bridge.signal(signal.SIGKILL)
    lab.bridge.popen.wait()
    killed = time.time()
    until(lambda: lab.bus.of(EMCY, killed), 5.0, "EMCY 8130h")
    first = lab.bus.of(EMCY, killed)[0]
    assert first.data[:2] == b"\x30\x81"
    # The last heartbeat burst lives for the dead-man time, then 300 ms of 1016h.
    assert first.time - killed <= 0.4 + 0.3 + 0.3
    assert any(frame.data[:2] == b"\x00\xf0" for frame in lab.bus.of(EMCY, killed))


@pytest.mark.landing
def test_a_dead_bridge_lets_the_drive_run_where_nothing_is_configured(make_lab) -> None:
    lab = make_lab()
    lab.run_drive()
    lab.bridge.signal(signal.SIGKILL)
    lab.bridge.popen.wait()
    killed = time.time()
    time.sleep(4.0)  # longer than C00357/1 = 3000 ms
    assert not lab.bus.of(EMCY, killed)
    assert lab.bus.of(TPDO1)[-1].word >> 8 & 0x0F == ENABLED


@pytest.mark.landing
def test_a_bridge_that_cannot_boot_it_again_stops_the_drive(make_lab, tmp_path: Path) -> None:
    """Killed and started anew, with a site file that expects another maker and does not know where the
    drive listens: 1400h:01 is no factory's identifier."""
    lab = make_lab('configure = [{ object = "1400:01", type = "uint32", value = 0x400002B3 }]')
    lab.run_drive()
    lab.bridge.signal(signal.SIGKILL)
    lab.bridge.popen.wait()
    time.sleep(1.0)
    assert lab.bus.of(TPDO1)[-1].word >> 8 & 0x0F == ENABLED
    path = tmp_path / "again.toml"
    stranger = "[bus.node.identity]\nvendor_id = 0x123"
    path.write_text(_SITE.format(folder=tmp_path, modbus=lab.port, configure=stranger), encoding="utf-8")
    begun = time.time()
    with drivebridge(
        tmp_path, "again", "run", str(path), "--role", "bus", "--role", "zenoh", notify=True
    ) as again:
        again.wait_output("expected 00000123h", 10.0)
        until(lambda: lab.bus.of(0x2B3, begun), 2.0, "a stopped word where the drive listens")
        stopped_at = lab.bus.of(0x2B3, begun)[0].time
        until(lambda: lab.bus.of(TPDO1, stopped_at), 2.0, "the drive's answer")
        first = lab.bus.of(TPDO1, stopped_at)[0]
        assert first.word >> 8 & 0x0F == READY
        assert first.time - stopped_at <= 0.1
        until(lambda: any(frame.data == b"\x02\x05" for frame in lab.bus.of(0, begun)), 5.0, "NMT stop")
