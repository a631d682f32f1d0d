"""Codes of an 8400 motec as objects (EDS84DMOTCAN 3.0, §12)."""

from __future__ import annotations

import pytest

from bridge.sim.lenze.lenze_codes import FIRMWARE, BusDisplay
from bridge.sim.lenze.lenze_motec import LenzeMotec
from bridge.sim.lenze.lenze_settings import CODE_BASE


@pytest.fixture
def motec(bench_of):
    made = bench_of(LenzeMotec(5))
    made.run(0.3)
    return made


def test_counters_count_to_16_bits_and_from_0_again() -> None:
    display = BusDisplay(error_state=3)
    display.counters[0] = 0xFFFF
    display.count(1, 12)
    assert (display.counters[0], display.counters[11]) == (0, 1)
    display.reset()
    assert (display.counters, display.error_state) == ([0] * 12, 0)


def test_a_code_is_read_and_written_at_its_index(motec) -> None:
    assert motec.read(CODE_BASE - 350, 0) == 5
    assert motec.write(CODE_BASE - 11, 0, 3000, 2) == "60"
    assert motec.node.codes.reference_rpm == 3000
    assert motec.write(CODE_BASE - 11, 0, 3000, 4) == "06070012"
    assert motec.write(CODE_BASE - 593, 1, 1, 1) == "60"
    assert motec.node.codes.rpdo_reactions[0] == 1
    assert motec.write(CODE_BASE - 593, 1, 3, 1) == "06090030"


def test_what_is_not_saved_is_gone_with_the_mains(motec) -> None:
    def set_and_cycle(save: bool) -> int:
        motec.write(CODE_BASE - 593, 1, 1, 1)
        if save:
            motec.write(CODE_BASE - 2, 11, 1, 1)
        motec.run(0.1)
        motec.node.power_cycle()
        motec.run(0.5)
        return motec.node.codes.rpdo_reactions[0]

    assert [set_and_cycle(False), set_and_cycle(True)] == [0, 1]


def test_the_firmware_is_that_of_the_manuals_example(motec) -> None:
    assert motec.node.dictionary.find(CODE_BASE - 99, 0).upload() == FIRMWARE.encode()
