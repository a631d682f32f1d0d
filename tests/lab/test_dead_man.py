"""The dead-man chain on real SocketCAN: whoever falls silent, the drive stops in time.

Times are the kernel's, taken on a second socket. The published bound gets 150 ms on top for a machine
that is busy with other things; ``make bench`` prints the figures without it.
"""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path

import pytest

from tests.lab.sites import LabSite, lab_site, values
from tests.support.process import Process, drivebridge, peer, until
from tests.support.sniffer import Sniffer, sniffing

NOISE_S = 0.150
TIMEOUT_S = 0.200
CYCLE_S = 0.010
REACTION_S = 0.020
DEADMAN_S = 0.100

SYNC, RPDO1, TPDO1, SDO = 0x080, 0x205, 0x185, 0x605
P151_500_MS = bytes.fromhex("2B972001F4010000")


class Lab:
    """A simulated node and the bus process on vcan0, a witness, and an owner of fu1 that can be stopped."""

    def __init__(self, folder: Path, stack: ExitStack, site: LabSite) -> None:
        self.folder = folder
        self.site = site
        self.stack = stack
        self.bus: Sniffer = stack.enter_context(sniffing())
        self.simulation = stack.enter_context(drivebridge(folder, "simulate", "simulate", str(site.path)))
        self.simulation.wait_output("simulating")
        self.bridge = self.run_bridge("run")

    def run_bridge(self, name: str) -> Process:
        arguments = ("run", str(self.site.path), "--role", "bus", "--role", "zenoh")
        bridge = self.stack.enter_context(drivebridge(self.folder, name, *arguments, notify=True))
        bridge.wait_ready()
        bridge.wait_output("node operational")
        return bridge

    @property
    def stamps(self) -> Path:
        return self.folder / "stamps"

    def run_drive(self) -> Process:
        """fu1 runs at 25 Hz, kept going by an owner of its own process."""
        port = str(self.site.modbus_port)
        owner = self.stack.enter_context(
            peer(self.folder, "modbus_owner", port, "1", "0.05", str(self.stamps), "0x047F", "0x2000")
        )
        owner.wait_output("it runs", 30.0)
        return owner

    def turns_at(self, value: int) -> bool:
        seen = self.bus.of(TPDO1)
        return bool(seen) and int.from_bytes(seen[-1].data[2:4], "little") == value

    def last_telegram(self) -> float:
        return float(self.stamps.read_text(encoding="ascii").split()[-1])


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    with ExitStack() as stack:
        yield Lab(tmp_path, stack, lab_site(tmp_path, timeout_ms=200))


def enabling(word: int) -> bool:
    return word & 0x0F == 0x0F


def test_a_stopped_controller_stops_its_drive_in_time(lab: Lab) -> None:
    owner = lab.run_drive()
    owner.signal(signal.SIGSTOP)
    until(lambda: lab.turns_at(0), 10.0, "the drive stands still")
    last = lab.last_telegram()
    reaction = next(frame for frame in lab.bus.of(RPDO1, last) if not frame.word & 0x0002)
    assert reaction.word & 0x0400, "control data valid"
    assert reaction.data[2:] == bytes(6), "setpoints are zero"
    assert reaction.time - last >= TIMEOUT_S
    assert reaction.time - last <= TIMEOUT_S + CYCLE_S + REACTION_S + NOISE_S
    # The owner comes back and writes as before: nothing moves.
    owner.signal(signal.SIGCONT)
    time.sleep(1.0)
    assert not [frame for frame in lab.bus.of(RPDO1, reaction.time) if enabling(frame.word)]
    lab.bridge.wait_output("E010/10.3", 5.0)


@pytest.mark.landing(2)
@pytest.mark.parametrize("deadman_ms", [100, 400])
def test_a_bridge_that_pauses_across_the_deadline_publishes_no_less(tmp_path: Path, deadman_ms: int) -> None:
    """No margin for a busy machine, so one try of three may be held up by it: a bridge that does not look for
    a while takes a telegram to be as old as its last look, and stops the drive too early by that."""
    site = lab_site(tmp_path, timeout_ms=200, bus=f"deadman_ms = {deadman_ms}")
    tries: list[tuple[float, float]] = []
    with ExitStack() as stack:
        lab = Lab(tmp_path, stack, site)
        [published] = values(site, "conveyor/fu1/supervision/worst_case_stop_ms")
        assert isinstance(published, int)
        while len(tries) < 3 and not any(map(is_in_time, tries)):
            owner = lab.run_drive()
            owner.signal(signal.SIGSTOP)
            last = lab.last_telegram()
            time.sleep(max(0.0, last + TIMEOUT_S - 0.02 - time.time()))
            lab.bridge.signal(signal.SIGSTOP)
            time.sleep(0.06)
            lab.bridge.signal(signal.SIGCONT)
            time.sleep(0.5)
            frames = lab.bus.of(RPDO1, last)
            stop = next(frame for frame in frames if not enabling(frame.word))
            final = max(frame.time for frame in frames if enabling(frame.word))
            early_s = last + TIMEOUT_S - stop.time
            tries.append((early_s, max(stop.time, final) - last - published / 1000))
            owner.signal(signal.SIGKILL)
            owner.popen.wait()
    assert any(map(is_in_time, tries)), f"seconds early and late: {tries}"


