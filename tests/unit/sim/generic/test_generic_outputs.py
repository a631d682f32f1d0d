"""Outputs of a simulated node whose communication fails (CiA 401)."""

from __future__ import annotations

from bridge.sim.generic.generic_outputs import behaviour_in_error, outputs_in_error


def test_bits_of_the_error_mode_let_the_error_value_through() -> None:
    numbers = {
        (0x6200, 0): 1,
        (0x6200, 1): 0b1111_0000,
        (0x6206, 1): 0b1010_1010,
        (0x6207, 1): 0b0000_1010,
        (0x6200, 2): 0xFF,
    }
    assert dict(outputs_in_error(numbers)) == {(0x6200, 1): 0b0101_1010}


def test_an_analogue_output_takes_its_error_value_where_its_mode_is_1() -> None:
    numbers = {
        (0x6411, 1): 500,
        (0x6443, 1): 1,
        (0x6444, 1): 7,
        (0x6411, 2): 500,
        (0x6443, 2): 0,
        (0x6444, 2): 7,
    }
    assert dict(outputs_in_error(numbers)) == {(0x6411, 1): 7}


def test_without_1029h_it_becomes_pre_operational() -> None:
    assert behaviour_in_error({}) == 0
    assert behaviour_in_error({(0x1029, 1): 2}) == 2
