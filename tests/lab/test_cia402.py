"""A CiA 402 drive on real SocketCAN, mode by mode: started, turned, in fault, reset, stopped, bereft."""

from __future__ import annotations

import itertools
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException

from tests.support.process import Process, drivebridge, free_port, peer, until
from tests.support.sniffer import Seen, Sniffer, sniffing

NODE = 7
RPDO, TPDO, EMCY, HEARTBEAT, SYNC = 0x207, 0x187, 0x087, 0x707, 0x080
SHUTDOWN, RUN, RESET = 0x0006, 0x000F, 0x0080
DISABLED, READY, SWITCHED_ON, ENABLED, FAULT = 0x40, 0x21, 0x23, 0x27, 0x08
DEADMAN_S, CONSUMER_S, NOISE_S = 0.4, 0.3, 0.5
POSITION_REGISTER = 32

SITE = """
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
on_intruder = "{on_intruder}"
[[bus.node]]
name = "axis"
id = 7
mapping = "cia402/{mode}"
configure = [
  {{ object = "1016:01", type = "uint32", value = 0x7F012C }},
  {{ object = "6007:00", type = "int16", value = 3 }},
]
[[bus.node.drive]]
slot = "drive"
unit_id = 1
control = "modbus"
fieldbus_timeout_ms = 5000
[modbus]
listen = "127.0.0.1:{port}"
"""


class Owner:
    """A PLC in a thread: writes its control word and the two setpoint words every 20 ms."""

    def __init__(self, port: int) -> None:
        self.words: list[int] = [0]
        self.position: int | None = None
        """Written as a value, beside the control word."""
        self._client = ModbusTcpClient("127.0.0.1", port=port, timeout=10)
        assert self._client.connect()
        self._running = True
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while self._running:
            try:
                self._client.write_registers(0, list(self.words), device_id=1)
                if self.position is not None:
                    registers = [self.position >> 16 & 0xFFFF, self.position & 0xFFFF]
                    self._client.write_registers(POSITION_REGISTER, registers, device_id=1)
            except (ModbusException, OSError):  # the bridge has been killed
                return
            time.sleep(0.02)

    def stop(self) -> None:
        self._running = False
        self._thread.join(15.0)
        self._client.close()


def words(control: int, target: int = 0) -> list[int]:
    return [control, target & 0xFFFF, target >> 16 & 0xFFFF]


class Lab:
    """The drive, the bridge, its owner and a witness."""

    def __init__(self, folder: Path, stack: ExitStack, mode: str, on_intruder: str = "stop_node") -> None:
        port = free_port()
        path = folder / "site.toml"
        site = SITE.format(folder=folder, port=port, mode=mode, on_intruder=on_intruder)
        path.write_text(site, encoding="utf-8")
        self.bus: Sniffer = stack.enter_context(sniffing())
        self.drive: Process = stack.enter_context(peer(folder, "cia402_slave", "vcan0", str(NODE), "500000"))
        self.drive.wait_output("is there")
        arguments = ("run", str(path), "--role", "bus", "--role", "zenoh")
        self.bridge: Process = stack.enter_context(drivebridge(folder, "run", *arguments, notify=True))
        self.bridge.wait_ready()
        self.bridge.wait_output("node operational")
        until(lambda: bool(self.bus.of(TPDO)), 10.0, "the drive sends")
        self.owner = Owner(port)
        stack.callback(self.owner.stop)

    @property
    def state(self) -> int:
        return self.bus.of(TPDO)[-1].word & 0x6F

    @property
    def value(self) -> int:
        """Position or speed of the newest TPDO."""
        return actual(self.bus.of(TPDO)[-1])

    def wait(self, what: Callable[[], bool], text: str) -> None:
        until(what, 15.0, text)

    def enable(self, run: int, target: int = 0) -> None:
        self.owner.words = words(SHUTDOWN, target)
        self.wait(lambda: self.state == READY, "ready")
        self.owner.words = words(run, target)
        self.wait(lambda: self.state == ENABLED, "operation enabled")


def actual(frame: Seen) -> int:
    return int.from_bytes(frame.data[2:6], "little", signed=True)


@pytest.fixture
def make_lab(tmp_path: Path) -> Iterator[Callable[[str], Lab]]:
    with ExitStack() as stack:
        yield lambda mode: Lab(tmp_path, stack, mode)


