"""Parameters of the simulated CiA 402 drive and its PDOs as delivered."""

from __future__ import annotations

import pytest

from bridge.sim.cia402.cia402_settings import (
    SUPPORTED_MODES,
    Cia402Mode,
    Cia402Settings,
    factory_communication,
)


def test_each_mode_has_its_bit_in_6502h() -> None:
    assert {mode for mode in Cia402Mode if mode and SUPPORTED_MODES >> mode - 1 & 1} == set(Cia402Mode) - {
        Cia402Mode.NONE
    }


@pytest.mark.parametrize(
    ("dimension", "factor"), [([1, 1], 1.0), ([3, 2], 1.5), ([0, 2], 1.0), ([2, 0], 1.0)]
)
def test_a_dimension_that_is_none_counts_as_1(dimension: list[int], factor: float) -> None:
    assert Cia402Settings(vl_dimension=dimension).vl_factor == factor


def test_the_motors_speed_is_in_increments() -> None:
    assert Cia402Settings(max_motor_rpm=60).max_speed == 10_000


def test_as_delivered_pdo_1_alone_is_on() -> None:
    made = factory_communication(5)
    assert [pdo.enabled for pdo in made.rpdo] == [pdo.enabled for pdo in made.tpdo] == [True] + [False] * 3
    assert [pdo.cob_id for pdo in made.rpdo] == [0x205, 0x305, 0x405, 0x505]
    assert made.tpdo[2].mapping == [0x6041_0010, 0x6064_0020]
