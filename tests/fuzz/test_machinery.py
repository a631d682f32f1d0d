"""The fuzzers find what they are there for: a bridge with a fault, which dies of one message, is found, and
what was thrown at it is kept and kills it again."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

import pytest

from tests.fuzz import judge as judges
from tests.fuzz import run
from tests.fuzz.case import Case, read_cases
from tests.fuzz.judge import Judge
from tests.fuzz.rig import Rig, children, command_line
from tests.fuzz.run import fuzz
from tests.support.process import running, until

# The fuzzer itself.
pytestmark = pytest.mark.landing

BRIDGE = """
import pathlib, subprocess, sys, time
folder = pathlib.Path(sys.argv[1])
front = subprocess.Popen(["cat"], stdin=subprocess.PIPE)  # which ends with its parent
print("ready", flush=True)
while True:
    for order in sorted(folder.glob("do-*")):
        text = order.read_text()
        order.unlink()
        if text == "die":
            sys.exit(1)
        if text == "a spike":
            len(b"x" * 300_000_000)
        elif text == "lose the front":
            front.kill()
            front.wait()
        else:
            print(text, flush=True)
    time.sleep(0.01)
"""
GOOD = """
import pathlib, sys, time
folder = pathlib.Path(sys.argv[1]).parent
while True:
    with open(sys.argv[1], "a") as file:
        for protocol in ("modbus", "opcua", "zenoh"):
            for name in (protocol, f"{protocol}, newly connected"):
                verdict = "busy" if (folder / f"{protocol}-is-busy").exists() else "ok"
                file.write(f"{time.monotonic()};{name};1.5;{verdict}\\n")
    time.sleep(0.05)
"""


@contextmanager
def faulty(folder: Path) -> Iterator[Rig]:
    """Something that has a front and a log, and does as files say."""
    with (
        running(folder, "bridge", sys.executable, "-c", BRIDGE, str(folder)) as bridge,
        running(folder, "good", sys.executable, "-c", GOOD, str(folder / "exchanges")) as good,
    ):
        bridge.wait_output("ready")
        rig = Rig(folder, bridge, good, 0, 0, 0)
        until(lambda: len(rig.fronts()) == 1 and rig.exchanges.exists(), 10.0, "it runs")
        yield rig


def order(rig: Rig, text: str) -> None:
    # By renaming, so that it is never read half written.
    path = rig.folder / "order"
    path.write_text(text, encoding="utf-8")
    path.rename(rig.folder / f"do-{time.monotonic_ns()}")


def faults_of(judge: Judge, limit_s: float = 10.0) -> str:
    found: list[str] = []

    def look() -> bool:
        found.extend(judge.look())
        return bool(found)

    until(look, limit_s, "a fault is seen", pause_s=0.1)
    return "; ".join(found)


@pytest.mark.parametrize(
    ("done", "seen"),
    [
        ("lose the front", "the processes are others"),
        ("die", "the bus process has ended with 1"),
        ("Traceback (most recent call last):", "log: Traceback"),
        ("WARNING Task exception was never retrieved", "never retrieved"),
        ("\n".join(["INFO a line"] * 500), "the log has"),
        ("a spike", "MB at most"),
    ],
    ids=["a lost front", "a lost bus process", "a traceback", "a lost task", "a flood", "a spike"],
)
def test_what_a_bridge_must_not_do_is_seen(tmp_path: Path, done: str, seen: str) -> None:
    with faulty(tmp_path) as rig:
        judge = Judge(rig)
        time.sleep(0.2)
        assert not judge.look()
        order(rig, done)
        assert seen in faults_of(judge)


@pytest.mark.parametrize(
    ("file", "line", "seen"),
    [
        ("words", "1.0 205 7e0400000000", "the telegram of conveyor/fu1 has changed"),
        ("words", "1.0 208 0f0400100000", "node 8 is enabled"),
        ("exchanges", "1.0;opcua;5000.0;TimeoutError", "good client on opcua: TimeoutError"),
        (
            "state/audit.jsonl",
            '{"source":"zenoh","user":"fuzz","target":"conveyor/fu2","action":"write","code":"ok"}',
            "zenoh:fuzz was let do write on conveyor/fu2",
        ),
    ],
    ids=["a good drive is stopped", "a spare drive is enabled", "no answer", "a stranger's write"],
)
def test_what_must_not_happen_to_others_is_seen(tmp_path: Path, file: str, line: str, seen: str) -> None:
    with faulty(tmp_path) as rig:
        judge = Judge(rig)
        path = tmp_path / file
        path.parent.mkdir(exist_ok=True)
        with path.open("a", encoding="ascii") as notes:
            notes.write(f"{line}\n")
        assert seen in faults_of(judge)


@pytest.mark.parametrize("exchange", ["5.0;busy", "800.0;ok"], ids=["told to try again", "slow"])
@pytest.mark.parametrize("is_busy", [False, True], ids=["not busy", "busy"])
def test_late_answers_are_a_fault_where_the_machine_was_not_busy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, exchange: str, is_busy: bool
) -> None:
    monkeypatch.setattr(judges, "STARVED", -1.0 if is_busy else float("inf"))
    with faulty(tmp_path) as rig:
        judge = Judge(rig)
        with rig.exchanges.open("a", encoding="ascii") as notes:
            for many, one in ((20, exchange), (60, "1.5;ok")):
                notes.write(f"{time.monotonic()};opcua, once;{one}\n" * many)
        time.sleep(0.5)
        faults = judge.conclude()
    assert [fault for fault in faults if "20 of 80 exchanges" in fault] == faults
    assert len(faults) == (not is_busy)


BUSY_MACHINE = -1.0
"""In place of ``STARVED``: it is busy all the time."""


def test_a_good_client_that_is_told_to_try_again_for_long_is_seen_on_a_busy_machine_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(judges, "STARVED", BUSY_MACHINE)
    monkeypatch.setattr(judges, "UNSERVED_S", 0.5)
    with faulty(tmp_path) as rig:
        judge = Judge(rig)
        time.sleep(0.2)
        assert not judge.look()
        (tmp_path / "opcua-is-busy").touch()
        assert "good client on opcua: told to try again for 0.5 s" in faults_of(judge)


def test_a_run_in_which_most_were_told_to_try_again_is_no_success(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(judges, "STARVED", BUSY_MACHINE)
    with faulty(tmp_path) as rig:
        (tmp_path / "zenoh-is-busy").touch()
        judge = Judge(rig)
        time.sleep(0.5)
        faults = judge.conclude()
    assert [fault.partition(":")[0] for fault in faults] == [
        "good client on zenoh",
        "good client on zenoh, newly connected",
    ]
    assert all("exchanges were told to try again" in fault for fault in faults)


def test_a_good_client_that_has_lost_its_connection_is_seen_on_a_busy_machine_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It fails at once, thousands of times: nobody may take that for a machine that is busy."""
    monkeypatch.setattr(judges, "STARVED", BUSY_MACHINE)
    with faulty(tmp_path) as rig:
        judge = Judge(rig)
        with rig.exchanges.open("a", encoding="ascii") as notes:
            notes.write(f"{time.monotonic()};opcua;0.2;ConnectionError client is disconnected\n" * 10)
        assert "good client on opcua: ConnectionError client is disconnected" in faults_of(judge)


