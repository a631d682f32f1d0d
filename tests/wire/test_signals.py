"""Signals that end the service: the drives are stopped first, whichever it is and however often it comes."""

from __future__ import annotations

import os
import select
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient

from tests.support import sites
from tests.support.process import REPOSITORY, Process, catches, free_port, only_demo, running, until
from tests.wire.test_fronts import children, wait_for_front

ENDING = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT)
PERIOD_S = 0.010
REACTION_S = 0.020
UNIT = 1


@dataclass(frozen=True, slots=True)
class Word:
    time: float
    can_id: int
    word: int

    @property
    def enables(self) -> bool:
        return self.word & 0x000F == 0x000F


class Seen:
    """A bridge, and the control words it has sent."""

    def __init__(self, process: Process, file: Path) -> None:
        self.process = process
        self._file = file

    def words(self, can_id: int | None = None, since: float = 0.0) -> list[Word]:
        fields = (line.split() for line in self._file.read_text("ascii").splitlines())
        words = (Word(float(at), int(cob, 16), int(word, 16)) for at, cob, word in fields)
        return [word for word in words if can_id in (None, word.can_id) and word.time >= since]

    def enabled(self) -> set[int]:
        """The RPDOs whose last word enables."""
        return {word.can_id for word in {word.can_id: word for word in self.words()}.values() if word.enables}


@contextmanager
def seen(folder: Path, *arguments: str) -> Iterator[Seen]:
    """``drivebridge ARGUMENTS``, a leader of its process group as a terminal's command is."""
    script, file = REPOSITORY / "tests" / "wire" / "peers" / "seen_bridge.py", folder / "words"
    command = (sys.executable, str(script), str(file), *arguments)
    with running(folder, "bridge", *command, notify=True) as process:
        yield Seen(process, file)


def end_of(pid: int) -> float:
    """Wait until the process has ended: when that was."""
    try:
        handle = os.pidfd_open(pid)
    except ProcessLookupError:
        return time.monotonic()
    with os.fdopen(handle):
        assert select.select([handle], [], [], 15.0)[0], "it does not end"
        return time.monotonic()


@pytest.mark.landing(4)
@pytest.mark.parametrize("number", ENDING, ids=lambda number: number.name)
def test_the_drives_are_stopped_before_anything_else_is_ended(tmp_path: Path, number: signal.Signals) -> None:
    ports = free_port(), free_port()
    drive = sites.drive("fu1", "modbus", 20_000, f"unit_id = {UNIT}\n{sites.SCALED}")
    path = sites.write(tmp_path, sites.bus(sites.node(drive)), sites.modbus(ports[0]), sites.opcua(ports[1]))
    with seen(tmp_path, "run", str(path)) as bridge, ExitStack() as stack:
        bridge.process.wait_ready()
        bridge.process.wait_output("node operational")
        wait_for_front(bridge.process)
        plc = stack.enter_context(ModbusTcpClient("127.0.0.1", port=ports[0]))
        way_s = max(way(bridge, plc) for _ in range(5))
        [front] = children(bridge.process.pid)
        # A front that hangs takes longest to end.
        os.kill(front, signal.SIGSTOP)
        # As a terminal does it: everybody of the process group gets it. And somebody is impatient.
        begin = time.monotonic()
        os.killpg(bridge.process.pid, number)
        time.sleep(0.2)
        bridge.process.signal(number)
        front_ended = end_of(front)
        assert bridge.process.popen.wait(15) == 0, bridge.process.output()
        stops = [word for word in bridge.words(since=begin) if not word.enables]
        assert stops, bridge.process.output()
        assert stops[0].time < front_ended
        assert stops[0].time - begin <= PERIOD_S + REACTION_S + way_s
        assert not any(word.enables for word in bridge.words(since=stops[0].time))
        assert "Traceback" not in bridge.process.output()


def way(bridge: Seen, plc: ModbusTcpClient) -> float:
    """Let the drive run, and stop it by its owner: how long that takes to be on the bus."""
    for words in ([0x047E, 0], [0x047F, 0x2000]):
        assert not plc.write_registers(0, words, device_id=UNIT).isError()
    until(lambda: bridge.enabled(), 5.0, "it is enabled")
    begin = time.monotonic()
    plc.write_register(0, 0x047E, device_id=UNIT)
    until(lambda: not bridge.enabled(), 5.0, "it is stopped")
    took = bridge.words(since=begin)[0].time - begin
    plc.write_register(0, 0x047F, device_id=UNIT)
    until(lambda: bridge.enabled(), 5.0, "it is enabled again")
    return took


@pytest.mark.landing
@pytest.mark.timeout(300)  # the tests of the documentation may have the demo
@pytest.mark.parametrize("number", ENDING, ids=lambda number: number.name)
def test_the_demo_stops_its_drives_first_and_leaves_nothing_behind(
    tmp_path: Path, number: signal.Signals
) -> None:
    with only_demo(), seen(tmp_path, "demo") as demo:
        demo.process.wait_ready()
        until(lambda: len(demo.enabled()) >= 2, 60.0, "its controller moves drives")
        moving = demo.enabled()
        started = children(demo.process.pid)
        begin = time.monotonic()
        os.killpg(demo.process.pid, number)
        ended = min(map(end_of, started))
        assert demo.process.popen.wait(15) == 0, demo.process.output()
        for can_id in moving:
            first = demo.words(can_id, begin)[0]
            assert not first.enables
            assert first.time < ended
        assert not demo.enabled()
        assert not any(Path(f"/proc/{child}").exists() for child in started)
        assert "Traceback" not in demo.process.output()


@pytest.mark.landing(3)
@pytest.mark.parametrize("after_s", [0.05, 0.15, 0.3, 0.6, 1.0, 1.5])
@pytest.mark.parametrize("number", ENDING, ids=lambda number: number.name)
def test_a_signal_while_it_starts_ends_it_without_a_trace(
    tmp_path: Path, number: signal.Signals, after_s: float
) -> None:
    node = sites.node(sites.drive("fu1", "modbus", 2000))
    path = sites.write(tmp_path, sites.bus(node), sites.modbus(free_port()), sites.opcua(free_port()))
    command = (sys.executable, "-m", "bridge", "run", str(path))
    with running(tmp_path, "bridge", *command) as bridge:
        # Python catches SIGINT before a line of ours has run.
        until(lambda: all(catches(bridge.pid, one) for one in ENDING), 5.0, "it minds signals", pause_s=0.001)
        time.sleep(after_s)
        started = children(bridge.pid)
        os.killpg(bridge.pid, number)
        assert bridge.popen.wait(15) == 0, bridge.output()
        assert not any(Path(f"/proc/{child}").exists() for child in started)
        assert "Traceback" not in bridge.output()
        assert "KeyboardInterrupt" not in bridge.output()
