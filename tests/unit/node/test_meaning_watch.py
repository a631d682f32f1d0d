"""A meaning that is changed at the drive while it is in operation is found."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.command import Code
from bridge.image import Quality
from bridge.sim.nord_drive import NordDrive
from tests.support import nord_words
from tests.support.nord_words import (
    ACTUAL,
    DRIVE,
    ENABLE,
    P105,
    SETPOINT,
    SHUT_DOWN,
    enable,
    inverter,
    made,
    means,
    point,
)


def test_a_change_at_the_keypad_is_found_within_10_s(tmp_path: Path) -> None:
    bench = made(tmp_path)
    assert point(bench, "actual/frequency").quality is Quality.GOOD
    means(inverter(bench), ACTUAL, 3, 1, 0)
    bench.run(10.0)
    enable(bench, frequency=25.0)
    assert point(bench, "actual/frequency")[:2] == (25.0, Quality.GOOD)
    assert point(bench, "actual/current").quality is Quality.GOOD


def test_a_change_is_found_when_the_drive_is_enabled(tmp_path: Path) -> None:
    bench = made(tmp_path)
    bench.run(6.0)
    assert bench.write(DRIVE, control_word=SHUT_DOWN).code is Code.OK
    bench.run(0.3)
    means(inverter(bench), ACTUAL, 3, 0, 0)
    assert bench.write(DRIVE, control_word=ENABLE, frequency=25.0).code is Code.OK
    bench.run(1.0)
    assert point(bench, "actual/frequency").quality is Quality.DISABLED


def test_a_scale_that_is_changed_in_any_set_is_found(tmp_path: Path) -> None:
    bench = made(tmp_path)
    inverter(bench).parameters.at_keypad(P105, 1000, parameter_set=2)
    bench.run(10.0)
    enable(bench, 0x4000, frequency=25.0)
    assert inverter(bench).output_hz == 25.0
    assert point(bench, "actual/frequency")[:2] == (25.0, Quality.GOOD)


def test_a_scale_that_is_none_makes_no_value_with_what_was_read_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(NordDrive, "_max_hz", 50.0)
    bench = made(tmp_path)
    assert point(bench, "actual/frequency").quality is Quality.GOOD
    inverter(bench).parameters.at_keypad(P105, 0)
    bench.run(10.0)
    assert point(bench, "actual/frequency").quality is Quality.CONFIG_ERROR
    assert point(bench, "actual/current").quality is not Quality.CONFIG_ERROR
    assert bench.write(DRIVE, frequency=20.0).code is Code.NOT_CONFIGURED
    assert "P105 is 0 in the drive, which is no scale" in [one.message for one in bench.events]
    inverter(bench).parameters.at_keypad(P105, 500)
    bench.run(10.0)
    assert point(bench, "actual/frequency").quality is Quality.GOOD


def test_a_scale_that_is_none_at_boot_up_is_not_replaced_by_the_site_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(NordDrive, "_max_hz", 50.0)
    monkeypatch.setattr(nord_words, "SITE", nord_words.SITE.replace("{{ P112", "{{ P105 = 50.0, P112"))
    bench = made(tmp_path, prepare=lambda drive: drive.parameters.at_keypad(P105, 0))
    status = str(bench.plant.image.read("lift/node/boot_status").value)
    assert "fu1: P105 is 0 in the drive, which is no scale" in status
    assert point(bench, "actual/frequency").quality is Quality.CONFIG_ERROR


def test_a_setpoint_of_another_meaning_is_not_sent_with_the_next_enable(tmp_path: Path) -> None:
    bench = made(tmp_path)
    enable(bench, frequency=25.0)
    assert bench.write(DRIVE, control_word=SHUT_DOWN).code is Code.OK
    bench.run(1.0)
    means(inverter(bench), SETPOINT, 2, 1, 0)
    bench.run(10.0)
    bench.write(DRIVE, control_word=SHUT_DOWN)
    bench.run(0.3)
    bench.write(DRIVE, control_word=ENABLE)
    bench.run(0.3)
    assert bench.sent(0x205)[-1].data.hex() == "7f04" + "00" * 6
    assert bench.write(DRIVE, frequency=25.0).code is Code.OK
    bench.run(0.1)
    assert bench.sent(0x205)[-1].data.hex() == "7f04" + "0000" + "0020" + "0000"


def test_a_stop_is_taken_with_a_setpoint_that_has_lost_its_word(tmp_path: Path) -> None:
    """A controller that sends both in one telegram stops its drive all the same."""
    bench = made(tmp_path)
    enable(bench, frequency=25.0)
    means(inverter(bench), SETPOINT, 57, 0, 0)
    bench.run(10.0)
    assert bench.write(DRIVE, control_word=ENABLE, frequency=20.0).code is Code.NOT_CONFIGURED
    assert bench.write(DRIVE, control_word=SHUT_DOWN, frequency=0.0).code is Code.OK
    bench.run(0.1)
    assert bench.sent(0x205)[-1].data.hex()[:4] == "7e04"
