"""The bridge with a NORD SK TU4-CAO whose drives position: BU 2500 §5.4, on a virtual clock."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from bridge.command import Action, Code
from bridge.config import load_site
from bridge.drive import DriveState
from bridge.image import Quality
from bridge.mapping import load_family
from bridge.sim.catalogue import simulate_node
from bridge.sim.nord.nord_drive import NordDrive
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_tu4 import NordTu4
from tests.support.bench import Bench

MAPPING = "nord/sk-tu4-cao-posicon"
DRIVE = "hoist/drive"
SITE = f"""
[site]
name = "bench"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "hoist"
id = 5
mapping = "{MAPPING}"
[[bus.node.drive]]
slot = "fu1"
name = "drive"
control = "modbus"
fieldbus_timeout_ms = 200
[modbus]
"""
SHUT_DOWN, ENABLE, SET_2 = 0x047E, 0x047F, 0x4000
SETPOINT, ACTUAL = 546, 543


def made(folder: Path, prepare: Callable[[NordDrive], None] = lambda drive: None) -> Bench:
    path = folder / "site.toml"
    path.write_text(SITE, encoding="utf-8")
    node = simulate_node(MAPPING, 5, {})
    assert isinstance(node, NordTu4)
    prepare(node.drives[0])
    node.drives[0].position_increments = 7_250.0
    bench = Bench(load_site(path), family=load_family(MAPPING), mapping=MAPPING, node=node)
    bench.run(3.0)
    return bench


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return made(tmp_path)


def write(bench: Bench, seconds: float, **values: float) -> None:
    """As a controller does: the same telegram again and again."""
    for _ in range(round(seconds / 0.05)):
        outcome = bench.write(DRIVE, **values)
        assert outcome.code is Code.OK, outcome
        bench.run(0.05)


def enable(bench: Bench) -> None:
    write(bench, 0.3, control_word=SHUT_DOWN)
    write(bench, 0.3, control_word=ENABLE, frequency=50.0)
    assert bench.value(f"{DRIVE}/status/state") == DriveState.OPERATION_ENABLED


def actual(bench: Bench, name: str) -> object:
    return bench.value(f"{DRIVE}/actual/{name}")


def position(bench: Bench) -> float:
    value = actual(bench, "position")
    assert isinstance(value, float)
    return value


def sent(bench: Bench) -> tuple[int, int, int]:
    """Speed word, and the position in increments, as they are on the wire."""
    data = bench.sent(0x205)[-1].data
    return (
        int.from_bytes(data[:2], "little"),
        int.from_bytes(data[2:4], "little"),
        int.from_bytes(data[4:8], "little", signed=True),
    )


def test_enabling_moves_nothing(bench: Bench) -> None:
    write(bench, 0.3, control_word=SHUT_DOWN, position=900.0)
    write(bench, 2.0, control_word=ENABLE, frequency=50.0)
    assert sent(bench) == (ENABLE, 0x4000, 7_250)
    assert position(bench) == 7.25
    assert actual(bench, "target_reached") is True


@pytest.mark.landing
def test_it_goes_to_the_position_that_is_written(bench: Bench) -> None:
    enable(bench)
    write(bench, 0.5, control_word=ENABLE, frequency=50.0, position=30.0)
    assert sent(bench) == (ENABLE, 0x4000, 30_000)
    assert actual(bench, "target_reached") is False
    write(bench, 5.0, control_word=ENABLE, frequency=50.0, position=30.0)
    assert (position(bench), actual(bench, "frequency")) == (30.0, 0.0)
    assert actual(bench, "target_reached") is True
    write(bench, 5.0, control_word=ENABLE, frequency=25.0, position=-4.321)
    assert position(bench) == pytest.approx(-4.321)


@pytest.mark.landing
@pytest.mark.parametrize("action", [Action.STOP, Action.QUICK_STOP, Action.DISABLE_VOLTAGE])
def test_after_a_stop_it_stays_until_a_position_is_written(bench: Bench, action: Action) -> None:
    enable(bench)
    write(bench, 1.0, control_word=ENABLE, frequency=50.0, position=400.0)
    bench.ask(action, DRIVE)
    bench.run(0.1)
    write(bench, 4.0, control_word=SHUT_DOWN)
    where = position(bench)
    assert 7.25 < where < 300.0
    write(bench, 2.0, control_word=ENABLE, frequency=50.0)
    assert position(bench) == where
    write(bench, 6.0, control_word=ENABLE, frequency=50.0, position=10.0)
    assert position(bench) == 10.0


def test_a_silent_controller_stops_it(bench: Bench) -> None:
    enable(bench)
    write(bench, 1.0, control_word=ENABLE, frequency=50.0, position=400.0)
    bench.run(3.0)
    assert bench.value(f"{DRIVE}/status/state") == DriveState.FAULT
    assert bench.node.drives[0].output_hz == 0


@pytest.mark.landing(2)
@pytest.mark.parametrize("number", [SETPOINT, ACTUAL])
def test_words_that_are_no_position_follow_nothing(tmp_path: Path, number: int) -> None:
    """P546[2] or P543[2] = 4: what the drive would then be told is no position."""
    bench = made(tmp_path, lambda drive: drive.parameters.commission(number, 4, 2))
    write(bench, 0.3, control_word=SHUT_DOWN)
    write(bench, 1.0, control_word=ENABLE, setpoint_1=0)
    assert sent(bench) == (ENABLE, 0, 0)
    if number == SETPOINT:
        assert bench.write(DRIVE, control_word=ENABLE, position=1.0).code is Code.NOT_CONFIGURED
    else:
        assert bench.plant.image.read(f"{DRIVE}/actual/position").quality is Quality.DISABLED


def test_in_a_set_without_positions_nothing_is_followed(tmp_path: Path) -> None:
    def prepare(drive: NordDrive) -> None:
        drive.parameters.at_keypad(SETPOINT, 2, element=2, parameter_set=2)

    bench = made(tmp_path)
    prepare(bench.node.drives[0])
    bench.run(12.0)
    write(bench, 0.3, control_word=SHUT_DOWN | SET_2)
    write(bench, 1.0, control_word=ENABLE | SET_2)
    assert sent(bench) == (ENABLE | SET_2, 0, 0)


@pytest.mark.landing
def test_a_drive_without_step_5_has_no_position(tmp_path: Path) -> None:
    """Factory settings: P543 and P546 have no positions."""

    def factory(drive: NordDrive) -> None:
        for number in (SETPOINT, ACTUAL):
            drive.parameters.commission(number, 0)

    bench = made(tmp_path, factory)
    reading = bench.plant.image.read(f"{DRIVE}/actual/position")
    assert reading.quality is Quality.DISABLED
    assert "P543[2] is 0" in reading.reason


@pytest.mark.landing
def test_a_position_of_32_bits_in_one_pdo_follows_too(tmp_path: Path) -> None:
    """§6.5.7, the third view of a SK TU3-CAO; here the drive takes its speed from P105 (P600 = 1)."""
    mapping = "nord/sk-tu3-cao-pdo3"
    path = tmp_path / "site.toml"
    path.write_text(SITE.replace(MAPPING, mapping).replace('"fu1"', '"drive"'), encoding="utf-8")
    node = simulate_node(mapping, 5, {"P600": 1})
    assert isinstance(node, NordSingle)
    node.drive.position_increments = 7_250.0
    bench = Bench(load_site(path), family=load_family(mapping), mapping=mapping, node=node)
    bench.run(3.0)
    write(bench, 0.3, control_word=SHUT_DOWN)
    write(bench, 2.0, control_word=ENABLE)
    assert bench.value(f"{DRIVE}/status/state") == DriveState.OPERATION_ENABLED
    assert position(bench) == 7.25
    assert actual(bench, "target_reached") is True
    write(bench, 5.0, control_word=ENABLE, position=-2.5)
    assert position(bench) == -2.5


def keypad(bench: Bench, number: int, raw: int, element: int = 1) -> None:
    """In every parameter set."""
    for parameter_set in range(1, 5):
        bench.node.drives[0].parameters.at_keypad(number, raw, element=element, parameter_set=parameter_set)


FOUND_S = 10.0
"""Within this a change at the keypad is found."""


@pytest.mark.landing
def test_with_position_control_off_no_target_is_reached_and_none_is_taken(tmp_path: Path) -> None:
    """§6.5.2: without POSICON bit 8 says that the actual value is the setpoint, and so says a drive that runs
    at its set frequency without end."""
    bench = made(tmp_path, lambda drive: drive.parameters.commission(600, 0))
    write(bench, 0.3, control_word=SHUT_DOWN)
    for values in ({"position": 30.0}, {"frequency": 25.0}, {"frequency": 25.0, "position": 30.0}):
        refused = bench.write(DRIVE, control_word=ENABLE, **values)
        assert refused.code is Code.NOT_CONFIGURED
        assert "the drive does not go to this position in parameter set 1: P600 is 0 (off)" in refused.message
    bench.run(24.0)
    reached = bench.plant.image.read(f"{DRIVE}/actual/target_reached")
    assert (reached.quality, reached.reason) == (
        Quality.DISABLED,
        "the drive does not go to this position in parameter set 1: P600 is 0 (off)",
    )
    assert bench.node.drives[0].position_increments == 7_250.0


@pytest.mark.landing
@pytest.mark.parametrize(("number", "raw", "element"), [(600, 0, 1), (SETPOINT, 4, 2), (SETPOINT, 23, 1)])
def test_what_is_changed_on_the_way_leaves_no_target_reached(
    bench: Bench, number: int, raw: int, element: int
) -> None:
    """P600 off, P546[2] no position, P546[1] one, too."""
    enable(bench)
    write(bench, 0.5, control_word=ENABLE, frequency=25.0, position=400.0)
    keypad(bench, number, raw, element)
    for _ in range(round(FOUND_S / 0.05)):
        bench.write(DRIVE, control_word=ENABLE)
        bench.run(0.05)
    assert bench.plant.image.read(f"{DRIVE}/actual/target_reached").quality is Quality.DISABLED
    assert bench.write(DRIVE, control_word=ENABLE, position=1.0).code is Code.NOT_CONFIGURED
    assert bench.write(DRIVE, control_word=SHUT_DOWN, position=1.0).code is Code.OK, "it may be a stop"
    assert [event.message for event in bench.events if "has another meaning" in event.message]


@pytest.mark.landing
def test_a_gear_or_another_encoder_leaves_no_position(bench: Bench) -> None:
    """§6.5.4: P607 and P608 stretch what is transferred."""
    bench.node.drives[0].parameters.at_keypad(607, 5, element=3)
    bench.run(FOUND_S)
    position = bench.plant.image.read(f"{DRIVE}/actual/position")
    assert (position.quality, position.reason) == (
        Quality.DISABLED,
        "not in revolutions of the motor: P607[3] is 5",
    )
    bench.node.drives[0].parameters.at_keypad(607, 1, element=3)
    bench.node.drives[0].parameters.at_keypad(604, 1)
    bench.run(FOUND_S)
    position = bench.plant.image.read(f"{DRIVE}/actual/position")
    assert (position.quality, position.reason) == (
        Quality.CONFIG_ERROR,
        "P604 was 0 in the drive and is 1: see what it scales, then restart the bridge",
    )
