"""Communication objects of CAN 5000 and their coordinates (ID 441684.06 §11.1)."""

from __future__ import annotations

import pytest

from bridge.sim.core.dictionary import Dictionary, IntegerType, constant
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000
from bridge.sim.stoeber.stoeber_objects import alias, identity
from bridge.sim.stoeber.stoeber_settings import coordinate


def test_the_product_code_is_the_rated_power() -> None:
    assert identity(1.5, "MDS 5015").product_code == 15


def test_an_alias_is_the_object_itself() -> None:
    objects = Dictionary()
    objects.add_array(0x1400, [constant(IntegerType.UNSIGNED8, 7), constant(IntegerType.UNSIGNED8, 8)])
    alias(objects, "A221", 0x1400, (1, 2))
    assert [objects.find(coordinate("A221"), element) for element in (0, 1)] == [
        objects.find(0x1400, sub) for sub in (1, 2)
    ]


@pytest.fixture
def drive(bench_of):
    made = bench_of(Stoeber5000(5))
    made.run(0.3)
    return made


def test_it_says_who_it_is(drive) -> None:
    assert drive.read(0x1018, 1) == 0xB9
    assert drive.read(0x1000, 0) == 0x0002_0192


def test_the_watch_for_a_sync_has_a_longest_time(drive) -> None:
    assert drive.write(0x1006, 0, 10_000, 4) == "60"
    assert drive.write(0x1006, 0, 32_000_001, 4) == "06090030"
    assert drive.read(0x1006, 0) == 10_000
