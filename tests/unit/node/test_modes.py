"""CiA 402: what setpoints and bits mean in the present mode of operation, 6060h and 6061h."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bridge.command import Action, Code
from bridge.config import load_site
from bridge.image import Quality, Reading
from bridge.mapping import load_family
from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.cia402.cia402_settings import Cia402Mode, Cia402Settings
from bridge.text import render
from tests.support.bench import Bench
from tests.support.nightly import examples

DRIVE = "axis/drive"
SITE = """
[site]
name = "bench"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "axis"
id = 5
mapping = "{mapping}"
[[bus.node.drive]]
slot = "drive"
control = "modbus"
fieldbus_timeout_ms = 500
[modbus]
"""
OF_MODE = {
    "velocity": (Cia402Mode.VELOCITY, "velocity", ()),
    "profile-velocity": (Cia402Mode.PROFILE_VELOCITY, "velocity", ("standstill", "slippage")),
    "profile-position": (Cia402Mode.PROFILE_POSITION, "position", ("following_error",)),
    "homing": (Cia402Mode.HOMING, "", ("homing_attained", "homing_error")),
    "cyclic-position": (Cia402Mode.CYCLIC_POSITION, "position", ("follows_command", "following_error")),
    "cyclic-velocity": (Cia402Mode.CYCLIC_VELOCITY, "velocity", ("follows_command",)),
}
"""By mapping: its mode, the setpoint and the bits that mean something in that mode only."""
READ_S = 9.0
"""Codes are read every 8 s."""


def booted(folder: Path, mapping: str) -> Bench:
    path = folder / "site.toml"
    path.write_text(SITE.format(mapping=f"cia402/{mapping}"), encoding="utf-8")
    family = load_family(f"cia402/{mapping}")
    bench = Bench(
        load_site(path), family=family, mapping=f"cia402/{mapping}", node=Cia402Drive(5, Cia402Settings())
    )
    bench.run(2.0)
    return bench


def point(bench: Bench, leaf: str) -> Reading:
    return bench.plant.image.read(f"{DRIVE}/{leaf}")


def change(bench: Bench, mode: Cia402Mode) -> None:
    """By another hand: at the drive's panel."""
    bench.node.settings.mode = mode
    bench.node.axis.set_mode()


@pytest.mark.landing(6)
@pytest.mark.parametrize("mapping", OF_MODE)
def test_in_its_own_mode_everything_is_served(tmp_path: Path, mapping: str) -> None:
    bench = booted(tmp_path, mapping)
    _, setpoint, bits = OF_MODE[mapping]
    assert all(point(bench, f"actual/{bit}").quality is Quality.GOOD for bit in bits)
    if setpoint:
        assert point(bench, f"command/{setpoint}").quality is Quality.GOOD
        assert bench.write(DRIVE, control_word=6, **{setpoint: 1}).ok


def test_in_another_mode_a_setpoint_is_refused_and_its_bits_are_not_served(tmp_path: Path) -> None:
    bench = booted(tmp_path, "profile-position")
    change(bench, Cia402Mode.HOMING)
    bench.run(READ_S)
    position = point(bench, "command/position")
    assert (position.quality, position.reason) == (
        Quality.DISABLED,
        "has no effect in this mode of operation: 6060 is 6 (homing)",
    )
    error = point(bench, "actual/following_error")
    assert (error.quality, error.reason) == (
        Quality.DISABLED,
        "means something else in this mode of operation: 6061 is 6 (homing)",
    )
    assert render(error.why, "de").endswith(": 6061 ist 6 (Referenzfahrt)")
    refused = bench.write(DRIVE, control_word=15, position=100)
    assert (refused.code, "has no effect" in refused.message) == (Code.NOT_CONFIGURED, True)
    assert bench.write(DRIVE, control_word=6, position=100).ok, "it may be a stop"
    assert bench.ask(Action.DISABLE_VOLTAGE, DRIVE).ok
    changed = [event for event in bench.events if "has another meaning" in event.message]
    assert changed
    change(bench, Cia402Mode.PROFILE_POSITION)
    bench.run(READ_S)
    assert point(bench, "command/position").quality is Quality.GOOD


@pytest.mark.landing
@settings(max_examples=examples(25), suppress_health_check=list(HealthCheck))
@given(
    mapping=st.sampled_from(list(OF_MODE)),
    modes=st.lists(st.sampled_from(list(Cia402Mode)), min_size=1, max_size=4),
)
def test_whatever_the_mode_nothing_is_good_that_means_something_else(
    tmp_path_factory: pytest.TempPathFactory, mapping: str, modes: list[Cia402Mode]
) -> None:
    bench = booted(tmp_path_factory.mktemp("site"), mapping)
    own, setpoint, bits = OF_MODE[mapping]
    for mode in modes:
        change(bench, mode)
        bench.run(READ_S)
        is_own = mode is own
        for leaf in [f"actual/{bit}" for bit in bits] + ([f"command/{setpoint}"] if setpoint else []):
            assert (point(bench, leaf).quality is Quality.GOOD) is is_own, (leaf, mode)
        if setpoint:
            taken = bench.write(DRIVE, control_word=15, **{setpoint: 1})
            assert taken.ok is is_own, (mode, taken)
        assert bench.ask(Action.DISABLE_VOLTAGE, DRIVE).ok


@pytest.mark.landing(6)
@pytest.mark.parametrize("mapping", OF_MODE)
def test_a_mode_that_a_tpdo_tells_counts_at_once(tmp_path: Path, mapping: str) -> None:
    """6061h is in the TPDO, beside the bits whose meaning it says; 6060h is asked in the next second."""
    bench = booted(tmp_path, mapping)
    own, setpoint, bits = OF_MODE[mapping]
    reached = ("target_reached",) if f"{DRIVE}/actual/target_reached" in bench.plant.image.index else ()
    assert all(point(bench, f"actual/{bit}").quality is Quality.GOOD for bit in (*bits, *reached))
    change(bench, Cia402Mode.HOMING if own is not Cia402Mode.HOMING else Cia402Mode.VELOCITY)
    bench.run(0.15)
    for bit in (*bits, *reached):
        assert point(bench, f"actual/{bit}").quality is Quality.DISABLED, bit
    bench.run(1.0)
    if setpoint:
        assert point(bench, f"command/{setpoint}").quality is Quality.DISABLED


def test_a_speed_in_another_dimension_is_a_speed_in_1_per_min_all_the_same(tmp_path: Path) -> None:
    """604Ch: numerator and denominator."""
    bench = booted(tmp_path, "velocity")
    bench.write(DRIVE, control_word=6)
    bench.run(0.2)
    bench.write(DRIVE, control_word=7)
    bench.run(0.2)
    assert bench.write(DRIVE, control_word=0x7F, velocity=300.0).ok
    bench.node.settings.vl_dimension[:] = [1, 10]
    for _ in range(100):
        bench.write(DRIVE, control_word=0x7F)
        bench.run(0.1)
    command = point(bench, "command/velocity")
    assert (command.value, command.quality) == (30.0, Quality.STALE)
    assert point(bench, "actual/velocity")[:2] == (30.0, Quality.GOOD)
