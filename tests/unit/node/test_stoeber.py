"""The bridge with a simulated STÖBER 5000 on a virtual clock: boot-up, guarding, motion, faults."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from bridge.canopen.frame import REMOTE
from bridge.command import Action, Code, Outcome, Request, Start
from bridge.config import load_site
from bridge.drive import DriveState
from bridge.image import Quality
from bridge.mapping import load_family
from bridge.sim.core.nmt_slave import SlaveState
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000
from bridge.sim.stoeber.stoeber_axis import AxisState
from tests.support.bench import PLC, Bench

SITE = """
[site]
name = "bench"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "lift"
id = 5
mapping = "{mapping}"
supervision = "guarding"
supervision_ms = 100
{node}
{drives}
[modbus]
[zenoh]
"""
DRIVE = """
[[bus.node.drive]]
slot = "{slot}"
control = "modbus"
fieldbus_timeout_ms = 200
"""


@pytest.fixture
def make(tmp_path: Path):
    def make(
        mapping: str = "stoeber/5000",
        slots: tuple[str, ...] = ("axis1",),
        node: str = "",
        drive: str = "",
        **options: Any,
    ) -> Bench:
        drives = "".join(DRIVE.format(slot=slot) for slot in slots) + drive
        path = tmp_path / "site.toml"
        path.write_text(SITE.format(mapping=mapping, node=node, drives=drives), encoding="utf-8")
        family = load_family(mapping)
        node_5 = Stoeber5000(5, **options)
        bench = Bench(load_site(path), family=family, mapping=mapping, node=node_5)
        bench.run(3.0)
        return bench

    return make


@pytest.fixture
def bench(make) -> Bench:
    return make()


DRIVE_1 = "lift/drive"


def start(bench: Bench, rpm: float = 1500.0, drive: str = DRIVE_1) -> None:
    """As a controller does: ready, run, and go on writing."""
    bench.write(drive, control_word=0)
    bench.run(0.05)
    for _ in range(30):
        outcome = bench.write(drive, control_word=1, velocity=rpm)
        assert outcome.code is Code.OK, outcome
        bench.run(0.05)


def test_the_boot_up_takes_the_mapping_as_the_drive_has_it(bench: Bench):
    assert bench.node.slave.state is SlaveState.OPERATIONAL
    status = bench.value("lift/node/boot_status")
    assert "not" not in str(status), status
    assert bench.value("lift/drive/status/state") == DriveState.SWITCH_ON_INHIBITED, "by the quick stop"
    assert bench.value("lift/drive/identity/vendor") == 0xB9
    assert downloads(bench) == {"0c10", "0d10"}, "guard time and factor alone"


def test_the_drive_is_guarded(bench: Bench):
    bench.run(1.0)
    requests = [f for f in bench.log if f.can_id == 0x705 | REMOTE]
    answers = [f.data[0] for f in bench.sent(0x705) if f.data[0]]
    assert len(requests) > 8
    assert {one & 0x80 for one in answers[-2:]} == {0, 0x80}
    assert bench.value("lift/node/supervision_state") == "guarding: operational"


def test_it_turns_as_fast_as_it_is_told(bench: Bench):
    start(bench, -750.0)
    assert bench.value("lift/drive/status/state") == DriveState.OPERATION_ENABLED
    assert bench.node.axes[0].speed_rpm == -750
    assert bench.value("lift/drive/actual/velocity") == -750.0
    assert bench.value("lift/drive/actual/current") == pytest.approx(2.2, abs=0.1)
    assert bench.number("lift/drive/status/status_word") == 0x2104
    assert bench.sent(0x205)[-1].data.hex(" ") == "01 06 ff", "three bytes: A180 and -25.0 %"


def test_a_silent_controller_stops_it(bench: Bench):
    start(bench)
    bench.run(0.25)
    assert bench.node.axes[0].control & 1 == 0
    assert bench.value("lift/drive/status/state") == DriveState.FAULT
    bench.run(1.5)
    assert bench.node.axes[0].speed_rpm == 0


def test_a_silent_bridge_is_stopped_by_life_guarding(bench: Bench):
    start(bench)
    bench.cut = True
    bench.run(1.0)
    assert bench.node.device.event == 52
    assert bench.node.axes[0].speed_rpm == 0
    assert bench.node.slave.state is SlaveState.PRE_OPERATIONAL


@pytest.mark.landing(2)
@pytest.mark.parametrize("action", [Action.STOP, Action.QUICK_STOP])
def test_stop_and_quick_stop_brake(bench: Bench, action: Action):
    start(bench)
    bench.ask(action, DRIVE_1)
    bench.run(0.05)
    assert bench.node.axes[0].state is AxisState.QUICK_STOP
    bench.run(0.1)
    assert bench.node.axes[0].speed_rpm == 0


def test_a_fault_is_told_by_its_event_and_acknowledged(bench: Bench):
    assert bench.value("lift/drive/supervision/current_fault") == 0, "30 means: no event"
    start(bench)
    bench.node.fail(41, 2)
    for _ in range(10):
        bench.write(DRIVE_1, control_word=1, velocity=1500.0)
        bench.run(0.05)
    assert bench.value("lift/drive/status/state") == DriveState.FAULT
    assert "temperature of the motor" in str(bench.value("lift/drive/status/fault_text"))
    assert bench.value("lift/drive/supervision/current_fault") == 41
    for word in (0, 2, 0):
        bench.write(DRIVE_1, control_word=word)
        bench.run(0.1)
    assert bench.node.device.event == 30
    start(bench)
    assert bench.value("lift/drive/actual/velocity") == 1500.0
    assert bench.value("lift/drive/status/fault_text") == ""
    assert bench.value("lift/drive/supervision/current_fault") == 0
    assert bench.value("lift/drive/supervision/last_fault") == 41


def test_start_and_release(bench: Bench):
    bench.write(velocity=300.0, drive=DRIVE_1)
    outcomes: list[Outcome] = []
    bench.view.submit(Request(PLC, DRIVE_1, Start()), outcomes.append)
    bench.run(0.15)
    assert [outcome.code for outcome in outcomes] == [Code.OK]
    assert bench.node.axes[0].state is AxisState.ENABLED


RPDO_MAPPING = """
[bus.node.drive.rpdo]
mapping = ["20B4:00/8", "26E6:00/{bits}"]
"""


def downloads(bench: Bench) -> set[str]:
    """Index of each object that was written, as it stands on the wire."""
    return {f.data[1:3].hex() for f in bench.sent(0x605) if f.data[0] & 0xE0 == 0x20}


def test_a_mapping_that_is_there_already_is_not_written(make):
    """The drive's count is always 6, and reads 0 in the places that it does not use."""
    bench = make(drive=RPDO_MAPPING.format(bits=16))
    assert downloads(bench) == {"0c10", "0d10"}
    assert bench.node.slave.state is SlaveState.OPERATIONAL


