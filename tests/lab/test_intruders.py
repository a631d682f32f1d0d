"""Others on the bus of a running bridge: one that enables a drive, a second bridge, a tool that writes. The
bridge's own frames come back to it all the time and are nobody else's."""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from itertools import accumulate, pairwise
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient

from tests.lab.sites import LabSite, lab_site, values
from tests.support.process import Process, drivebridge, drivebridge_called, peer, until
from tests.support.sniffer import Seen, Sniffer, sniffing

SYNC, RPDO1, TPDO1, OWN, NMT = 0x080, 0x205, 0x185, 0x77F, 0x000
SDO, BOOT_QUESTION = 0x605, bytes.fromhex("4000100000000000")
ENABLE = "7f04002000000000"
OTHER_ENABLE = "7f04001000000000"
"""With another setpoint than the owner's: not a frame that the bridge sends itself."""
SILENCE_S = 1.2
"""The longest time after which a second bridge takes over: six times the 0.2 s that it listens."""
NOISE_S = 2.0
DEADMAN_S = 1.0
FULL_SPEED = 0x4000
"""NORD's actual speed and setpoint at 100 % (BU 2500 §6.5.4)."""


class Lab:
    """A simulated node and a bridge on vcan0, and a witness."""

    def __init__(self, folder: Path, stack: ExitStack, bus: str = "") -> None:
        self.folder, self.stack, self.keys = folder, stack, bus
        self.site = self.make_site("first")
        self.bus: Sniffer = stack.enter_context(sniffing())
        simulation = stack.enter_context(drivebridge(folder, "simulate", "simulate", str(self.site.path)))
        simulation.wait_output("simulating")
        self.bridge = self.run_bridge("first", self.site)
        self.bridge.wait_output("node operational")

    def make_site(self, name: str) -> LabSite:
        """The same bus; ports and folders of its own. A busy machine stops nobody."""
        folder = self.folder / name
        folder.mkdir()
        patient = "telegram_downtime_s = 10"
        return lab_site(
            folder,
            timeout_ms=5000,
            bus=f"deadman_ms = 1000\n{self.keys}",
            node="supervision_ms = 5000",
            drives=(patient, patient, patient),
        )

    def run_bridge(self, name: str, site: LabSite) -> Process:
        arguments = ("run", str(site.path), "--role", "bus", "--role", "zenoh")
        bridge = self.stack.enter_context(drivebridge(self.folder, name, *arguments, notify=True))
        bridge.wait_ready()
        return bridge

    def run_drive(self) -> None:
        port, stamps = str(self.site.modbus_port), str(self.folder / "stamps")
        owner = self.stack.enter_context(
            peer(self.folder, "modbus_owner", port, "1", "0.05", stamps, "0x047F", "0x2000")
        )
        owner.wait_output("it runs", 60.0)

    def send(self, can_id: int, data: str, period_s: float = 0.01, count: int = 200) -> float:
        """Somebody sends this; gives when the first frame was on the bus."""
        begin = time.time()
        sender = peer(self.folder, "can_sender", "vcan0", f"{can_id:X}", data, str(period_s), str(count))
        self.stack.enter_context(sender).wait_output("sending", 30.0)
        wanted = bytes.fromhex(data)
        until(lambda: any(f.data == wanted for f in self.bus.of(can_id, begin)), 10.0, "it is sent")
        return next(frame.time for frame in self.bus.of(can_id, begin) if frame.data == wanted)

    def wait_intruders(self, wanted: Callable[[int], bool]) -> None:
        """Until the point is so."""

        def is_so() -> bool:
            with suppress(ValueError):  # no answer in time
                (count,) = values(self.site, "bus/can0/intruders")
                return isinstance(count, int) and wanted(count)
            return False

        until(is_so, 15.0, "bus/can0/intruders")


@pytest.fixture
def make_lab(tmp_path: Path) -> Iterator[Callable[..., Lab]]:
    with ExitStack() as stack:
        yield lambda bus="": Lab(tmp_path, stack, bus)


def stops(bus: Sniffer, since: float) -> list[Seen]:
    return [frame for frame in bus.of(NMT, since) if frame.data[:1] == b"\x02"]


def starts(bus: Sniffer, since: float) -> list[Seen]:
    return [frame for frame in bus.of(NMT, since) if frame.data[:1] == b"\x01"]


