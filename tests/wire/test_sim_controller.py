"""The demo's controller on a real bridge."""

from __future__ import annotations

import json
import time
from pathlib import Path

import zenoh

from bridge.sim.controller import Controller, Move, Times
from tests.support import sites
from tests.support.process import drivebridge, free_port

# Longer than a busy machine holds a client up, shorter than the pauses in which the controller must go on.
TIMEOUT_MS = 2000
TIMES = Times(cycle_s=0.05, run_s=0.5, pause_s=2.5, retry_s=2.5)


def session_to(port: int) -> zenoh.Session:
    settings = {
        "mode": "client",
        "connect": {"endpoints": [f"tcp/127.0.0.1:{port}"]},
        "scouting": {"multicast": {"enabled": False}},
    }
    return zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))


def test_the_demos_controller_never_trips_its_own_watchdog(tmp_path: Path) -> None:
    port = free_port()
    bus = sites.bus(sites.node(sites.drive("fu4", "lease", TIMEOUT_MS), more="sdo_channels = [4]"))
    site = sites.write(tmp_path, bus, sites.zenoh(port), name="demo")
    with drivebridge(tmp_path, "run", "run", str(site), notify=True) as bridge:
        bridge.wait_ready()
        bridge.wait_output("node operational")
        told: list[dict[str, str]] = []
        with session_to(port) as session:
            events = session.declare_subscriber(
                "drives/demo/@/event/**", lambda sample: told.append(json.loads(sample.payload.to_bytes()))
            )
            controller = Controller(session, Move("drives/demo/conveyor/fu4", "frequency", 40.0), TIMES)
            while not controller.run_once():
                assert "on its way" in bridge.output(), "refused by anything but its age on a busy machine"
            rounds = [controller.run_once() for _ in range(3)]
            events.undeclare()
        assert rounds == [True] * 3, bridge.output()
        kinds = {event["kind"] for event in told if event["source"] == "conveyor/fu4"}
        assert "owner" in kinds
        assert "watchdog" not in kinds


def test_the_demos_controller_asks_nothing_of_a_node_that_is_not_operational(tmp_path: Path) -> None:
    port = free_port()
    bus = sites.bus(sites.node(sites.drive("fu4", "lease", TIMEOUT_MS), more="sdo_channels = [4]"))
    site = sites.write(tmp_path, bus, sites.zenoh(port), name="demo")
    times = Times(cycle_s=0.05, run_s=0.1, pause_s=0.1, retry_s=0.05)
    with drivebridge(tmp_path, "run", "run", str(site), notify=True) as bridge:
        bridge.wait_ready()
        with session_to(port) as session:
            controller = Controller(session, Move("drives/demo/conveyor/fu4", "frequency", 40.0), times)

            def tell(what: str) -> None:
                [reply] = session.get(f"drives/demo/conveyor/node/{what}", payload="{}", timeout=5.0)
                assert reply.ok is not None, bridge.output()

            def run_until_moved() -> None:
                end = time.monotonic() + 20
                while not controller.run_once():
                    assert time.monotonic() < end, bridge.output()

            run_until_moved()
            controller.ask("release_control")
            tell("disable")
            assert [controller.run_once() for _ in range(3)] == [False] * 3
            tell("enable")
            run_until_moved()
        # What waited on a busy machine is refused by its age, and says nothing about the controller.
        refused = [line for line in bridge.output().splitlines() if "refused" in line]
        assert all("on its way" in line for line in refused), refused
