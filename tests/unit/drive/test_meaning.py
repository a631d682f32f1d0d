"""Meanings of words, read from the drive in every parameter set: BU 2500 §6.5.4, P543 and P546."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bridge.command import Action, Code, Outcome, Request, command_of
from bridge.command.messages.telegram import Refusal
from bridge.drive.meaning import Meanings
from bridge.image import Quality
from bridge.mapping import load_family
from bridge.sim.core.dictionary import Entry
from bridge.sim.core.sdo_abort import AbortCode, SdoAbort
from bridge.sim.nord.nord_drive import NordDrive
from bridge.sim.nord.nord_interface import DriveAccess
from bridge.sim.nord.nord_parameters import PARAMETER_BASE, sub_index
from tests.support.bench import PLC
from tests.support.nightly import examples
from tests.support.nord_words import (
    ACTUAL,
    DRIVE,
    ENABLE,
    P105,
    SET_2,
    SETPOINT,
    SHUT_DOWN,
    enable,
    inverter,
    made,
    means,
    point,
)


def test_a_word_that_is_a_current_is_no_frequency(tmp_path: Path) -> None:
    bench = made(tmp_path, prepare=lambda drive: means(drive, ACTUAL, 3, 0, 0))
    enable(bench, setpoint_1=0x2000)
    frequency = point(bench, "actual/frequency")
    assert frequency.quality is Quality.DISABLED
    assert frequency.reason == (
        "not in the telegram in parameter set 1: P543[1] is 3, P543[2] is 0, P543[3] is 0"
    )
    current = point(bench, "actual/current")
    assert current.quality is Quality.GOOD
    assert current.value == pytest.approx(inverter(bench).current_a, abs=0.01)


def test_a_value_is_served_from_whichever_word_has_it(tmp_path: Path) -> None:
    bench = made(tmp_path, prepare=lambda drive: means(drive, ACTUAL, 10, 15, 1))
    enable(bench, frequency=25.0)
    assert point(bench, "actual/frequency")[:2] == (25.0, Quality.GOOD)
    position = point(bench, "actual/position")
    assert position.quality is Quality.GOOD
    assert position.value == pytest.approx(inverter(bench).position_increments / 1000, abs=2.0)


def test_a_word_of_unknown_meaning_gives_no_value_and_takes_none(tmp_path: Path) -> None:
    def prepare(drive: NordDrive) -> None:
        means(drive, ACTUAL, 57, 56, 55)
        means(drive, SETPOINT, 57, 56, 55)

    bench = made(tmp_path, prepare=prepare)
    assert "P543[1] is 57 in set 1, which the mapping does not know" in str(
        bench.value("lift/node/boot_status")
    )
    for leaf in ("actual/frequency", "actual/current", "actual/position", "command/frequency"):
        assert point(bench, leaf).quality is Quality.DISABLED
    assert bench.write(DRIVE, frequency=10.0).code is Code.NOT_CONFIGURED


def test_scales_are_those_of_the_active_set(tmp_path: Path) -> None:
    def prepare(drive: NordDrive) -> None:
        drive.parameters.at_keypad(P105, 1000, parameter_set=2)

    bench = made(tmp_path, prepare=prepare)
    enable(bench, SET_2, frequency=25.0)
    assert point(bench, "actual/frequency")[:2] == (25.0, Quality.GOOD)
    assert inverter(bench).output_hz == 25.0
    assert point(bench, "command/setpoint_1").value == 0x1000


def test_set_2_of_the_position_view_is_no_position(tmp_path: Path) -> None:
    def prepare(drive: NordDrive) -> None:
        for number, code in ((543, 10), (544, 15), (545, 1), (546, 23), (547, 24), (548, 1)):
            drive.parameters.at_keypad(number, code)
        for number, code in ((543, 3), (544, 0), (545, 1), (546, 2), (547, 0), (548, 1)):
            drive.parameters.at_keypad(number, code, parameter_set=2)

    bench = made(tmp_path, "nord/sk-tu3-cao-pdo3", prepare)
    assert point(bench, "actual/position").quality is Quality.GOOD
    enable(bench, SET_2, frequency=25.0)
    assert point(bench, "actual/position").quality is Quality.DISABLED
    assert point(bench, "actual/current").quality is Quality.GOOD
    refused = bench.write(DRIVE, position=100.0)
    assert refused.code is Code.NOT_CONFIGURED
    assert "P546 is 2" in refused.message


def test_a_switch_of_sets_changes_no_speed(tmp_path: Path) -> None:
    def prepare(drive: NordDrive) -> None:
        drive.parameters.at_keypad(P105, 1000, parameter_set=2)

    bench = made(tmp_path, prepare=prepare)
    enable(bench, frequency=25.0)
    assert bench.write(DRIVE, control_word=ENABLE | SET_2).code is Code.OK
    bench.run(0.5)
    assert inverter(bench).output_hz == pytest.approx(25.0, abs=0.01)
    assert point(bench, "actual/frequency").value == pytest.approx(25.0, abs=0.01)
    assert bench.write(DRIVE, control_word=ENABLE).code is Code.OK
    bench.run(0.5)
    assert inverter(bench).output_hz == pytest.approx(25.0, abs=0.01)


def test_a_running_drive_is_not_switched_to_a_set_that_means_something_else(tmp_path: Path) -> None:
    bench = made(tmp_path, prepare=lambda drive: means(drive, SETPOINT, 2, 0, 0, in_set=2))
    enable(bench, frequency=25.0)
    refused = bench.write(DRIVE, control_word=ENABLE | SET_2)
    assert refused.code is Code.NOT_CONFIGURED
    assert bench.write(DRIVE, control_word=SHUT_DOWN | SET_2).code is Code.OK, "a stop is never refused"
    bench.run(0.1)
    assert bench.sent(0x205)[-1].data.hex() == "7e44" + "00" * 6


def test_a_drive_in_another_set_than_commanded_gets_no_scaled_value(tmp_path: Path) -> None:
    """A drive whose parameter set is chosen at its inputs."""
    bench = made(tmp_path, prepare=lambda drive: drive.parameters.at_keypad(P105, 1000, parameter_set=2))
    enable(bench, SET_2, frequency=25.0)
    decode = bench.plant.drives[DRIVE].channel.leg_settings.decode
    with pytest.raises(Refusal, match="parameter set 1 is commanded, and the drive is in set 2"):
        decode({"frequency": 10.0}, (0,) * 4, ENABLE, True)
    assert decode({"frequency": 10.0}, (0,) * 4, SHUT_DOWN, True).setpoints == (0,) * 4, (
        "a stop is never refused"
    )
    assert decode({"setpoint_1": 5}, (0,) * 4, ENABLE, True).setpoints == (5, 0, 0, 0)


@pytest.mark.landing(4)
@pytest.mark.parametrize("in_set", [1, 2, 3, 4])
def test_start_and_stop_stay_in_their_set(tmp_path: Path, in_set: int) -> None:
    bench = made(tmp_path)
    bits = in_set - 1 << 14
    bench.write(DRIVE, control_word=SHUT_DOWN | bits)
    bench.run(0.3)
    for action, parameters, state in ((Action.START, {"direction": 1}, 4), (Action.STOP, {}, 2)):
        outcomes: list[Outcome] = []
        request = Request(PLC, DRIVE, command_of(action, **parameters))
        bench.view.submit(request, outcomes.append)
        bench.run(3.0)
        assert [outcome.code for outcome in outcomes] == [Code.OK]
        assert all(frame.data[1] & 0xC0 == bits >> 8 for frame in bench.sent(0x205)[-20:])
        assert point(bench, "status/state").value == state


CODES = st.lists(st.sampled_from([0, 1, 2, 3, 4, 5, 10, 15, 23, 24, 57]), min_size=12, max_size=12)
"""Codes of three words in four sets."""
UNREADABLE = st.sets(st.tuples(st.sampled_from([ACTUAL, SETPOINT]), st.integers(1, 3), st.integers(1, 4)))


@pytest.mark.landing
@settings(max_examples=examples(40), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(actual=CODES, setpoints=CODES, unreadable=UNREADABLE, active=st.integers(1, 4))
def test_no_point_is_good_unless_its_meaning_was_read(
    tmp_path: Path,
    actual: list[int],
    setpoints: list[int],
    unreadable: set[tuple[int, int, int]],
    active: int,
) -> None:
    def prepare(drive: NordDrive) -> None:
        drive.parameters.commission(600, 2)
        for in_set in range(1, 5):
            means(drive, ACTUAL, *actual[in_set - 1 :: 4], in_set=in_set)
            means(drive, SETPOINT, *setpoints[in_set - 1 :: 4], in_set=in_set)

    hidden = {(PARAMETER_BASE + number, sub_index(element, one)) for number, element, one in unreadable}
    find = DriveAccess.find

    def refusing(self: DriveAccess, index: int, sub: int) -> Entry:
        if (index, sub) in hidden:
            raise SdoAbort(AbortCode.HARDWARE_FAULT)
        return find(self, index, sub)

    with patch.object(DriveAccess, "find", refusing):
        bench = made(tmp_path, prepare=prepare)
        bench.write(DRIVE, control_word=SHUT_DOWN | active - 1 << 14)
        bench.run(0.3)
    for value in bench.plant.drives[DRIVE].family.value:
        if not value.code:
            continue
        number, all_codes = (ACTUAL, actual) if value.group == "actual" else (SETPOINT, setpoints)
        of_set = enumerate(all_codes[active - 1 :: 4], 1)
        codes = [None if (number, word, active) in unreadable else code for word, code in of_set]
        is_there = set(value.code) <= set(codes)
        # The drive adds setpoints of one code.
        is_there &= value.group == "actual" or all(codes.count(code) == 1 for code in value.code)
        # P112 is given for two sets.
        is_scaled = value.full != "P112" or active in (1, 2)
        reading = point(bench, value.leaf)
        assert (reading.quality is Quality.GOOD) == (is_there and is_scaled), (value.leaf, reading)
        if not is_there:
            # What is in two words is in none alone, whatever the third one has.
            is_twice = value.group == "command" and any(codes.count(code) > 1 for code in value.code)
            is_unread = None in codes and not is_twice
            assert reading.quality is (Quality.CONFIG_ERROR if is_unread else Quality.DISABLED), reading
        values: dict[str, Any] = {"control_word": ENABLE | active - 1 << 14, value.name: 1.0}
        refused = bench.write(DRIVE, **values)
        if value.group == "command" and not (is_there and is_scaled):
            assert refused.code is Code.NOT_CONFIGURED, (value.leaf, refused)


@pytest.mark.landing
@settings(max_examples=examples(20), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    full_hz=st.lists(st.integers(300, 2000).map(lambda tenths: tenths / 10), min_size=4, max_size=4),
    codes=st.lists(st.permutations([1, 2, 0]), min_size=4, max_size=4),
    sets=st.lists(st.integers(1, 4), min_size=2, max_size=4),
    frequency=st.floats(-25.0, 25.0),
)
def test_a_frequency_is_the_same_in_every_set_and_through_every_switch(
    tmp_path: Path, full_hz: list[float], codes: list[list[int]], sets: list[int], frequency: float
) -> None:
    """Or the switch is refused, and nothing changes."""

    def prepare(drive: NordDrive) -> None:
        for in_set in range(1, 5):
            drive.parameters.at_keypad(P105, round(full_hz[in_set - 1] * 10), parameter_set=in_set)
            means(drive, SETPOINT, *codes[in_set - 1], in_set=in_set)

    bench = made(tmp_path, prepare=prepare)
    enable(bench, sets[0] - 1 << 14, frequency=frequency)
    step = max(full_hz) / 0x4000
    for in_set in sets:
        switched = bench.write(DRIVE, control_word=ENABLE | in_set - 1 << 14)
        bench.run(0.5)
        assert switched.code in (Code.OK, Code.NOT_CONFIGURED)
        assert inverter(bench).output_hz == pytest.approx(frequency, abs=len(sets) * step)
        shown = point(bench, "actual/frequency")
        assert shown.quality is Quality.GOOD
        assert shown.value == pytest.approx(frequency, abs=len(sets) * step)


@pytest.mark.parametrize(("given", "full"), [({}, None), ({"P105": 50.0}, 50.0)])
def test_a_scale_that_the_drive_tells_no_more_is_that_of_the_site_file_or_none(
    given: dict[str, float], full: float | None
) -> None:
    family = load_family("nord/sk-tu4-cao")
    meanings = Meanings(family, family.slot[0], given)
    meanings.on_parameter("P105", 100.0)
    assert meanings.scales["actual/frequency"].full == 100.0
    meanings.on_parameter("P105", None)
    scale = meanings.scales.get("actual/frequency")
    assert (scale and scale.full) == full
