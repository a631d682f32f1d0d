"""How punctual the bus process is while people look at the page, with nobody and with five viewers in turn.

What counts is SYNC and the stop of a silent controller's drive, by the kernel's time stamps on real SocketCAN
and with the service's real-time priority. Front, viewers, controller and simulated drive share one slow CPU
with the bus process.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient

from tests.bench.figures import record, show
from tests.lab.sites import LabSite, lab_site, values
from tests.lab.test_dead_man import RPDO1, SYNC, Lab
from tests.support.process import Process, free_port, peer, running, until

ROUNDS, TRIPS = 2, 5
SETPOINT = 0x2000
LIMIT_S = 600
VIEWERS = 5
PERIOD_S = 0.010
TIMEOUT_S = 0.500
OWN_ACCOUNT = ("bridge/worst_trip_lateness_ms", "bridge/worst_round_lateness_ms")
LOOKED_S = 4.0
AS_THE_SERVICE = ("chrt", "--reset-on-fork", "--fifo", "10")


class LabWithPage(Lab):
    """As the service runs: the bus process with real-time priority, and its fronts as children. The plant has
    a priority, too: it is not on the box."""

    def run_bridge(self, name: str) -> Process:
        os.sched_setscheduler(self.simulation.pid, os.SCHED_FIFO, os.sched_param(5))
        command = (*AS_THE_SERVICE, sys.executable, "-m", "bridge", "run", str(self.site.path))
        bridge = self.stack.enter_context(running(self.folder, name, *command, notify=True))
        bridge.wait_ready()
        bridge.wait_output("node operational")
        bridge.wait_output("the page is served")
        bridge.wait_output("OPC UA on")
        return bridge


def with_page(folder: Path, port: int) -> LabSite:
    """The lab's site with a page for visitors, without a second front beside it."""
    site = lab_site(folder, timeout_ms=round(1000 * TIMEOUT_S), controls=("modbus", "none", "none"))
    text = site.path.read_text(encoding="utf-8")
    site.path.write_text(f'{text}\n[page]\nlisten = "127.0.0.1:{port}"\n', encoding="utf-8")
    return site


def lateness(folder: Path, viewers: int) -> tuple[list[float], list[float], list[float]]:
    """Errors of SYNC's period and how late stops came after the time-out, in seconds; what the bridge says
    that its latest stop and round were late by, in ms."""
    port = free_port()
    with ExitStack() as stack:
        lab = LabWithPage(folder, stack, with_page(folder, port))
        if viewers:
            looking = stack.enter_context(
                peer(folder, "page_viewers", str(port), str(viewers), "conveyor/fu1")
            )
            looking.wait_output("they look")
        begin = time.time()
        time.sleep(LOOKED_S)
        times = [frame.time for frame in lab.bus.of(SYNC, begin)]
        plc = ModbusTcpClient("127.0.0.1", port=lab.site.modbus_port, timeout=10)
        stack.callback(plc.close)
        assert plc.connect()
        stops = [stop_of_a_silent_owner(lab, plc) for _ in range(TRIPS)]
        own = [float(str(one)) for one in values(lab.site, *OWN_ACCOUNT)]
    return [abs(b - a - PERIOD_S) for a, b in pairwise(times)], stops, own


def stop_of_a_silent_owner(lab: Lab, plc: ModbusTcpClient) -> float:
    """How much later than the time-out the stop is on the bus, from before the owner's last write."""
    last = run_drive(lab, plc)
    until(lambda: lab.turns_at(0), 10.0, "the drive stands still")
    reaction = next(frame for frame in lab.bus.of(RPDO1, last) if not frame.word & 0x0002)
    return reaction.time - last - TIMEOUT_S


def run_drive(lab: Lab, plc: ModbusTcpClient) -> float:
    """The wall-clock time before the write with which it was left alone, at its setpoint."""
    end = time.monotonic() + 30.0
    while time.monotonic() < end:
        for word in (0x04FE, 0x047E):
            write(plc, word, 0)
        for _ in range(20):
            last = time.time()
            write(plc, 0x047F, SETPOINT)
            time.sleep(0.05)
            if lab.turns_at(SETPOINT):
                return last
    raise AssertionError(f"the drive does not run:\n{lab.bridge.output()}")


def write(plc: ModbusTcpClient, word: int, setpoint: int) -> None:
    answer = plc.write_registers(0, [word, setpoint], device_id=1)
    assert not answer.isError(), answer


@pytest.mark.timeout(LIMIT_S)
def test_the_bus_process_beside_viewers(tmp_path: Path) -> None:
    found: dict[int, tuple[list[float], list[float], list[list[float]]]] = {
        viewers: ([], [], []) for viewers in (0, VIEWERS)
    }
    for number in range(ROUNDS):
        for viewers, (syncs, stops, own) in found.items():
            folder = tmp_path / f"{number}-{viewers}"
            folder.mkdir()
            of_sync, of_stop, said = lateness(folder, viewers)
            syncs += of_sync
            stops += of_stop
            own.append(said)
    for viewers, (syncs, stops, own) in found.items():
        p99 = sorted(syncs)[len(syncs) * 99 // 100] * 1e6
        late_ms = [1e3 * one for one in stops]
        trips, rounds = zip(*own, strict=True)
        show(
            f"SYNC every 10 ms, {viewers} viewers: error of the period",
            f"median {statistics.median(syncs) * 1e6:.0f} µs   99 % {p99:.0f} µs",
        )
        show(
            f"stop after 500 ms of silence, {viewers} viewers: later by",
            f"median {statistics.median(late_ms):.1f} ms   worst {max(late_ms):.1f} ms",
        )
        show(
            f"by the bridge's own account, {viewers} viewers",
            f"stop at most {max(trips):g} ms late, round {max(rounds):g} ms",
        )
        record(f"SYNC error p99, {viewers} viewers", p99)
        record(f"stop after silence, {viewers} viewers", TIMEOUT_S * 1e3 + statistics.median(late_ms))
