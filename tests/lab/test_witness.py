"""`drivebridge witness` on real SocketCAN, beside a bridge that keeps its promise and one that does not."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.lab.sites import lab_site
from tests.support.devices import DEVICES
from tests.support.process import Process, drivebridge, peer, until
from tests.support.sniffer import sniffing

RPDO1, RUN, STOP = "205", "7F04002000000000", "7E04000000000000"
ENABLED = "370B002000000000"


class Watched:
    """A witness of the site, with what it has recorded. Nothing else runs yet."""

    def __init__(self, folder: Path, stack: ExitStack, *options: str, more: str = "") -> None:
        self.folder = folder
        self.stack = stack
        # RPDOs every 20 ms, so that the machine has time for all of these processes.
        own = "own_timeout_ms = 500\nenforce = true"
        self.site = lab_site(folder, timeout_ms=400, bus="sync_period_ms = 20", node=own, more=more)
        self.record = folder / "record.jsonl"
        self.called = folder / "called"
        command = f"/bin/sh -c 'echo \"$DRIVEBRIDGE_SOURCE $DRIVEBRIDGE_KIND\" >>{self.called}'"
        arguments = ("witness", str(self.site.path), "--record", str(self.record), "--run", command, *options)
        self.process = stack.enter_context(drivebridge(folder, "witness", *arguments))
        self.process.wait_output("conveyor/fu1: dead controller")

    def start(self) -> Process:
        simulation = drivebridge(self.folder, "simulate", "simulate", str(self.site.path))
        self.stack.enter_context(simulation).wait_output("simulating")
        arguments = ("run", str(self.site.path), "--role", "bus", "--role", "zenoh")
        bridge = self.stack.enter_context(drivebridge(self.folder, "run", *arguments, notify=True))
        bridge.wait_ready()
        bridge.wait_output("node operational")
        return bridge

    def run_drive(self) -> Process:
        port, stamps = str(self.site.modbus_port), str(self.folder / "stamps")
        owner = peer(self.folder, "modbus_owner", port, "1", "0.1", stamps, "0x047F", "0x2000")
        process = self.stack.enter_context(owner)
        process.wait_output("it runs", 30.0)
        return process

    def activate_outputs(self) -> Process:
        owner = peer(self.folder, "output_owner", str(self.site.modbus_port), "4", "0.1", "0x08")
        process = self.stack.enter_context(owner)
        process.wait_output("active", 30.0)
        return process

    @property
    def lines(self) -> list[dict[str, object]]:
        if not self.record.exists():
            return []
        return [json.loads(line) for line in self.record.read_text(encoding="utf-8").splitlines()]

    def recorded(self, fits: Callable[[dict[str, object]], bool], what: str) -> dict[str, object]:
        until(lambda: any(fits(line) for line in self.lines), 15.0, what)
        return next(line for line in self.lines if fits(line))

    def end(self) -> int:
        self.process.signal(signal.SIGTERM)
        return self.process.popen.wait(10.0)


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def send(can_id: str, data: str) -> None:
    subprocess.run(["cansend", "vcan0", f"{can_id}#{data}"], check=True)


def test_the_stop_after_a_silent_controller_is_recorded_with_its_time(
    tmp_path: Path, stack: ExitStack
) -> None:
    watched = Watched(tmp_path, stack)
    watched.start()
    owner = watched.run_drive()
    time.sleep(1.0)
    owner.signal(signal.SIGSTOP)
    stop = watched.recorded(lambda line: line.get("cause") == "controller silent", "the stop is recorded")
    assert stop["stop"] == "conveyor/fu1"
    assert isinstance(stop["bus_ms"], int) and stop["bus_ms"] >= 250
    assert isinstance(stop["bus_bound_ms"], int) and 460 <= stop["bus_bound_ms"] <= 480
    # The bridge is started after the witness, which may have waited for it.
    alarms = [line for line in watched.lines if line.get("alarm") not in (None, "late", "blind")]
    assert not alarms, alarms


@pytest.mark.landing
def test_a_killed_bridge_and_a_drive_that_trips_by_itself_are_recorded(
    tmp_path: Path, stack: ExitStack
) -> None:
    watched = Watched(tmp_path, stack)
    bridge = watched.start()
    watched.run_drive()
    bridge.signal(signal.SIGKILL)
    stop = watched.recorded(lambda line: line.get("cause") == "bridge silent", "the stop is recorded")
    assert stop["stop"] == "conveyor/fu1"
    assert isinstance(stop["drive_ms"], int) and stop["drive_ms"] >= 400


@pytest.mark.landing
def test_who_breaks_the_promise_is_told_and_the_command_runs(tmp_path: Path, stack: ExitStack) -> None:
    """Frames of a drive that runs on without its bridge, and a witness that has nothing but the bus."""
    watched = Watched(tmp_path, stack, "--frames-only")
    send(RPDO1, RUN)
    for _ in range(20):
        send("185", ENABLED)
        time.sleep(0.1)
    alarm = watched.recorded(lambda line: line.get("alarm") == "runs on", "the alarm is recorded")
    assert alarm["source"] == "conveyor/fu1"
    until(watched.called.exists, 10.0, "the command has run")
    assert watched.called.read_text(encoding="ascii").splitlines()[0] == "conveyor/fu1 runs on"
    assert watched.end() == 1


@pytest.mark.landing
def test_a_bridge_that_never_answers_is_told_and_the_command_runs(tmp_path: Path, stack: ExitStack) -> None:
    watched = Watched(tmp_path, stack)
    alarm = watched.recorded(lambda line: line.get("alarm") == "blind", "blindness is recorded")
    assert "Connection refused" in str(alarm["message"])
    until(watched.called.exists, 10.0, "the command has run")
    watched.start()
    watched.recorded(lambda line: line.get("sees") == "can0", "its end is recorded")
    assert len([line for line in watched.lines if line.get("alarm") == "blind"]) == 1
    assert watched.end() == 1


@pytest.mark.landing
def test_a_second_sender_is_told(tmp_path: Path, stack: ExitStack) -> None:
    watched = Watched(tmp_path, stack, "--frames-only")
    with sniffing() as bus:  # a process for each frame would be too slow for two senders
        for _ in range(10):
            bus.send(int(RPDO1, 16), bytes.fromhex(RUN))
            bus.send(int(RPDO1, 16), bytes.fromhex(STOP))
    watched.recorded(lambda line: line.get("alarm") == "intruder", "the intruder is recorded")


IO = """
[[bus.node]]
name = "io"
id = 21
unit_id = 4
mapping = "eds:io16.eds"
own_timeout_ms = 500
enforce = true
[bus.node.outputs]
control = "modbus"
fieldbus_timeout_ms = 400
"""
OUTPUT_RPDO, ACTIVE, HEARTBEAT, OPERATIONAL = "215", "0800", "715", "05"


@pytest.fixture
def with_outputs(tmp_path: Path) -> Path:
    (tmp_path / "io16.eds").write_bytes((DEVICES / "io16.eds").read_bytes())
    return tmp_path


@pytest.mark.landing
def test_outputs_that_a_silent_controller_leaves_active_are_recorded_when_they_are_safe(
    with_outputs: Path, stack: ExitStack
) -> None:
    watched = Watched(with_outputs, stack, more=IO)
    watched.start()
    owner = watched.activate_outputs()
    time.sleep(1.0)
    owner.signal(signal.SIGSTOP)
    stop = watched.recorded(lambda line: line.get("cause") == "controller silent", "the stop is recorded")
    assert (stop["stop"], stop["drive_ms"]) == ("io", None)
    assert isinstance(stop["bus_ms"], int) and stop["bus_ms"] >= 250
    assert isinstance(stop["bus_bound_ms"], int) and 460 <= stop["bus_bound_ms"] <= 490
    alarms = [line for line in watched.lines if line.get("alarm") not in (None, "late", "blind")]
    assert not alarms, alarms


@pytest.mark.landing
def test_a_killed_bridge_and_a_node_that_makes_its_outputs_safe_are_recorded(
    with_outputs: Path, stack: ExitStack
) -> None:
    watched = Watched(with_outputs, stack, more=IO)
    bridge = watched.start()
    watched.activate_outputs()
    bridge.signal(signal.SIGKILL)
    stop = watched.recorded(lambda line: line.get("cause") == "bridge silent", "the stop is recorded")
    assert stop["stop"] == "io"
    assert isinstance(stop["drive_ms"], int) and stop["drive_ms"] >= 300


@pytest.mark.landing
def test_outputs_that_stay_active_without_a_bridge_are_told(with_outputs: Path, stack: ExitStack) -> None:
    watched = Watched(with_outputs, stack, "--frames-only", more=IO)
    send(OUTPUT_RPDO, ACTIVE)
    for _ in range(20):
        send(HEARTBEAT, OPERATIONAL)
        time.sleep(0.1)
    alarm = watched.recorded(lambda line: line.get("alarm") == "runs on", "the alarm is recorded")
    assert alarm["source"] == "io"
    assert watched.end() == 1


@pytest.mark.landing
def test_a_second_sender_of_outputs_is_told(with_outputs: Path, stack: ExitStack) -> None:
    watched = Watched(with_outputs, stack, "--frames-only", more=IO)
    with sniffing() as bus:
        for _ in range(200):
            bus.send(int(OUTPUT_RPDO, 16), bytes.fromhex(ACTIVE))
            time.sleep(0.002)
    alarm = watched.recorded(lambda line: line.get("alarm") == "intruder", "the intruder is recorded")
    assert alarm["source"] == "io"


def test_an_interface_that_is_not_there_is_said(tmp_path: Path, stack: ExitStack) -> None:
    site = lab_site(tmp_path, timeout_ms=400)
    arguments = ("witness", str(site.path), "--channel", "can0=can77")
    process = stack.enter_context(drivebridge(tmp_path, "witness", *arguments))
    assert process.popen.wait(20.0) == 3
    assert "cannot listen on can77" in process.output()
