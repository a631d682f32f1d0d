"""A drive in another parameter set scales with that set's P105 and P112: here they have not been read."""

from __future__ import annotations

import pytest

from bridge.command import Code
from bridge.image import Quality
from tests.support.rig import ENABLE, ENABLED, HALF_SPEED, SHUT_DOWN
from tests.unit.command.test_plant import Hall

SET_2 = 0x4000
SET_4 = 0xC000


@pytest.fixture
def hall() -> Hall:
    hall = Hall()
    hall.run()
    return hall


def test_actual_values_are_not_known_in_another_set(hall: Hall) -> None:
    assert hall.read("actual/frequency").quality is Quality.GOOD
    hall.pdo(ENABLED | SET_4, HALF_SPEED)
    reading = hall.read("actual/frequency")
    assert reading.quality is Quality.CONFIG_ERROR
    assert reading.reason == "parameter set 4 is active, and P105 is not known of it"
    assert hall.read("actual/value_1").quality is Quality.GOOD
    assert hall.read("actual/value_1").value == HALF_SPEED
    hall.pdo(ENABLED, HALF_SPEED)
    reading = hall.read("actual/frequency")
    assert (reading.quality, reading.value) == (Quality.GOOD, 25.0)


def test_a_scaled_setpoint_is_refused_and_a_raw_one_is_not(hall: Hall) -> None:
    assert hall.write(control_word=ENABLE | SET_2, setpoint_1=HALF_SPEED).ok
    assert hall.drive.channel.output.words[:2] == (ENABLE | SET_2, HALF_SPEED)
    outcome = hall.write(frequency=20.0)
    assert outcome.code is Code.NOT_CONFIGURED
    assert outcome.message == "frequency: parameter set 2 is active, and P105 is not known of it"
    assert hall.read("command/frequency").quality is Quality.CONFIG_ERROR
    assert hall.read("command/setpoint_1").quality is Quality.GOOD


def test_the_control_word_of_the_same_telegram_counts(hall: Hall) -> None:
    assert hall.write(control_word=ENABLE | SET_2, frequency=20.0).code is Code.NOT_CONFIGURED
    assert hall.drive.channel.control_word == ENABLE
    hall.write(control_word=SHUT_DOWN | SET_2)
    assert hall.write(control_word=ENABLE, frequency=25.0).ok
    assert hall.drive.channel.setpoints[0] == HALF_SPEED
    assert hall.read("command/frequency").quality is Quality.GOOD
