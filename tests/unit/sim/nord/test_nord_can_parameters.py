"""Communication objects as NORD parameters P160…P167 (BU 2500 §7.1.2)."""

from __future__ import annotations

import pytest

READ_ONLY = "06010002"


def parameter(number: int) -> int:
    return 0x2000 + number


def test_a_parameter_and_its_object_are_one(bench):
    assert bench.write(parameter(166), 2, 250, 2) == "60"
    assert bench.read(0x1017, 0) == 250
    bench.write(0x1803, 5, 100, 2)
    assert bench.read(parameter(164), 4) == 100


@pytest.mark.landing(2)
@pytest.mark.parametrize(("element", "direction"), [(6, "send"), (6, "receive")])
def test_p160_switches_each_half_of_a_pdo(bench, element, direction):
    assert bench.read(parameter(160), element) == 3
    kept = 2 if direction == "send" else 1
    assert bench.write(parameter(160), element, kept, 2) == "60"
    off = [bench.read(index, 1) >> 31 for index in (0x1800, 0x1400)]
    assert off == ([0, 1] if direction == "send" else [1, 0])


def test_the_first_sdo_channel_is_fixed(bench):
    assert bench.write(parameter(160), 2, 0, 2) == READ_ONLY
    assert bench.write(parameter(161), 2, 0x700, 2) == READ_ONLY
    assert bench.write(parameter(160), 3, 3, 2) == "60"
    assert bench.read(0x1201, 1) >> 31 == 0


def test_a_mapping_is_changed_entry_by_entry_and_counts_up_to_the_first_that_is_empty(bench):
    assert bench.write(parameter(165), 2, 0, 4) == "60"
    assert bench.read(0x1600, 0) == 1
    assert bench.write(parameter(165), 2, 0x3002_0110, 4) == "60"
    assert bench.read(0x1600, 0) == 4


def test_nothing_is_mapped_while_the_node_is_operational(live):
    assert live.write(parameter(165), 1, 0, 4) == READ_ONLY
