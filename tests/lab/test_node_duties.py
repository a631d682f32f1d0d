"""What a node is given at boot-up and told in operation, in one start of the bridge: a node that is found in
Stopped, its configuration from a DCF and the site file, synchronous PDOs, and its emergency messages."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.lab.sites import LabSite, lab_site, values
from tests.support.process import Process, drivebridge, peer, until
from tests.support.sniffer import Seen, Sniffer, sniffing

NMT, SYNC, EMCY, TPDO1, TPDO2, RPDO1, SDO, SDO_REPLY = 0x000, 0x080, 0x085, 0x185, 0x285, 0x205, 0x605, 0x585
STOP, PRE_OPERATIONAL, START = b"\x02\x05", b"\x80\x05", b"\x01\x05"
IN_FAULT = bytes.fromhex("080B000000000000")
STOPPED_WORDS = bytes.fromhex("0004000000000000")
INHIBIT_100US, P151_MS = 50, 2000
WRITE_1015 = bytes.fromhex("2B15100032000000")
WRITE_P151 = bytes.fromhex("2B972001D0070000")
SAVE = bytes.fromhex("23101001") + b"save"
SYNC_S, WINDOW_S = 0.2, 0.15
NODE = f"""
configuration = "conveyor.dcf"
configuration_store = true
configure = [{{ object = "2097:01", type = "uint16", value = {P151_MS} }}]
"""
DCF = f"""[DeviceComissioning]
NodeID=5
[1015]
ParameterName=Inhibit time EMCY
DataType=0x0006
AccessType=rw
DefaultValue=0
ParameterValue={INHIBIT_100US}
"""
BUS = f"""
sync_period_ms = {SYNC_S * 1000:.0f}
sync_window_us = {WINDOW_S * 1e6:.0f}
rpdo_period_ms = 20
"""
DRIVE = "rpdo = { transmission_type = 1 }\ntpdo = { transmission_type = 1 }"


@dataclass(frozen=True, slots=True)
class Lab:
    folder: Path
    site: LabSite
    bus: Sniffer
    bridge: Process
    began: float

    def asked(self) -> list[bytes]:
        """All SDO requests to the node."""
        return [frame.data for frame in self.bus.of(SDO, self.began)]


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    folder = tmp_path_factory.mktemp("lab")
    (folder / "conveyor.dcf").write_text(DCF, "utf-8")
    site = lab_site(
        folder, timeout_ms=5000, controls=("modbus", "zenoh"), bus=BUS, node=NODE, drives=(DRIVE, "")
    )
    with ExitStack() as stack:
        bus = stack.enter_context(sniffing())
        simulation = stack.enter_context(drivebridge(folder, "simulate", "simulate", str(site.path)))
        simulation.wait_output("simulating")
        until(lambda: bus.of(0x705), 10.0, "the node's boot-up message")
        bus.send(NMT, STOP)
        bus.send(SDO, bytes.fromhex("4000100000000000"))
        time.sleep(0.5)
        assert not bus.of(SDO_REPLY), "a stopped node has no SDO"
        began = time.time()
        bridge = stack.enter_context(run(folder, site, "run"))
        bridge.wait_ready()
        bridge.wait_output("node operational")
        yield Lab(folder, site, bus, bridge, began)


def run(folder: Path, site: LabSite, name: str) -> AbstractContextManager[Process]:
    return drivebridge(folder, name, "run", str(site.path), "--role", "bus", "--role", "zenoh", notify=True)


def first(frames: list[Seen], data: bytes) -> float:
    return next(frame.time for frame in frames if frame.data == data)


def test_a_stopped_node_gets_stopped_words_and_is_woken(lab: Lab) -> None:
    commands = lab.bus.of(NMT, lab.began)
    woken = first(commands, PRE_OPERATIONAL)
    assert first(lab.bus.of(RPDO1, lab.began), STOPPED_WORDS) < woken
    assert lab.bus.of(SDO_REPLY)[0].time > woken
    assert first(commands, START) > woken


@pytest.mark.landing
def test_its_configuration_is_written_where_it_differs_and_stored_once(lab: Lab) -> None:
    asked = lab.asked()
    assert [asked.count(request) for request in (WRITE_1015, WRITE_P151, SAVE)] == [1, 1, 1]
    assert max(asked.index(WRITE_1015), asked.index(WRITE_P151)) < asked.index(SAVE)
    assert asked.index(WRITE_1015) < asked.index(WRITE_P151), "the file first, then the site file"


def test_synchronous_pdos_come_with_sync_and_within_the_window(lab: Lab) -> None:
    assert bytes.fromhex("2F00140201000000") in lab.asked(), "RPDO1 by SDO"
    assert bytes.fromhex("2F00180201000000") in lab.asked(), "TPDO1 by SDO"
    begin = time.time()
    time.sleep(3.0)
    syncs = [frame.time for frame in lab.bus.of(SYNC, begin)]
    tpdos = [frame.time for frame in lab.bus.of(TPDO1, begin)]
    assert len(syncs) > 10
    assert abs(len(tpdos) - len(syncs)) <= 2, "one with each SYNC, and none between"
    after = [min(tpdo - sync for sync in syncs if sync <= tpdo) for tpdo in tpdos if tpdo > syncs[0]]
    within = [delay for delay in after if delay <= WINDOW_S]
    assert len(within) >= 0.7 * len(after), after
    misses = "bus/can0/sync_window_misses"
    [before] = values(lab.site, misses)
    late = lab.bus.of(TPDO1)[-1].data
    end = time.monotonic() + 2.0
    while time.monotonic() < end:
        if WINDOW_S < time.time() - lab.bus.of(SYNC)[-1].time < SYNC_S:
            lab.bus.send(TPDO1, late)
        time.sleep(0.01)
    [now] = values(lab.site, misses)
    assert isinstance(before, int)
    assert isinstance(now, int)
    assert now > before + 5


@pytest.mark.landing
def test_an_emergency_is_told_of_its_drive_in_the_words_of_its_family(lab: Lab) -> None:
    """BU 2500 §8.3: code 2310h, byte 3 the drive, 1 for FU2. Its text is that of the fault for as long as the
    drive says that it is in fault."""
    text = "3.0 overcurrent of the inverter"
    lab.bus.send(EMCY, bytes.fromhex("1023090100000000"))
    lab.bridge.wait_output(f"conveyor/fu2: emergency 2310h: {text}", 10.0)
    drive = "conveyor/{}/status/emcy_code"
    codes = values(lab.site, drive.format("fu1"), drive.format("fu2"))
    assert codes == [0, 0x2310]
    [history] = values(lab.site, "conveyor/node/emcy_history")
    assert isinstance(history, str)
    told = json.loads(history)[0]
    assert (told["code"], told["register"], told["text"]) == ("2310h", "09h", text)
    fault = "drives/lab/conveyor/fu2/status/fault_text="
    question = [word for _ in range(20) for word in (fault, "@0.02")]
    with peer(lab.folder, "zenoh_ask", lab.site.zenoh_endpoint, *question) as asking:
        while asking.popen.poll() is None:
            lab.bus.send(TPDO2, IN_FAULT)  # its own TPDO soon says that it is well again
            time.sleep(0.005)
        assert text in asking.output()


@pytest.mark.landing
def test_a_bridge_that_starts_anew_writes_nothing_that_is_there_already(lab: Lab) -> None:
    """The last one: it ends the bridge of the others."""
    lab.bridge.stop()
    again = time.time()
    with run(lab.folder, lab.site, "again") as bridge:
        bridge.wait_ready()
        bridge.wait_output("node operational")
        asked = [frame.data for frame in lab.bus.of(SDO, again)]
        assert bytes.fromhex("4097200100000000") in asked, "it is compared"
        assert not {WRITE_1015, WRITE_P151, SAVE} & set(asked)
