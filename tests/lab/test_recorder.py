"""Incidents on real SocketCAN replay to the last output: silences, hangs, a bus that fails, strangers."""

from __future__ import annotations

import contextlib
import itertools
import json
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException

from tests.lab.sites import LabSite, lab_site
from tests.support.process import Process, drivebridge, drivebridge_called

ROUNDS = 4
_PAUSE_S = 0.7
_CYCLE_S = 0.05
_STOPPED, _RUN, _ACKNOWLEDGE = 0x047E, 0x047F, 0x04FE


class Owner:
    """A PLC that keeps fu1 moving whatever happened before: it acknowledges, and begins again."""

    def __init__(self, port: int) -> None:
        self._port = port
        self.is_silent = False
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._ends.set()
        self._thread.join()

    def _run(self) -> None:
        words = itertools.cycle([[_STOPPED, 0], *[[_RUN, 0x2000]] * 9, [_ACKNOWLEDGE, 0]])
        with ModbusTcpClient("127.0.0.1", port=self._port, timeout=1) as client:
            while not self._ends.wait(_CYCLE_S):
                if not self.is_silent:
                    with contextlib.suppress(ModbusException, OSError):
                        client.write_registers(0, next(words), device_id=1)


class Lab:
    """A service on vcan0 that is recorded, its simulated drives, and an owner of fu1."""

    def __init__(self, folder: Path, stack: ExitStack, site: LabSite) -> None:
        self._folder = folder
        self._stack = stack
        self.site = site
        self.starts = 0
        self.simulation = stack.enter_context(drivebridge(folder, "simulate", "simulate", str(site.path)))
        self.simulation.wait_output("simulating")
        self.bridge = self._started()
        self.owner = Owner(site.modbus_port)
        stack.callback(self.owner.close)

    def _started(self) -> Process:
        self.starts += 1
        command = "run", str(self.site.path), "--role", "bus"
        name = f"run{self.starts}"
        bridge = self._stack.enter_context(drivebridge(self._folder, name, *command, notify=True))
        bridge.wait_ready()
        bridge.wait_output("node operational")
        return bridge

    def is_silent(self, seconds: float) -> None:
        self.owner.is_silent = True
        time.sleep(seconds)
        self.owner.is_silent = False

    def pause(self, process: Process, seconds: float) -> None:
        process.signal(signal.SIGSTOP)
        time.sleep(seconds)
        process.signal(signal.SIGCONT)

    def bus_fails(self) -> None:
        subprocess.run(["ip", "link", "set", "vcan0", "down"], check=True)
        time.sleep(0.3)
        subprocess.run(["ip", "link", "set", "vcan0", "up"], check=True)

    def send(self, frame: str) -> None:
        """A frame of somebody else's."""
        subprocess.run(["cansend", "vcan0", frame], check=True)

    def kill(self) -> None:
        self.bridge.signal(signal.SIGKILL)
        self.bridge.popen.wait()
        self.bridge = self._started()


INCIDENTS: dict[str, Callable[[Lab], None]] = {
    "the controller is silent": lambda lab: lab.is_silent(0.5),
    "the bridge hangs for less than deadman_ms": lambda lab: lab.pause(lab.bridge, 0.06),
    "the bridge hangs": lambda lab: lab.pause(lab.bridge, 0.4),
    "the node is silent": lambda lab: lab.pause(lab.simulation, 0.5),
    "the interface goes down": Lab.bus_fails,
    "somebody sends NMT": lambda lab: lab.send("000#8005"),
    "somebody commands the drive": lambda lab: lab.send("205#7F04002000000000"),
    "the drive says a fault": lambda lab: lab.send("085#1081110000000000"),
}


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    with ExitStack() as stack:
        yield Lab(tmp_path, stack, lab_site(tmp_path, timeout_ms=200, controls=("modbus",), recorded=True))


def replayed(recording: Path) -> Any:
    done = drivebridge_called("replay", str(recording), "--json")
    told = json.loads(done.stdout)
    assert done.returncode == 0, [one.get("difference") for one in told["segments"]]
    return told


@pytest.mark.timeout(400)
def test_incidents_replay_to_the_same_outputs(lab: Lab, tmp_path: Path) -> None:
    for number in range(ROUNDS):
        for happens in INCIDENTS.values():
            happens(lab)
            time.sleep(_PAUSE_S)
        if not number:
            lab.kill()
    lab.bridge.stop()
    whole, lines = tmp_path / "all.recording", tmp_path / "all.jsonl"
    assert drivebridge_called("record", str(lab.site.path), "-o", str(whole)).returncode == 0
    told = replayed(whole)
    assert len(told["segments"]) >= 2, "one for each start at least"
    assert sum(one["outputs"] for one in told["segments"]) > 1000
    assert drivebridge_called("record", str(whole), "-o", str(lines)).returncode == 0
    everything = map(json.loads, lines.read_text(encoding="utf-8").splitlines())
    told_of = " ".join(line["message"] for line in everything if line["what"] == "event")
    for said in ("was silent for", "hung for", "somebody else", "8110h"):
        assert said in told_of
    black_box = sorted((tmp_path / "state" / "black_box").iterdir())
    assert black_box, "trips and intruders are written out"
    for recording in black_box:
        replayed(recording)
