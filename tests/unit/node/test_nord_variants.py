"""The bridge with the NORD nodes beside the SK TU4-CAO on a virtual clock: boot-up, §6.8, faults, watches."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from bridge.command import Action, Code
from bridge.config import load_site
from bridge.drive import DriveState
from bridge.image import Quality
from bridge.mapping import load_family
from bridge.sim.core.nmt_slave import SlaveState
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_single_settings import RJ45_5XX, RJ45_54X, TU3
from bridge.sim.nord.nord_states import NordState
from bridge.sim.nord.nord_tu4 import NordTu4
from tests.support.bench import Bench

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
{node}
[[bus.node.drive]]
slot = "{slot}"
name = "drive"
control = "modbus"
fieldbus_timeout_ms = 200
{drive}
[modbus]
[zenoh]
"""
DRIVE = "lift/drive"
AMPERES = "parameters = { P112 = 10.0 }"
GIVEN = "parameters = { P105 = 50.0, P112 = 10.0 }"
SINGLE = {
    "nord/sk-tu3-cao": TU3,
    "nord/sk-tu3-cao-pdo1": TU3,
    "nord/sk-5xxe-rj45": RJ45_5XX,
    "nord/sk-54xe-rj45": RJ45_54X,
}


@pytest.fixture
def make(tmp_path: Path):
    def make(mapping: str, node_5: Any, *, slot: str = "drive", node: str = "", drive: str = "") -> Bench:
        path = tmp_path / "site.toml"
        path.write_text(SITE.format(mapping=mapping, slot=slot, node=node, drive=drive), encoding="utf-8")
        bench = Bench(load_site(path), family=load_family(mapping), mapping=mapping, node=node_5)
        bench.run(3.0)
        return bench

    return make


@pytest.fixture
def make_single(make):
    def make_single(mapping: str, *, site: dict[str, str] | None = None, **options: Any) -> Bench:
        variant = TU3 if "tu3" in mapping else SINGLE[mapping.removesuffix("-encoder")]
        return make(mapping, NordSingle(5, variant, **options), **(site or {}))

    return make_single


@pytest.fixture
def make_profile(make):
    def make_profile(*, slot: str = "fu1", **options: Any) -> Bench:
        return make("nord/sk-tu4-cao-ds402", NordTu4(5, **options), slot=slot)

    return make_profile


def hold(bench: Bench, seconds: float, **words: float) -> None:
    """Write every 50 ms, as a controller does."""
    for _ in range(round(seconds / 0.05)):
        outcome = bench.write(DRIVE, **words)
        assert outcome.code is Code.OK, outcome
        bench.run(0.05)


def start(bench: Bench, **setpoints: float) -> None:
    hold(bench, 0.05, control_word=0x047E)
    hold(bench, 3.0, control_word=0x047F, **setpoints)


def downloads(bench: Bench, since: int = 0) -> set[str]:
    """Index of each object that was written, as it stands on the wire."""
    return {f.data[1:3].hex() for f in bench.log[since:] if f.can_id == 0x605 and f.data[0] & 0xE0 == 0x20}


def status(bench: Bench) -> str:
    return str(bench.value("lift/node/boot_status"))


# §6.8 as a dialogue, for every family that has a frequency word.


@pytest.mark.landing(4)
@pytest.mark.parametrize("mapping", SINGLE)
def test_6_8_switching_a_drive_on_and_off(make_single, mapping: str):
    bench = make_single(mapping)
    assert bench.number(f"{DRIVE}/status/status_word") & 0xFF == 0x40
    for word, setpoint, low_byte, value, hz in (
        (0x047E, 0x0000, 0x31, 0x0000, 0.0),
        (0x047F, 0x2000, 0x37, 0x2000, 25.0),
        (0x047E, 0x2000, 0x31, 0x0000, 0.0),
        (0x047F, 0x1000, 0x37, 0x1000, 12.5),
    ):
        hold(bench, 3.0, control_word=word, setpoint_1=setpoint)
        assert bench.number(f"{DRIVE}/status/status_word") & 0xFF == low_byte
        assert bench.value(f"{DRIVE}/actual/value_1") == value
        assert bench.value(f"{DRIVE}/actual/frequency") == hz


@pytest.mark.landing(4)
@pytest.mark.parametrize("mapping", SINGLE)
def test_p105_is_read_from_the_drive_and_scales(make_single, mapping: str):
    bench = make_single(mapping, p105_hz=80.0)
    start(bench, frequency=40.0)
    assert bench.node.drive.output_hz == 40.0
    assert bench.value(f"{DRIVE}/actual/frequency") == 40.0


# The views of the SK TU3-CAO.


def test_the_second_view_switches_its_tpdo_on(make_single):
    bench = make_single("nord/sk-tu3-cao", site={"drive": AMPERES})
    assert "1801h: COB-ID 285h, on" in status(bench)
    assert bench.node.slave.state is SlaveState.OPERATIONAL
    start(bench, frequency=25.0)
    assert bench.sent(0x305)[-1].data.hex() == "7f04002000000000"
    assert len(bench.sent(0x285)[-1].data) == 8
    assert bench.value(f"{DRIVE}/actual/current") == pytest.approx(4.75, abs=0.01)
    assert not bench.sent(0x205)