def test_a_mapping_cannot_be_changed_and_the_boot_up_says_why(make):
    bench = make(drive=RPDO_MAPPING.format(bits=32))
    assert "1600h:00" in str(bench.value("lift/node/boot_status"))


def test_a_drive_without_an_application_says_what_is_missing(make):
    bench = make(mapped=False)
    status = str(bench.value("lift/node/boot_status"))
    assert "does not carry the control word" in status
    assert bench.plant.image.read("lift/drive/status/status_word").quality is Quality.CONFIG_ERROR


FOUR = ("axis1", "axis2", "axis3", "axis4")


@pytest.mark.landing
def test_four_axes_one_at_a_time(make):
    bench = make("stoeber/5000-four-axes", FOUR, "sdo_channels = [2, 3, 4]", axes=4)
    start(bench, 900.0, "lift/axis3")
    assert bench.value("lift/axis3/status/state") == DriveState.OPERATION_ENABLED
    assert bench.value("lift/axis3/actual/velocity") == 900.0
    bench.write("lift/axis1", control_word=0)
    bench.run(0.05)
    assert bench.value("lift/axis1/status/state") == DriveState.SWITCH_ON_INHIBITED, "axis 3 is on"
    assert bench.value("lift/axis1/actual/velocity") == 0.0
    for drive in ("lift/axis1", "lift/axis3"):
        bench.ask(Action.RELEASE_CONTROL, drive)
    bench.run(1.0)
    start(bench, 300.0, "lift/axis1")
    assert bench.value("lift/axis1/actual/velocity") == 300.0


@pytest.mark.landing
def test_sdo_channel_n_reads_the_scaling_of_axis_n(make):
    mapping = "stoeber/5000-four-axes"
    bench = make(mapping, FOUR, "sdo_channels = [2, 3, 4]", axes=4)
    bench.node.commission(1, c01_rpm=1000)
    bench.node.power_cycle()
    bench.run(4.0)
    start(bench, 500.0, "lift/axis2")
    assert bench.sent(0x305)[-1].data.hex(" ") == "01 f4 01", "50.0 % of 1000 1/min"
    assert bench.node.axes[1].speed_rpm == 500