def is_in_time(early_and_late_s: tuple[float, float]) -> bool:
    """Neither before the owner's time is up, nor later than is published."""
    return max(early_and_late_s) <= 0


def test_everything_comes_at_its_period_for_longer_than_a_burst(lab: Lab) -> None:
    begin = time.time() + 0.5
    time.sleep(3.5)
    for can_id, period_s in ((SYNC, 0.010), (RPDO1, 0.010), (0x77F, 0.100)):
        times = [frame.time for frame in lab.bus.of(can_id, begin)]
        pauses = [later - earlier for earlier, later in pairwise(times)]
        assert len(times) >= 0.8 * 3.0 / period_s
        assert max(pauses) <= period_s + NOISE_S


@pytest.fixture
def lab_that_reports(tmp_path: Path) -> Iterator[Lab]:
    """The bridge stops nobody because we write to the drive ourselves."""
    with ExitStack() as stack:
        yield Lab(tmp_path, stack, lab_site(tmp_path, timeout_ms=200, bus='on_intruder = "report"'))


def test_a_killed_bridge_sends_nothing_more_and_the_drive_trips_by_its_own_p151(
    lab_that_reports: Lab,
) -> None:
    lab = lab_that_reports
    lab.bus.send(SDO, P151_500_MS)
    lab.run_drive()
    lab.bridge.signal(signal.SIGKILL)
    lab.bridge.popen.wait()
    killed = time.time()
    until(lambda: lab.bus.of(TPDO1)[-1].word & 0x4F == 0x08, 10.0, "the drive is in fault")
    until(lambda: lab.turns_at(0), 10.0, "the drive stands still")
    assert not lab.bus.of(RPDO1, killed)
    assert not lab.bus.of(SYNC, killed)
    emergencies = [frame.data for frame in lab.bus.of(0x085, killed)]
    assert emergencies
    assert emergencies[0][:2] == b"\x00\x81"


def test_a_hung_bridge_is_silent_within_the_dead_man_time(lab: Lab) -> None:
    lab.run_drive()
    lab.bridge.signal(signal.SIGSTOP)
    hung = time.time()
    time.sleep(1.0)
    for can_id in (SYNC, RPDO1, 0x77F):
        assert lab.bus.of(can_id), "it was sent before"
        late = [frame.time - hung for frame in lab.bus.of(can_id, hung)]
        assert max(late, default=0.0) <= DEADMAN_S + CYCLE_S
    lab.bridge.signal(signal.SIGCONT)
    back = time.time()
    time.sleep(1.0)
    after = lab.bus.of(RPDO1, back)
    assert after, "it goes on"
    assert not [frame for frame in after if enabling(frame.word)], "and moves nothing"


def test_after_the_interface_was_down_the_first_rpdos_are_stopped_ones(lab: Lab) -> None:
    lab.run_drive()
    subprocess.run(["ip", "link", "set", "vcan0", "down"], check=True)
    lab.bridge.wait_output("bus can0 is down", 5.0)
    subprocess.run(["ip", "link", "set", "vcan0", "up"], check=True)
    up = time.time()
    until(lambda: len(lab.bus.of(RPDO1, up)) > 20, 15.0, "process data flow again")
    assert not [frame for frame in lab.bus.of(RPDO1, up) if enabling(frame.word)]


@pytest.mark.landing
def test_a_restarted_bridge_starts_with_stopped_words(lab: Lab) -> None:
    owner = lab.run_drive()
    lab.bridge.signal(signal.SIGKILL)
    lab.bridge.popen.wait()
    owner.stop()
    killed = time.time()
    lab.run_bridge("again")
    until(lambda: len(lab.bus.of(RPDO1, killed)) > 20, 15.0, "process data flow again")
    frames = lab.bus.of(RPDO1, killed)
    assert {frame.word for frame in frames} == {0x0400}
    until(lambda: lab.turns_at(0), 5.0, "the drive that ran on is stopped")


@pytest.mark.landing
@pytest.mark.parametrize(("role", "ready"), [("opcua", "INFO    OPC UA on"), ("zenoh", "INFO    zenoh on")])
def test_a_killed_front_changes_nothing_on_the_bus(tmp_path: Path, role: str, ready: str) -> None:
    site = lab_site(tmp_path, timeout_ms=5000, bus="deadman_ms = 400")
    with ExitStack() as stack:
        bus = stack.enter_context(sniffing())
        stack.enter_context(drivebridge(tmp_path, "simulate", "simulate", str(site.path)))
        bridge = stack.enter_context(drivebridge(tmp_path, "run", "run", str(site.path), notify=True))
        bridge.wait_output("node operational")
        bridge.wait_output(ready)
        [front] = subprocess.run(
            ["pgrep", "-P", str(bridge.pid), "-f", "--", f"--role {role}"],
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split()
        begin = time.time()
        subprocess.run(["kill", "-9", front], check=True)
        bridge.wait_output(f"the {role} front ended (SIGKILL)")
        until(lambda: bridge.output().count(ready) == 2, 30.0, "the front is back")
        for can_id in (SYNC, RPDO1):
            times = [frame.time for frame in bus.of(can_id, begin)]
            pauses = [later - earlier for earlier, later in pairwise(times)]
            assert len(times) > 50
            assert max(pauses) <= CYCLE_S + REACTION_S + NOISE_S
        assert {frame.word for frame in bus.of(RPDO1, begin)} == {0x0400}