def test_a_view_that_is_on_already_is_not_written(make_single):
    bench = make_single("nord/sk-tu3-cao-pdo1")
    assert downloads(bench) <= {"1710"}, "the heartbeat at most"
    start(bench, frequency=25.0)
    assert bench.sent(0x205)[-1].data.hex() == "7f040020"
    assert bench.node.drive.output_hz == 25.0


def test_the_third_view_carries_a_position(make):
    node = NordSingle(5, TU3)
    for number, meaning in ((546, 23), (547, 24), (548, 1), (543, 10), (544, 15), (545, 1), (600, 2)):
        node.drive.parameters.commission(number, meaning)
    bench = make("nord/sk-tu3-cao-pdo3", node)
    bench.node.drive.position_increments = 2_800_758.0
    start(bench, position=2800.758, frequency=0.0)
    assert bench.sent(0x405)[-1].data.hex() == "7f0476bc2a000000"
    assert bench.sent(0x385)[-1].data[2:6].hex() == "76bc2a00", "§6.6.1: 2800.758 rev = 002ABC76h"
    assert bench.value(f"{DRIVE}/actual/position") == pytest.approx(2800.758, abs=1e-6)
    start(bench, frequency=25.0, position=3000.0)
    assert bench.value(f"{DRIVE}/actual/frequency") == 25.0
    position = bench.value(f"{DRIVE}/actual/position")
    assert isinstance(position, float)
    assert position > 2800.758 + 10
    refused = bench.write(DRIVE, position=50_000.001)
    assert refused.code is Code.OUT_OF_RANGE


def test_the_fourth_view_has_the_words_alone(make_single):
    bench = make_single("nord/sk-tu3-cao-pdo4")
    start(bench)
    assert bench.sent(0x505)[-1].data.hex() == "7f04"
    assert bench.value(f"{DRIVE}/status/state") == DriveState.OPERATION_ENABLED
    names = {point.name for point in bench.plant.image.points}
    assert f"{DRIVE}/command/control_word" in names
    assert not {name for name in names if name.startswith((f"{DRIVE}/actual/", f"{DRIVE}/command/setpoint"))}


def test_a_view_that_the_node_maps_otherwise_is_brought_into_order(make):
    node = NordSingle(5)
    tpdo = node._communication.current.tpdo[1]
    tpdo.entries, tpdo.count = [0x3001_0010, 0x3003_0310, 0, 0], 2
    node._communication.save()
    bench = make("nord/sk-tu3-cao", node)
    assert "1A01h = 3001:00/16 3003:01/16 3003:02/16 3003:03/16" in status(bench)
    assert node.slave.state is SlaveState.OPERATIONAL


# RJ45


def test_54xe_serves_values_4_and_5(make_single):
    bench = make_single("nord/sk-54xe-rj45")
    bench.node.drive.parameters.commission(546, 0)
    bench.node.drive.parameters._ram[546, 4, 1] = 1
    bench.node.drive.parameters._ram[543, 5, 1] = 1
    start(bench, setpoint_4=0x2000, setpoint_5=0x0111)
    assert bench.sent(0x305)[-1].data.hex() == "00201101", "4 bytes, not 5"
    assert bench.node.drive.output_hz == 25.0
    assert bench.value(f"{DRIVE}/actual/value_5") == 0x2000


def test_54xe_works_without_its_second_pdos(make_single):
    bench = make_single("nord/sk-54xe-rj45", site={"drive": OFF})
    start(bench, frequency=25.0)
    assert bench.node.drive.output_hz == 25.0
    assert not bench.sent(0x305)
    assert bench.plant.image.read(f"{DRIVE}/actual/value_4").quality is Quality.CONFIG_ERROR


OFF = """
[[bus.node.drive.rpdo]]
number = 2
enable = false
[[bus.node.drive.tpdo]]
number = 2
enable = false
"""


@pytest.mark.landing(2)
@pytest.mark.parametrize("mapping", ["nord/sk-5xxe-rj45", "nord/sk-54xe-rj45"])
def test_nobody_tells_the_drive_a_position_unasked(make_single, mapping: str):
    bench = make_single(mapping)
    bench.node.drive.position_increments = 4711.0
    start(bench, frequency=0.0)
    assert bench.node.drive.position_increments == 4711.0
    assert not [frame for frame in bench.log if frame.can_id == (0x305 if "5xxe" in mapping else 0x405)]


@pytest.mark.landing(2)
@pytest.mark.parametrize(
    ("mapping", "cob_id"), [("nord/sk-5xxe-rj45-encoder", 0x305), ("nord/sk-54xe-rj45-encoder", 0x405)]
)
def test_a_controller_may_play_the_encoder(make_single, mapping: str, cob_id: int):
    bench = make_single(mapping)
    start(bench, frequency=0.0, encoder_position=-2)
    assert bench.sent(cob_id)[-1].data.hex() == "feffffff"
    assert bench.node.drive.position_increments == -2


