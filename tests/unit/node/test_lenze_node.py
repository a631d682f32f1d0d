"""The bridge and an 8400 motec on a virtual clock: boot-up, a drive that runs, faults, supervision."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.command import Code, Outcome, Request, Start
from bridge.config import load_site
from bridge.drive import DriveState
from bridge.image import Quality
from bridge.mapping import load_family
from bridge.sim.lenze.lenze_drive import DeviceState, Reaction
from bridge.sim.lenze.lenze_motec import LenzeMotec
from bridge.sim.lenze.lenze_settings import LenzeCodes
from tests.support.bench import PLC, Bench

NAME = "lenze/8400-motec"
DRIVE = "conveyor/drive"
SITE = """
[site]
name = "bench"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "conveyor"
id = 5
mapping = "lenze/8400-motec"
{node}
[[bus.node.drive]]
slot = "drive"
control = "modbus"
fieldbus_timeout_ms = 500
[modbus]
"""
SUPERVISED = """
configure = [
  { object = "5E9A:01", type = "uint16", value = 300 },
  { object = "5DAE:01", type = "uint8", value = 1 },
  { object = "1016:01", type = "uint32", value = 0x7F012C },
  { object = "5DAF:05", type = "uint8", value = 1 },
]
"""
WORDS = {"stop": 0x0001, "run": 0x0009, "reset": 0x0081}


@pytest.fixture
def booted(tmp_path: Path):
    def boot(node: str = "", **codes) -> Bench:
        path = tmp_path / "site.toml"
        path.write_text(SITE.format(node=node), encoding="utf-8")
        drive = LenzeMotec(5, codes=LenzeCodes(5, **codes))
        bench = Bench(load_site(path), family=load_family(NAME), mapping=NAME, node=drive)
        bench.run(2.0)
        return bench

    return boot


def boot_status(bench: Bench) -> str:
    return str(bench.value("conveyor/node/boot_status"))


def keep_running(bench: Bench, seconds: float, velocity: float = 750.0) -> None:
    for _ in range(round(seconds / 0.05)):
        assert bench.write(DRIVE, control_word=WORDS["run"], velocity=velocity).code is Code.OK
        bench.run(0.05)


def start(bench: Bench) -> None:
    bench.write(DRIVE, control_word=WORDS["stop"])
    bench.run(0.05)
    keep_running(bench, 2.0)
    assert bench.node.drive.speed_rpm == pytest.approx(750.0, abs=0.1)


def test_it_boots_and_says_that_the_drive_does_nothing_by_itself(booted) -> None:
    bench = booted()
    assert boot_status(bench).startswith("ok")
    assert "runs on when the bridge falls silent: C00593/1 is 0 (no reaction)" in boot_status(bench)
    assert bench.plant.drives[DRIVE].quality is Quality.GOOD
    assert bench.plant.drives[DRIVE].channel.state is DriveState.READY
    assert bench.value("conveyor/drive/identity/vendor") == 0x3B


def test_the_words_are_those_of_the_file_although_the_node_shows_no_mapping(booted) -> None:
    bench = booted()
    assert not [frame for frame in bench.sent(0x605) if frame.data[1:3] in (b"\x00\x16", b"\x00\x1a")]
    assert {len(frame.data) for frame in bench.sent(0x205)} == {8}
    assert {len(frame.data) for frame in bench.sent(0x305)} == {8}


def test_a_drive_that_is_not_controlled_by_the_network_has_no_velocity(booted) -> None:
    """§8.2: C00007 = 40 makes the words what they are."""
    bench = booted(control_mode=10)
    velocity = bench.plant.image.read("conveyor/drive/actual/velocity")
    assert (velocity.quality, velocity.reason) == (Quality.DISABLED, "not in the telegram: C00007 is 10")
    refused = bench.write(DRIVE, control_word=WORDS["run"], velocity=100.0)
    assert refused.code is Code.NOT_CONFIGURED


def test_a_drive_that_is_taken_from_the_network_loses_its_velocity(booted) -> None:
    bench = booted()
    assert bench.plant.image.read("conveyor/drive/actual/velocity").quality is Quality.GOOD
    bench.node.codes.control_mode = 10
    bench.run(10.0)
    assert bench.plant.image.read("conveyor/drive/actual/velocity").quality is Quality.DISABLED


def test_it_follows_the_setpoint_and_stops(booted) -> None:
    bench = booted()
    start(bench)
    assert bench.value("conveyor/drive/actual/velocity") == pytest.approx(750.0, abs=0.1)
    assert bench.write(DRIVE, control_word=WORDS["stop"]).code is Code.OK
    bench.run(1.5)
    assert bench.node.drive.speed_rpm == 0.0


def test_start_leads_to_operation_enabled(booted) -> None:
    bench = booted()
    outcomes: list[Outcome] = []
    bench.view.submit(Request(PLC, DRIVE, Start()), outcomes.append)
    bench.run(0.2)
    assert [outcome.code for outcome in outcomes] == [Code.OK]
    assert bench.node.drive.state is DeviceState.OPERATION_ENABLED


def test_a_fault_is_shown_with_its_number_and_acknowledged(booted) -> None:
    bench = booted()
    start(bench)
    bench.node.fail(0x007F_0002)
    bench.run(0.1)
    channel = bench.plant.drives[DRIVE].channel
    assert channel.state is DriveState.FAULT
    assert channel.emcy_code == 0xF000
    assert bench.node.drive.speed_rpm < 750.0
    bench.write(DRIVE, control_word=WORDS["stop"])
    bench.run(0.05)
    bench.write(DRIVE, control_word=WORDS["reset"])
    bench.run(0.2)
    assert channel.state is DriveState.SWITCHED_ON


def test_a_silent_controller_stops_the_drive(booted) -> None:
    bench = booted()
    start(bench)
    bench.run(0.6)
    assert bench.node.drive.state is not DeviceState.OPERATION_ENABLED
    bench.run(2.0)
    assert bench.node.drive.speed_rpm == 0.0


def test_at_factory_a_dead_bridge_lets_the_drive_run(booted) -> None:
    bench = booted()
    start(bench)
    bench.cut = True
    bench.hang(5.0)
    assert bench.node.drive.speed_rpm == pytest.approx(750.0, abs=0.1)


def test_configured_it_stops_when_the_bridge_falls_silent(booted) -> None:
    bench = booted(SUPERVISED)
    assert boot_status(bench).startswith("ok")
    assert "runs on" not in boot_status(bench)
    start(bench)
    bench.cut = True
    bench.hang(0.7)  # the bursts end after the dead-man time, then 300 ms
    assert bench.node.drive.state is DeviceState.FAULT
    codes = {int.from_bytes(frame.data[:2], "little") for frame in bench.sent(0x085)}
    assert codes == {0x8130, 0xF000}, "the heartbeat, and what C00593/1 and C00592/5 make of it"


def test_the_lenze_base_identifier_is_taken_from_the_node(booted) -> None:
    """§7.1.1: RPDO2 at 281h + node id."""
    bench = booted(cob_source=[0, 0])
    assert boot_status(bench).startswith("ok")
    assert bench.sent(0x286)
    assert not bench.sent(0x305)


def test_a_second_pdo_that_is_off_leaves_the_drive_working(booted) -> None:
    bench = booted(pdo_off=[0, 0, 1, 1])
    assert bench.plant.drives[DRIVE].quality is Quality.GOOD
    assert not bench.sent(0x305)
    start(bench)
    assert bench.plant.image.read("conveyor/drive/actual/value_4").quality is Quality.CONFIG_ERROR


def test_a_drive_that_is_a_master_is_noticed(booted) -> None:
    """§7.2.3: it starts every node; the bridge did not send that."""
    bench = booted(master=1)
    bench.run(2.0)
    messages = [event.message for event in bench.events]
    assert any("another NMT master is on the bus: it sent start" in message for message in messages)


def test_a_lasting_trouble_is_a_fault_without_an_acknowledge(booted) -> None:
    bench = booted()
    start(bench)
    bench.node.fail(7, Reaction.TROUBLE)
    bench.run(0.1)
    assert bench.plant.drives[DRIVE].channel.state is DriveState.FAULT
