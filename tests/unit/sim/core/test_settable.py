"""Objects that a site file may set."""

from __future__ import annotations

import pytest

from bridge.base.errors import OperationFailed
from bridge.sim.core.dictionary import Cell, Dictionary, IntegerType, Number, VisibleString, constant
from bridge.sim.core.settable import put_in, settable


def objects() -> Dictionary:
    made, cell = Dictionary(), Cell()
    made.add(0x6083, 0, Number(IntegerType.UNSIGNED32, cell.get, cell.set, high=100))
    made.add(0x6064, 0, constant(IntegerType.INTEGER32, 0))
    made.add(0x1008, 0, VisibleString("drive"))
    return made


def test_a_value_is_put_into_its_object() -> None:
    entry = settable(objects(), "6083", 0x6083, 0, "object", is_command=False)
    put_in(entry, "6083", 7.0, 7)
    assert entry.upload() == b"\7\0\0\0"
    with pytest.raises(OperationFailed, match=r"6083 = 101: VALUE_RANGE 06090030h"):
        put_in(entry, "6083", 101.0, 101)


@pytest.mark.landing(4)
@pytest.mark.parametrize(
    ("index", "is_command", "why"),
    [
        (0x7000, False, "the simulated drive has no such object"),
        (0x6064, False, "cannot be set"),
        (0x1008, False, "cannot be set"),
        (0x6083, True, "cannot be set"),
    ],
)
def test_what_cannot_be_set_is_named(index: int, is_command: bool, why: str) -> None:
    with pytest.raises(OperationFailed, match=f"x1.* {why}"):
        settable(objects(), "x1", index, 0, "object", is_command)