# Faults and watches


@pytest.mark.landing(4)
@pytest.mark.parametrize("mapping", SINGLE)
def test_a_fault_is_told_by_its_number_and_acknowledged(make_single, mapping: str):
    bench = make_single(mapping)
    start(bench, frequency=25.0)
    bench.node.fail_drive(21)
    hold(bench, 2.0, control_word=0x047F)
    assert bench.value(f"{DRIVE}/status/state") == DriveState.FAULT
    assert bench.value(f"{DRIVE}/status/fault_text") == "E002/2.1 overtemperature of the motor, I²t"
    assert bench.value(f"{DRIVE}/supervision/current_fault") == 2.1
    hold(bench, 0.2, control_word=0x047E)
    hold(bench, 0.2, control_word=0x04FE)
    hold(bench, 2.0, control_word=0x047E)
    assert bench.value(f"{DRIVE}/supervision/current_fault") == 0
    assert bench.value(f"{DRIVE}/status/state") == DriveState.READY
    assert bench.value(f"{DRIVE}/supervision/last_fault") == 2.1


@pytest.mark.landing(4)
@pytest.mark.parametrize("mapping", SINGLE)
def test_a_silent_bridge_is_stopped_by_p513(make_single, mapping: str):
    bench = make_single(mapping, p513_s=0.3)
    start(bench, frequency=25.0)
    assert bench.node.drive.state is NordState.ENABLED
    bench.cut = True
    bench.run(0.4)
    assert (bench.node.drive.fault_tenths, bench.node.drive.output_hz) == (102, 0.0)


def test_the_link_of_a_tu3_is_told_as_10_8(make_single):
    bench = make_single("nord/sk-tu3-cao")
    start(bench, frequency=25.0)
    bench.node.drop_drive()
    hold(bench, 1.0, control_word=0x047F)
    assert bench.node.drive.state is NordState.FAULT
    assert bench.value(f"{DRIVE}/status/state") == DriveState.NOT_READY, "the interface has no status of it"
    bench.node.restore_drive()
    hold(bench, 2.0, control_word=0x047E)
    assert bench.value(f"{DRIVE}/supervision/current_fault") == 10.8
    assert "communication fault" in str(bench.value(f"{DRIVE}/status/fault_text"))
    assert bench.sent(0x085)[-1].data.hex() == "0050010000000000"


# The drive profile


def test_the_profile_is_turned_on_and_mapped(make_profile):
    bench = make_profile()
    assert bench.node.profile.is_on
    assert "20A8:01 = 1" in status(bench)
    assert bench.node.slave.state is SlaveState.OPERATIONAL
    start(bench, velocity=-750.0)
    assert bench.sent(0x205)[-1].data.hex() == "7f0412fd"
    assert bench.node.drives[0].output_hz == -25.0
    assert bench.value(f"{DRIVE}/actual/velocity") == -750.0
    assert bench.number(f"{DRIVE}/status/status_word") & 0x1000, "turning left"


def test_the_profile_of_a_node_that_has_it_is_not_written_again(make_profile):
    bench = make_profile()
    assert {"a820", "0016", "001a"} <= downloads(bench)
    bench.node.slave._dictionary.find(0x1010, 1).download(b"save")
    bench.node.power_cycle()
    before = len(bench.log)
    bench.run(4.0)
    assert bench.node.slave.state is SlaveState.OPERATIONAL
    assert downloads(bench, before) <= {"1710"}


@pytest.mark.landing
def test_every_drive_has_its_own_objects_of_the_profile(make_profile):
    bench = make_profile(slot="fu3")
    start(bench, velocity=600.0)
    assert bench.node.drives[2].output_hz == 20.0
    assert bench.node.drives[0].output_hz == 0.0
    assert bench.value(f"{DRIVE}/actual/velocity") == 600.0


def test_the_direction_of_the_profile_is_the_sign(make_profile):
    bench = make_profile()
    assert bench.ask(Action.START, DRIVE, direction=-1).code is Code.OUT_OF_RANGE


def test_p151_watches_in_the_profile_too(make_profile):
    bench = make_profile(p151_ms=300)
    start(bench, velocity=600.0)
    bench.cut = True
    bench.run(0.4)
    assert bench.node.drives[0].fault_tenths == 103


# The SK CU4-CAO


@pytest.mark.landing(2)
@pytest.mark.parametrize("layout", ["three", "five"])
def test_a_cu4_is_a_tu4_in_either_layout(make, layout: str):
    bench = make(
        "nord/sk-cu4-cao", NordTu4(5, kind="SK CU4-CAO", layout=layout), slot="fu3", node="sdo_channels = [3]"
    )
    assert bench.value(f"{DRIVE}/identity/device_name") == "SK CU4-CAO"
    start(bench, frequency=25.0)
    assert [drive.output_hz for drive in bench.node.drives] == [0.0, 0.0, 25.0, 0.0]
    assert bench.value(f"{DRIVE}/actual/frequency") == 25.0