def started_share(bus: Sniffer, since: float) -> float:
    """The share of the time in which the node is operational: from each start to the next NMT command."""
    commands = sorted(bus.of(NMT, since), key=lambda frame: frame.time)
    started = sum(then.time - now.time for now, then in pairwise(commands) if now.data[0] == 0x01)
    return started / (commands[-1].time - commands[0].time)


def actual_speed(tpdo1: Seen) -> int:
    return abs(int.from_bytes(tpdo1.data[2:4], "little", signed=True))


@pytest.mark.landing
def test_own_frames_are_never_an_intruders_however_the_words_change(make_lab) -> None:
    """Setpoints that change at full speed, starts and stops, and a hang."""
    lab = make_lab()
    begin = time.time()
    with ModbusTcpClient("127.0.0.1", port=lab.site.modbus_port, timeout=10) as client:
        for n in range(60):
            word = 0x047F if n % 5 else 0x047E
            assert not client.write_registers(0, [word, 100 * n], device_id=1).isError()
            time.sleep(0.01)
        lab.bridge.signal(signal.SIGSTOP)
        time.sleep(0.5)
        lab.bridge.signal(signal.SIGCONT)
        time.sleep(1.5)
    lab.wait_intruders(lambda count: count == 0)
    assert not stops(lab.bus, begin)
    assert "intruder" not in lab.bridge.output() and "passive" not in lab.bridge.output()


def test_who_enables_a_drive_is_told_and_its_node_is_stopped_at_once(make_lab) -> None:
    lab = make_lab()
    first = lab.send(RPDO1, ENABLE)
    until(lambda: bool(stops(lab.bus, first)), 5.0, "the NMT stop")
    assert stops(lab.bus, first)[0].data == b"\x02\x05"
    assert stops(lab.bus, first)[0].time - first <= 0.020 + 0.150
    lab.bridge.wait_output("control word 047Fh, which enables", 5.0)
    lab.bridge.wait_output("NMT stop of conveyor", 5.0)
    lab.wait_intruders(lambda count: count >= 10)
    quiet = time.time()
    time.sleep(0.5)
    assert not lab.bus.of(TPDO1, quiet), "a stopped node has no process data"


@pytest.mark.landing
def test_with_report_it_is_only_told(make_lab) -> None:
    lab = make_lab('on_intruder = "report"')
    first = lab.send(RPDO1, ENABLE, count=20)
    lab.bridge.wait_output("which enables", 5.0)
    lab.wait_intruders(lambda count: count >= 15)
    assert not stops(lab.bus, first)


@pytest.mark.landing
def test_who_goes_on_with_what_was_right_before_is_found(make_lab) -> None:
    """The intruder repeats the owner's own frame; when the owner has stopped, it is an enabling one."""
    lab = make_lab()
    lab.run_drive()
    running = lab.bus.of(RPDO1)[-1].data.hex()
    begin = lab.send(RPDO1, running, period_s=0.005, count=2000)
    until(lambda: bool(stops(lab.bus, begin)), 10.0, "the NMT stop")


@pytest.mark.landing
def test_a_frame_from_the_wire_that_is_like_ours_is_found_at_once(make_lab) -> None:
    """Through the kernel's gateway, frames come as from another machine."""
    lab = make_lab('on_intruder = "report"')
    subprocess.run(["cangw", "-A", "-s", "vcan1", "-d", "vcan0", "-e"], check=True)
    try:
        same = lab.bus.of(RPDO1)[-1]
        with sniffing("vcan1") as far:
            far.send(RPDO1, same.data)
            lab.bridge.wait_output("RPDO of conveyor/fu1 (205h)", 5.0)
    finally:
        subprocess.run(["cangw", "-F"], check=True)
    lab.wait_intruders(lambda count: count == 1)


@pytest.mark.landing
def test_a_tool_that_writes_is_an_intruder_and_one_that_reads_is_told(make_lab) -> None:
    lab = make_lab()
    begin = time.time()
    direct = ("--interface", "socketcan", "--channel", "vcan0")

    def sdo(*arguments: str) -> None:
        drivebridge_called("sdo", *arguments, *direct)

    sdo("read", "5", "1008", "--type", "string")
    lab.bridge.wait_output("SDO request to conveyor (605h): read 1008h:00", 5.0)
    time.sleep(0.2)
    assert not stops(lab.bus, begin)
    sdo("write", "5", "1017", "100", "--type", "uint16", "--yes")
    lab.bridge.wait_output("write 1017h:00", 5.0)
    until(lambda: bool(stops(lab.bus, begin)), 5.0, "the NMT stop")


