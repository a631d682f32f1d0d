"""A meaning that is changed at the drive while it is in operation is found."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from bridge.command import Code
from bridge.image import Quality
from bridge.sim.nord.nord_parameters import NordParameters
from bridge.sim.nord.nord_scales import Scales
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
from tests.support.slow_sdo import SlowSdo

SCALES = Scales.of


def turns_without_p105(parameters: NordParameters, in_set: int) -> Scales:
    """Of a drive whose motor does not mind a P105 of 0."""
    return replace(SCALES(parameters, in_set), max_hz=50.0)


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


@pytest.mark.landing
def test_a_scale_that_is_none_makes_no_value_with_what_was_read_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Scales, "of", turns_without_p105)
    bench = made(tmp_path)
    assert point(bench, "actual/frequency").quality is Quality.GOOD
    inverter(bench).parameters.at_keypad(P105, 0)
    bench.run(10.0)
    assert point(bench, "actual/frequency").quality is Quality.CONFIG_ERROR
    assert point(bench, "actual/current").quality is not Quality.CONFIG_ERROR
    assert bench.write(DRIVE, frequency=20.0).code is Code.NOT_CONFIGURED
    assert any("P105 is 0 in the drive, which is no scale" in one.message for one in bench.events)
    inverter(bench).parameters.at_keypad(P105, 500)
    bench.run(10.0)
    assert point(bench, "actual/frequency").quality is Quality.GOOD


def test_a_scale_that_is_none_at_boot_up_is_not_replaced_by_the_site_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Scales, "of", turns_without_p105)
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


@pytest.mark.landing
def test_a_setpoint_keeps_its_word_when_its_scale_is_changed_and_says_so(tmp_path: Path) -> None:
    """P105 from 50 to 100 Hz: the drive runs twice as fast by the same word."""
    bench = made(tmp_path)
    enable(bench, frequency=25.0)
    inverter(bench).parameters.at_keypad(P105, 1000)
    bench.run(10.0)
    assert bench.sent(0x205)[-1].data[2:4].hex() == "0020"
    why = "written as 25 Hz, and the same word means 50 Hz since the drive was changed"
    reading = point(bench, "command/frequency")
    assert (reading.value, reading.quality, reading.reason) == (50.0, Quality.STALE, why)
    assert point(bench, "actual/frequency")[:2] == (50.0, Quality.GOOD)
    told = "P105 of parameter set 1 is 100, it was 50"
    assert f"{told}: command/frequency: {why}" in "".join(event.message for event in bench.events)
    assert bench.write(DRIVE, control_word=ENABLE).code is Code.OK
    assert point(bench, "command/frequency").quality is Quality.STALE, "nobody has written it anew"
    assert bench.write(DRIVE, control_word=ENABLE, frequency=25.0).code is Code.OK
    bench.run(0.1)
    assert bench.sent(0x205)[-1].data[2:4].hex() == "0010"
    assert point(bench, "command/frequency")[:2] == (25.0, Quality.GOOD)


@pytest.mark.landing
def test_a_setpoint_of_another_scale_is_not_sent_with_the_next_enable(tmp_path: Path) -> None:
    bench = made(tmp_path)
    enable(bench, frequency=25.0)
    assert bench.write(DRIVE, control_word=SHUT_DOWN).code is Code.OK
    inverter(bench).parameters.at_keypad(P105, 1000)
    bench.run(10.0)
    bench.write(DRIVE, control_word=SHUT_DOWN)
    bench.run(0.3)
    bench.write(DRIVE, control_word=ENABLE)
    bench.run(0.3)
    assert bench.sent(0x205)[-1].data.hex() == "7f04" + "00" * 6


@pytest.mark.landing
def test_a_current_that_the_site_file_scales_is_unknown_once_the_drive_is_changed(tmp_path: Path) -> None:
    """P112 is given in A, and the drive holds it in another form: §6.5.4 has no formula between them."""
    bench = made(tmp_path)
    assert point(bench, "actual/current").quality is Quality.GOOD
    inverter(bench).parameters.at_keypad(112, 20)
    bench.run(10.0)
    current = point(bench, "actual/current")
    assert (current.quality, current.reason) == (
        Quality.CONFIG_ERROR,
        "P112 was 100 in the drive and is 20: see what it scales, then restart the bridge",
    )
    inverter(bench).parameters.at_keypad(112, 100)
    bench.run(10.0)
    assert point(bench, "actual/current").quality is Quality.GOOD


def test_two_setpoints_that_the_drive_adds_are_none(tmp_path: Path) -> None:
    bench = made(tmp_path, prepare=lambda drive: means(drive, SETPOINT, 1, 1, 0))
    frequency = point(bench, "command/frequency")
    assert (frequency.quality, frequency.reason) == (
        Quality.DISABLED,
        "in more than one word: P546[1] is 1, P546[2] is 1",
    )
    assert bench.write(DRIVE, control_word=ENABLE, frequency=25.0).code is Code.NOT_CONFIGURED


def test_a_setting_that_is_written_through_the_bridge_counts_at_once(tmp_path: Path) -> None:
    bench = made(tmp_path)
    bench.plant.drives[DRIVE].on_parameter("P105", 100.0, bench.now)
    bench.plant.tell_events()
    assert "P105 of parameter set 1 is 100, it was 50" in bench.events[-1].message


@pytest.mark.landing
@pytest.mark.parametrize("answer_s", [0.2, 0.25, 0.4])
def test_a_change_is_found_within_10_s_where_answers_are_slow(tmp_path: Path, answer_s: float) -> None:
    """Codes and scales of the set in use are asked before everything that is polled."""
    bench = made(tmp_path)
    slow = bench.node = SlowSdo(bench.node, answer_s)
    bench.run(30.0)
    for number, raw in ((ACTUAL, 3), (P105, 1000)):
        slow.inner.drives[0].parameters.at_keypad(number, raw)
        bench.run(10.0)
        assert [event for event in bench.events if event.message.startswith(f"P{number}")], number


@pytest.mark.landing
def test_what_a_drive_is_not_asked_for_long_is_in_doubt(tmp_path: Path) -> None:
    """Its SDO server is silent, and its process data go on."""
    bench = made(tmp_path)
    bench.run(5.0)
    bench.deaf_to = frozenset({0x585})
    bench.run(12.0)
    frequency = point(bench, "actual/frequency")
    assert (frequency.value, frequency.quality) == (0.0, Quality.STALE)
    assert frequency.reason.startswith("the drive has not been asked for longer than 10 s: ")
    assert bench.write(DRIVE, control_word=SHUT_DOWN, frequency=25.0).code is Code.OK
    bench.deaf_to = frozenset()
    bench.run(5.0)
    assert point(bench, "actual/frequency").quality is Quality.GOOD
