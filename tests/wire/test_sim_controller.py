"""The demo's controller on a real bridge."""

from __future__ import annotations

import json
import threading
import time
from pathlib import Path

import pytest
import zenoh

from bridge.sim.controller import Controller, Move, Times
from tests.support import sites
from tests.support.process import drivebridge, free_port, until

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


@pytest.mark.landing
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


@pytest.mark.landing
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


@pytest.mark.landing
def test_the_demos_controller_leaves_a_drive_to_who_has_stopped_it(tmp_path: Path) -> None:
    port = free_port()
    bus = sites.bus(sites.node(sites.drive("fu4", "lease", TIMEOUT_MS), more="sdo_channels = [4]"))
    site = sites.write(tmp_path, bus, sites.zenoh(port), name="demo")
    times = Times(cycle_s=0.05, run_s=60.0, pause_s=0.1, retry_s=0.1, away_s=1.0)
    move = Move("drives/demo/conveyor/fu4", "frequency", 40.0)
    with drivebridge(tmp_path, "run", "run", str(site), notify=True) as bridge:
        bridge.wait_ready()
        bridge.wait_output("node operational")
        with session_to(port) as session:
            controller, visitor = Controller(session, move, times), Visitor(session, move.drive_key)
            rounds: list[bool] = []
            thread = threading.Thread(target=lambda: rounds.append(controller.run_once()))
            thread.start()
            until(
                lambda: visitor.sees("status/state", "s") == "operation_enabled", 20.0, "it moves the drive"
            )
            assert visitor.ask("quick_stop").get("ok")
            until(
                lambda: visitor.ask("take_control", ttl_ms=1500).get("ok") is True, 10.0, "the drive is free"
            )
            thread.join(timeout=0.5)
            assert thread.is_alive(), "it waits as long as the drive has another owner"
            until(lambda: not thread.is_alive(), 15.0, "it goes on when nobody wants the drive any more")
            assert rounds == [False]


class Visitor:
    """Somebody else than the demo's controller."""

    def __init__(self, session: zenoh.Session, drive_key: str) -> None:
        self._session, self._key = session, drive_key

    def sees(self, leaf: str, key: str) -> object:
        return self._get(f"{self._key}/{leaf}").get(key)

    def ask(self, leaf: str, **payload: object) -> dict[str, object]:
        return self._get(f"{self._key}/command/{leaf}", json.dumps(payload))

    def _get(self, key: str, payload: str | None = None) -> dict[str, object]:
        identity = json.dumps({"controller": "visitor"})
        for reply in self._session.get(key, payload=payload, attachment=identity, timeout=5.0):
            if reply.ok is not None:
                return json.loads(reply.ok.payload.to_string())
        return {}