@pytest.mark.landing
def test_a_second_bridge_stays_passive_and_takes_over_when_the_first_is_gone(make_lab) -> None:
    lab = make_lab()
    lab.run_drive()
    begin = time.time()
    second = lab.run_bridge("second", lab.make_site("second"))
    second.wait_output("passive: another bridge is in charge of this bus", 5.0)
    time.sleep(3.0)
    now = time.time()
    assert not lab.bus.of(NMT, begin)
    assert not [frame for frame in lab.bus.of(SDO, begin) if frame.data == BOOT_QUESTION]
    assert not [frame for frame in lab.bus.of(OWN, begin) if frame.data == b"\0"]
    beats = [frame.time for frame in lab.bus.of(OWN, now - 2.0)]
    assert len(beats) <= 21
    words = {frame.data[:2] for frame in lab.bus.of(RPDO1, begin)}
    assert words == {bytes.fromhex("7f04")}, "the first one is not disturbed"
    assert max(later - earlier for earlier, later in pairwise(beats)) < 0.3
    assert "intruder" not in lab.bridge.output()
    lab.bridge.signal(signal.SIGKILL)
    lab.bridge.popen.wait()
    killed = time.time()
    until(lambda: bool(lab.bus.of(OWN, killed)), 10.0, "the second one takes over")
    assert 0.5 <= lab.bus.of(OWN, killed)[0].time - killed <= SILENCE_S + NOISE_S
    second.wait_output("takes over", 5.0)
    second.wait_output("node operational", 15.0)
    until(lambda: len(lab.bus.of(RPDO1, killed)) > 20, 10.0, "process data")
    assert not [frame for frame in lab.bus.of(RPDO1, killed) if frame.word & 1]


def test_a_hang_with_a_frame_of_a_second_bridge_waiting_stops_the_drive_before_the_bus_is_left(
    make_lab,
) -> None:
    """A stopped process, and one heartbeat with the bridge's own identifier in its inbox."""
    lab = make_lab()
    lab.run_drive()
    lab.bridge.signal(signal.SIGSTOP)
    time.sleep(DEADMAN_S + 0.3)
    # Content that the bridge itself has not sent lately: only by that is a frame of this host another's.
    lab.bus.send(OWN, b"\x7f")
    time.sleep(0.05)
    begin = time.time()
    lab.bridge.signal(signal.SIGCONT)
    lab.bridge.wait_output("passive: another bridge is in charge of this bus", 5.0)
    until(lambda: bool(stops(lab.bus, begin)), 5.0, "the NMT stop")
    left = stops(lab.bus, begin)[0].time
    words = [frame for frame in lab.bus.of(RPDO1, begin) if frame.time <= left]
    assert words and not words[0].word & 1, "the stopped word goes before it"
    assert not [frame for frame in lab.bus.of(RPDO1, begin) if frame.word & 1]
    time.sleep(0.3)
    assert not lab.bus.of(OWN, left + 0.05), "then the bus is left"


@pytest.mark.landing
def test_an_intruder_that_is_a_master_is_answered_as_often_as_it_starts_the_node(make_lab) -> None:
    lab = make_lab()
    lab.run_drive()
    lab.send(RPDO1, OTHER_ENABLE, period_s=0.02, count=400)
    begin = lab.send(NMT, "0105", period_s=0.02, count=150)
    until(lambda: len(starts(lab.bus, begin)) >= 100, 60.0, "the intruder")
    answers = len(stops(lab.bus, begin)) / len(starts(lab.bus, begin))
    assert answers >= 0.5
    assert started_share(lab.bus, begin) <= 0.5
    speeds = [actual_speed(frame) for frame in lab.bus.of(TPDO1, begin)]
    rises = [speed - lowest for speed, lowest in zip(speeds, accumulate(speeds, min), strict=True)]
    assert max(rises) <= 0.1 * FULL_SPEED, "it brakes; each start drives it no longer than to the answer"
    assert speeds[-1] <= 0.1 * FULL_SPEED
    lab.bridge.wait_output("another NMT master is on the bus: it sent start for node 5", 5.0)
    time.sleep(3.0)
    quiet = time.time()
    time.sleep(0.5)
    assert not lab.bus.of(TPDO1, quiet), "the node stays stopped"
