"""Codes of drive faults (BU 2500 §8.3.3)."""

from __future__ import annotations

import pytest

from bridge.sim.nord.nord_faults import UNKNOWN_CODE, emcy_code, register_bits


@pytest.mark.parametrize(
    ("fault", "code", "register"),
    [(30, 0x2310, 0x03), (103, 0x8100, 0x11), (20, 0x4310, 0x09), (50, 0x3210, 0x05), (190, 0xFF11, 0x81)],
)
def test_a_fault_has_its_code_and_sets_its_bits(fault: int, code: int, register: int) -> None:
    assert (emcy_code(fault), register_bits(code)) == (code, register)


def test_an_unknown_one_is_a_generic_error() -> None:
    assert (emcy_code(999), register_bits(UNKNOWN_CODE)) == (UNKNOWN_CODE, 0x01)
