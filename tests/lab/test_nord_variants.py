"""An SK TU3-CAO and an SK TU4-CAO with the drive profile on vcan0 under the whole bus process, commanded
through Modbus; and what stops them when the bridge is gone (BU 2500 §6.5.7, §6.7.3, §8.1)."""

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

pytestmark = pytest.mark.nightly

NOISE_S = 1.0
DEADMAN_S, P513_S, P151_S = 0.4, 1.0, 0.8
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
[[bus.node]]
name = "lift"
id = 5
mapping = "nord/sk-tu3-cao"
configure = [{{ object = "2201:00", type = "int16", value = 10 }}]
[[bus.node.drive]]
slot = "drive"
unit_id = 1
control = "modbus"
fieldbus_timeout_ms = 20000
[[bus.node]]
name = "belt"
id = 7
mapping = "nord/sk-tu4-cao-ds402"
configure = [{{ object = "2097:01", type = "uint16", value = 800 }}]
[[bus.node.drive]]
slot = "fu2"
unit_id = 2
control = "modbus"
fieldbus_timeout_ms = 20000
[modbus]
listen = "127.0.0.1:{modbus}"
"""


class Lab:
    """Both nodes, the bridge and a witness."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self.port = free_port()
        path = folder / "site.toml"
        path.write_text(_SITE.format(folder=folder, modbus=self.port), encoding="utf-8")
        self.bus: Sniffer = stack.enter_context(sniffing())
        simulation = stack.enter_context(drivebridge(folder, "simulate", "simulate", str(path)))
        simulation.wait_output("simulating")
        arguments = ("run", str(path), "--role", "bus")
        self.bridge: Process = stack.enter_context(drivebridge(folder, "run", *arguments, notify=True))
        self.bridge.wait_ready()
        for name in ("lift", "belt"):
            self.bridge.wait_output(f"{name}: node operational")

    def command(self, unit: int, control_word: int, setpoint: int, low_byte: int, value: int) -> None:
        """Write this, and wait until the drive says this state and this first actual value."""
        words = [f"0x{control_word:04X}", f"0x{setpoint & 0xFFFF:04X}"]
        mbpoll = ["mbpoll", "-m", "tcp", "-p", str(self.port), "-a", str(unit), "-t", "4:hex", "-r", "1"]
        done = subprocess.run([*mbpoll, "127.0.0.1", *words], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        tpdo = {1: 0x285, 2: 0x287}[unit]

        def there() -> bool:
            data = self.bus.of(tpdo)[-1].data
            return data[0] == low_byte and int.from_bytes(data[2:4], "little", signed=True) == value

        until(there, 15.0, f"unit {unit}: status xx{low_byte:02X}, value {value}")


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    with ExitStack() as stack:
        yield Lab(tmp_path, stack)


def test_6_8_on_a_tu3_and_a_speed_in_the_profile(lab: Lab) -> None:
    lab.command(1, 0x047E, 0, 0x31, 0)
    lab.command(1, 0x047F, 0x2000, 0x37, 0x2000)
    lab.command(2, 0x047E, 0, 0x31, 0)
    lab.command(2, 0x047F, -600, 0x37, -600)
    assert lab.bus.of(0x305)[-1].data.hex() == "7f04002000000000", "view 2 of the SK TU3-CAO"
    assert lab.bus.of(0x307)[-1].data.hex() == "7f04a8fd", "6840h and 6842h"
    assert not lab.bus.of(0x205)
    assert {len(frame.data) for frame in lab.bus.of(0x285)} == {8}
    assert {len(frame.data) for frame in lab.bus.of(0x287)} == {4}
    lab.command(1, 0x047E, 0x2000, 0x31, 0)
    lab.command(2, 0x047E, -600, 0x31, 0)
    lab.command(1, 0x047F, 0x1000, 0x37, 0x1000)


def test_killing_the_bridge_stops_both_by_their_own_watch(lab: Lab) -> None:
    lab.command(1, 0x047E, 0, 0x31, 0)
    lab.command(1, 0x047F, 0x2000, 0x37, 0x2000)
    lab.command(2, 0x047E, 0, 0x31, 0)
    lab.command(2, 0x047F, 900, 0x37, 900)
    lab.bridge.signal(signal.SIGKILL)
    lab.bridge.popen.wait()
    killed = time.time()
    for node, own_s, rpdo, data in (
        (5, P513_S, 0x305, "0081110000000000"),
        (7, P151_S, 0x307, "0081110100000000"),
    ):

        def told(cob_id: int = 0x080 + node, data: str = data) -> bool:
            return data in [frame.data.hex() for frame in lab.bus.of(cob_id, killed)]

        until(told, 10.0, f"node {node} has noticed")
        (emergency,) = [f for f in lab.bus.of(0x080 + node, killed) if f.data.hex() == data]
        last = lab.bus.of(rpdo)[-1].time
        assert last - killed <= DEADMAN_S + NOISE_S
        assert own_s <= emergency.time - last <= own_s + NOISE_S