def test_pv_from_boot_up_to_a_fault_and_back(make_lab) -> None:
    lab = make_lab("profile-velocity")
    assert lab.bus.of(HEARTBEAT)[0].data == b"\0", "boot-up"
    assert lab.state == DISABLED
    lab.enable(RUN, 100_000)
    lab.wait(lambda: lab.value == 100_000, "the speed")
    lab.owner.words = words(RUN, -50_000)
    lab.wait(lambda: lab.value == -50_000, "the other direction")
    assert lab.bus.of(TPDO)[-1].data[6] == 3, "6061h"
    lab.drive.signal(signal.SIGUSR1)
    lab.wait(lambda: lab.state == FAULT, "fault")
    lab.bridge.wait_output("drive temperature too high", 10.0)
    lab.wait(lambda: lab.value == 0, "standstill")
    lab.owner.words = words(0)
    time.sleep(0.1)
    lab.owner.words = words(RESET)
    lab.wait(lambda: lab.state == DISABLED, "reset")
    emergencies = [frame.data.hex(" ") for frame in lab.bus.of(EMCY)]
    assert emergencies == ["10 43 09 00 00 00 00 00", "00 00 00 00 00 00 00 00"]
    lab.enable(RUN, 20_000)
    lab.wait(lambda: lab.value == 20_000, "the speed")
    lab.owner.words = words(0x0007, 20_000)
    lab.wait(lambda: (lab.state, lab.value) == (SWITCHED_ON, 0), "stopped on the ramp")


def test_vl_killing_the_master_stops_the_drive_by_its_heartbeat(make_lab) -> None:
    lab = make_lab("velocity")
    lab.owner.words = [SHUTDOWN, 0]
    lab.wait(lambda: lab.state == READY, "ready")
    lab.owner.words = [0x007F, 1200]
    lab.wait(lambda: lab.bus.of(TPDO)[-1].data[2:4] == (1200).to_bytes(2, "little"), "1200 1/min")
    lab.bridge.signal(signal.SIGKILL)
    lab.bridge.popen.wait()
    killed = time.time()
    lab.wait(lambda: bool(lab.bus.of(EMCY, killed)), "the drive has noticed")
    (emergency,) = lab.bus.of(EMCY, killed)
    assert emergency.data[:2] == b"\x30\x81"
    assert emergency.time - killed <= DEADMAN_S + CONSUMER_S + NOISE_S
    # Nobody commands it any more: ask it by hand, over its SDO server.
    speed = bytes.fromhex("4044600000000000")

    def stands_still() -> bool:
        lab.bus.send(0x607, speed)
        time.sleep(0.05)
        answers = lab.bus.of(0x587, killed)
        return bool(answers) and answers[-1].data.hex() == "4b44600000000000"

    lab.wait(stands_still, "the motor stands still")


@pytest.mark.landing
def test_pp_a_position_is_handed_over_by_the_bridge(make_lab) -> None:
    lab = make_lab("profile-position")
    lab.owner.words = [SHUTDOWN]
    lab.wait(lambda: lab.state == READY, "ready")
    lab.owner.words = [0x002F]
    lab.wait(lambda: lab.state == ENABLED, "operation enabled")
    for position in (70_000, -5_000):
        lab.owner.position = position
        lab.wait(lambda position=position: lab.value == position, f"position {position}")
    sent = [frame.word for frame in lab.bus.of(RPDO)]
    edges = sum(1 for one, two in itertools.pairwise(sent) if two & ~one & 0x10)
    assert edges == 2, "one new set-point each, however often it was written"


@pytest.mark.landing
def test_hm_finds_its_place(make_lab) -> None:
    lab = make_lab("homing")
    lab.owner.words = [SHUTDOWN]
    lab.wait(lambda: lab.state == READY, "ready")
    lab.owner.words = [RUN]
    lab.wait(lambda: lab.state == ENABLED, "operation enabled")
    lab.owner.words = [0x001F]
    lab.wait(lambda: lab.bus.of(TPDO)[-1].word & 0x3400 == 0x1400, "homing attained")


@pytest.mark.landing
def test_csp_follows_with_sync_and_enabling_moves_nothing(make_lab) -> None:
    lab = make_lab("cyclic-position")
    lab.enable(RUN, 4000)  # written too early: it must not jump there
    held = next(actual(frame) for frame in lab.bus.of(TPDO) if frame.word & 0x6F == ENABLED)
    assert held == 0
    for step in range(60):
        lab.owner.words = words(RUN, 4000 + 500 * step)
        time.sleep(0.02)
    lab.wait(lambda: lab.value == 33_500, "the last position")
    assert lab.state == ENABLED, "no following error"
    syncs, tpdos = lab.bus.of(SYNC), lab.bus.of(TPDO)
    begin, end = tpdos[-100].time, tpdos[-1].time
    assert (end - begin) / 99 == pytest.approx(0.01, rel=0.2), "one to each SYNC of 10 ms"
    assert len([sync for sync in syncs if begin <= sync.time <= end]) in range(98, 103)
    lab.owner.words = words(0x0002, 33_500)
    lab.wait(lambda: lab.state == DISABLED, "quick stop")


@pytest.mark.landing
def test_csv_follows_with_sync(make_lab) -> None:
    lab = make_lab("cyclic-velocity")
    lab.enable(RUN)
    for target in (30_000, -10_000, 0):
        lab.owner.words = words(RUN, target)
        lab.wait(lambda target=target: lab.value == target, f"{target} inc/s")
    lab.owner.words = words(0x0007)
    lab.wait(lambda: lab.state == SWITCHED_ON, "stopped")
