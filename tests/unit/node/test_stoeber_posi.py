"""The bridge with a simulated STÖBER 5000 that positions (ID 441684.06 §10), on a virtual clock."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from bridge.command import Action, Code
from bridge.config import load_site
from bridge.drive import DriveState
from bridge.image import Quality
from bridge.mapping import load_family
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000
from bridge.sim.stoeber.stoeber_axis import AxisState
from bridge.sim.stoeber.stoeber_posi import HOME_AT, PositioningAxis
from tests.support.bench import Bench

MAPPING = "stoeber/5000-posi"
DRIVE = "lift/drive"
SITE = f"""
[site]
name = "bench"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "lift"
id = 1
mapping = "{MAPPING}"
supervision = "guarding"
supervision_ms = 100
[[bus.node.drive]]
slot = "axis1"
control = "modbus"
fieldbus_timeout_ms = 200
[modbus]
"""
READY, ABSOLUTE, HOMING, START = 0x0000, 0x0101, 0x0301, 0x1000


def bench_with(tmp_path: Path, node: Stoeber5000) -> Bench:
    path = tmp_path / "site.toml"
    path.write_text(SITE, encoding="utf-8")
    bench = Bench(load_site(path), family=load_family(MAPPING), mapping=MAPPING, node=node)
    bench.run(3.0)
    return bench


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return bench_with(tmp_path, Stoeber5000(1, positions=True))


def axis(bench: Bench) -> PositioningAxis:
    (one,) = bench.node.axes
    assert isinstance(one, PositioningAxis)
    return one


def write(bench: Bench, seconds: float, **values: float) -> None:
    """As a controller does: the same telegram again and again."""
    for _ in range(round(seconds / 0.05)):
        outcome = bench.write(DRIVE, **values)
        assert outcome.code is Code.OK, outcome
        bench.run(0.05)


def enable(bench: Bench) -> None:
    write(bench, 0.1, control_word=READY)
    write(bench, 0.2, control_word=ABSOLUTE, velocity=9000)
    assert bench.value(f"{DRIVE}/status/state") == DriveState.OPERATION_ENABLED


def actual(bench: Bench, name: str) -> object:
    return bench.value(f"{DRIVE}/actual/{name}")


def test_the_words_are_those_of_the_drive(bench: Bench):
    """§8.1.1: eight bytes; the boot-up compares each object."""
    assert str(bench.value("lift/node/boot_status")).startswith("ok")
    enable(bench)
    assert bench.sent(0x201)[-1].data.hex(" ") == "01 01 00 00 00 00 28 23"
    assert bench.sent(0x301)[-1].data.hex(" ") == "00 00 00 00"
    assert bench.sent(0x181)[-1].data.hex(" ") == "04 00 00 00 00 00 00 00"


def test_a_position_is_gone_to_once(bench: Bench):
    enable(bench)
    write(bench, 2.0, control_word=ABSOLUTE, position=3600, velocity=9000)
    assert (actual(bench, "position"), actual(bench, "velocity")) == (3600, 0)
    assert actual(bench, "target_reached") is True
    starts = [frame.data[1] >> 4 & 1 for frame in bench.sent(0x201)]
    edges = sum(1 for before, after in pairwise(starts) if after > before)
    assert edges == 1, "the start bit rises once, however often the position is written"
    write(bench, 2.0, control_word=ABSOLUTE, position=-500, velocity=9000)
    assert actual(bench, "position") == -500


def test_ramps_of_the_controller(bench: Bench):
    enable(bench)
    values = {"position": 50_000, "velocity": 9000, "acceleration": 1000, "deceleration": 2000}
    write(bench, 1.0, control_word=ABSOLUTE, **values)
    assert axis(bench).motor.velocity == pytest.approx(1000, rel=0.15)


def test_homing_by_the_control_word(bench: Bench):
    enable(bench)
    assert actual(bench, "homing_attained") is False
    write(bench, 0.1, control_word=HOMING, velocity=9000)
    write(bench, 2.0, control_word=HOMING | START, velocity=9000)
    assert actual(bench, "homing_attained") is True
    assert (actual(bench, "position"), axis(bench).place) == (0, HOME_AT)
    write(bench, 0.1, control_word=ABSOLUTE, velocity=9000)
    write(bench, 2.0, control_word=ABSOLUTE, position=700, velocity=9000)
    assert (actual(bench, "position"), axis(bench).place) == (700, HOME_AT + 700)


@pytest.mark.landing
def test_a_limit_switch_is_told(bench: Bench):
    enable(bench)
    write(bench, 15.0, control_word=ABSOLUTE, position=-150_000, velocity=18_000)
    assert actual(bench, "limit_switch_negative") is True
    assert actual(bench, "limit_switch_positive") is False
    assert actual(bench, "command_aborted") is True
    assert actual(bench, "target_reached") is False


@pytest.mark.landing(2)
@pytest.mark.parametrize("action", [Action.STOP, Action.DISABLE_VOLTAGE])
def test_a_stop_forgets_the_position(bench: Bench, action: Action):
    enable(bench)
    write(bench, 0.5, control_word=ABSOLUTE, position=50_000, velocity=9000)
    bench.ask(action, DRIVE)
    bench.run(0.1)
    write(bench, 3.0, control_word=READY)
    where = actual(bench, "position")
    write(bench, 2.0, control_word=ABSOLUTE, velocity=9000)
    assert axis(bench).state is AxisState.ENABLED
    assert actual(bench, "position") == where


def test_a_silent_controller_stops_it_and_it_does_not_go_on(bench: Bench):
    enable(bench)
    write(bench, 0.5, control_word=ABSOLUTE, position=50_000, velocity=9000)
    bench.run(3.0)
    assert axis(bench).state is not AxisState.ENABLED
    assert axis(bench).motor.velocity == 0
    where = actual(bench, "position")
    write(bench, 0.1, control_word=READY)
    bench.ask(Action.RESET_FAULT, DRIVE)
    write(bench, 0.1, control_word=READY)
    write(bench, 2.0, control_word=ABSOLUTE, velocity=9000)
    assert actual(bench, "position") == where


def test_a_drive_with_another_application_gets_no_position(tmp_path: Path):
    bench = bench_with(tmp_path, Stoeber5000(1))
    status = str(bench.value("lift/node/boot_status"))
    assert "26E6:00/16 is no word that the mapping file knows" in status
    assert "no RPDO of the node carries 30D2:00, a part of the control word" in status
    assert not bench.write(DRIVE, position=100).forwarded
    assert bench.plant.image.read(f"{DRIVE}/status/state").quality is Quality.CONFIG_ERROR
    assert bench.plant.image.read(f"{DRIVE}/actual/position").quality is Quality.CONFIG_ERROR