def test_who_waits_for_the_cpu_is_known() -> None:
    """By the account of the kernel: three that only compute have two thirds of a CPU too few."""
    here = min(os.sched_getaffinity(0))
    spin = f"import os; os.sched_setaffinity(0, {{{here}}})\nwhile True: pass"
    spinning = [subprocess.Popen([sys.executable, "-c", spin]) for _ in range(3)]
    try:
        waits = judges.Waits([one.pid for one in spinning])
        time.sleep(1.0)
        assert waits.is_busy()
    finally:
        for one in spinning:
            one.kill()
            one.wait()
    idle = judges.Waits([os.getpid()])
    time.sleep(1.0)
    assert not idle.is_busy()


def test_good_clients_that_fall_silent_are_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(judges, "SILENT_S", 0.5)
    with faulty(tmp_path) as rig:
        judge = Judge(rig)
        time.sleep(0.2)
        assert not judge.look()
        rig.good.signal(19)
        assert "no exchange for 0.5 s" in faults_of(judge)


def test_a_newcomer_that_never_comes_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(judges, "SILENT_S", 0.5)
    monkeypatch.setattr(judges, "GOOD_CLIENTS", (*judges.GOOD_CLIENTS, "opcua, by a way that nobody takes"))
    with faulty(tmp_path) as rig:
        judge = Judge(rig)
        assert "good client on opcua, by a way that nobody takes: no exchange" in faults_of(judge)


class Thrower:
    """Its bridge loses the front by one of a hundred messages."""

    def __init__(self, rig: Rig, random: Random) -> None:
        self._rig = rig
        self._random = random

    def case(self) -> Case:
        return Case("any", (bytes([self._random.randrange(100)]),))

    def throw(self, case: Case) -> None:
        time.sleep(0.005)
        if case.parts == (b"\x2a",):
            order(self._rig, "lose the front")

    def close(self) -> None:
        pass


def test_a_deadly_message_is_found_kept_and_kills_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run, "make_target", lambda _, rig, random: Thrower(rig, random))
    monkeypatch.setattr(run, "BUILD", tmp_path / "build")
    for folder in ("first", "again"):
        (tmp_path / folder).mkdir()
    with faulty(tmp_path / "first") as rig:
        report = fuzz(rig, ["opcua"], 30.0, 7)
    assert "the processes are others" in report.faults[0]
    kept = tmp_path / "build" / "opcua-7.jsonl"
    assert kept in report.kept
    assert "SEED=7" in report.told()
    cases = read_cases(kept)
    assert Case("any", (b"\x2a",)) in cases
    with faulty(tmp_path / "again") as rig:
        again = fuzz(rig, ["opcua"], 30.0, 0, cases)
    assert "the processes are others" in again.faults[0]


def test_a_fuzzer_that_fails_is_no_success(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Broken(Thrower):
        def throw(self, case: Case) -> None:
            raise RuntimeError("out of order")

    monkeypatch.setattr(run, "make_target", lambda _, rig, random: Broken(rig, random))
    monkeypatch.setattr(run, "BUILD", tmp_path / "build")
    with faulty(tmp_path) as rig:
        assert "out of order" in fuzz(rig, ["opcua"], 30.0, 7).faults[0]


FORKS = """
import os, subprocess, time
front = subprocess.Popen(["sleep", "60"])
if os.fork():
    print("ready", flush=True)
time.sleep(60)
"""


def test_a_fork_that_writes_a_checkpoint_is_no_front(tmp_path: Path) -> None:
    with running(tmp_path, "bridge", sys.executable, "-c", FORKS) as bridge:
        bridge.wait_output("ready")
        assert len(children(bridge.pid)) == 2
        (front,) = Rig(tmp_path, bridge, bridge, 0, 0, 0).fronts()
        assert command_line(front).startswith(b"sleep")
        for child in children(bridge.pid):
            os.kill(child, signal.SIGKILL)
