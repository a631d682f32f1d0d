"""`drivebridge simulate` plays the demo's four families on vcan0, for a bridge that is another process."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
import zenoh

from bridge.sim.controller import Controller, Move, Times
from tests.support.process import REPOSITORY, Process, drivebridge, free_port, until
from tests.support.sniffer import Sniffer, sniffing

DEMO = REPOSITORY / "bridge" / "demo" / "site.toml"
TIMES = Times(cycle_s=0.1, run_s=1.5, pause_s=1.0, retry_s=1.0, away_s=1.0)
MOVES = (
    ("conveyor/fu4", "frequency", 10.0),
    ("pump/drive", "velocity", 300.0),
    ("lift/drive", "velocity", 600.0),
    ("fan/drive", "velocity", 300.0),
)
SUPERVISED = {"conveyor": 0x085, "pump": 0x086, "lift": 0x087, "fan": 0x088}
"""Emergency messages of the nodes: all of them watch the bridge."""
NOTICE_S = 3.0


class Lab:
    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self.port = free_port()
        site = folder / "site.toml"
        text = DEMO.read_text(encoding="utf-8").partition("[modbus]")[0]
        places = f'name = "demo"\nstate_dir = "{folder}/state"\nruntime_dir = "{folder}/run"'
        text = text.replace('name = "demo"', places, 1)
        text = text.replace('interface = "virtual"', 'interface = "socketcan"\nchannel = "vcan0"')
        servers = (
            f'[modbus]\nlisten = "127.0.0.1:{free_port()}"\n[opcua]\n[zenoh]\nlisten = ["{self.endpoint}"]\n'
        )
        site.write_text(text + servers, encoding="utf-8")
        self.bus: Sniffer = stack.enter_context(sniffing())
        simulation = stack.enter_context(drivebridge(folder, "simulate", "simulate", str(site)))
        simulation.wait_output("simulating conveyor, pump, lift, fan")
        arguments = ("run", str(site), "--role", "bus", "--role", "zenoh")
        self.bridge: Process = stack.enter_context(drivebridge(folder, "run", *arguments, notify=True))
        self.bridge.wait_ready()
        until(lambda: self.bridge.output().count("node operational") == 4, 30.0, "all nodes operational")
        settings = {
            "mode": "client",
            "connect": {"endpoints": [self.endpoint]},
            "scouting": {"multicast": {"enabled": False}},
        }
        config = zenoh.Config.from_json5(json.dumps(settings))
        self.session = stack.enter_context(zenoh.open(config))

    @property
    def endpoint(self) -> str:
        return f"tcp/127.0.0.1:{self.port}"

    def controller(self, drive: str, value: str, most: float) -> Controller:
        return Controller(self.session, Move(f"drives/demo/{drive}", value, most), TIMES)


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    with ExitStack() as stack:
        yield Lab(tmp_path, stack)


@pytest.mark.landing
def test_each_family_is_moved_and_stops_when_the_bridge_is_gone(lab: Lab) -> None:
    for drive, value, most in MOVES:
        controller = lab.controller(drive, value, most)
        # A slow machine may let a lease run out.
        assert controller.run_once() or controller.run_once(), (drive, lab.bridge.output())
    for node, cob_id in SUPERVISED.items():
        assert not [frame for frame in lab.bus.of(cob_id) if any(frame.data[:2])], f"{node} has no fault"
    lab.bridge.signal(signal.SIGKILL)
    lab.bridge.popen.wait()
    killed = time.time()
    for node, cob_id in SUPERVISED.items():
        until(lambda cob_id=cob_id: lab.bus.of(cob_id, killed), NOTICE_S, f"{node} has noticed")
