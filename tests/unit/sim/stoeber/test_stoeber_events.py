"""Events of a STÖBER inverter (ID 441684.06 §9.3)."""

from __future__ import annotations

import pytest

from bridge.sim.stoeber.stoeber_events import CODES, GENERIC, NO_EVENT, brakes


def test_every_event_has_a_code_and_a_bit_of_the_register() -> None:
    assert NO_EVENT not in CODES
    for code, register in CODES.values():
        assert code & 0xF000
        assert register in (GENERIC, 2, 4, 8, 16)


@pytest.mark.parametrize(("event", "can_brake"), [(31, False), (46, False), (41, True), (52, True)])
def test_a_motor_is_braked_while_its_power_stage_is_sound(event: int, can_brake: bool) -> None:
    assert brakes(event) is can_brake
