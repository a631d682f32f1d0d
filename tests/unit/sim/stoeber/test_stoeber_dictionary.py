"""Objects of CAN 5000: expedited with four bytes, and by axis (ID 441684.06 §8.2)."""

from __future__ import annotations

import pytest

from bridge.sim.core.dictionary import Cell, Dictionary, IntegerType, Number, constant
from bridge.sim.core.sdo_abort import SdoAbort
from bridge.sim.stoeber.stoeber_dictionary import AxisView, WideDictionary


@pytest.mark.parametrize(("data", "value"), [("FFFF", -1), ("FFFFFFFF", -1), ("2C010000", 300)])
def test_a_number_may_be_written_with_four_bytes(data: str, value: int) -> None:
    cell, objects = Cell(), WideDictionary()
    objects.add(0x2401, 0, Number(IntegerType.INTEGER16, cell.get, cell.set))
    objects.find(0x2401, 0).download(bytes.fromhex(data))
    assert cell.value == value
    assert len(objects.find(0x2401, 0).upload()) == 2


@pytest.mark.parametrize("data", ["00000100", "FFFF0000", "000000"])
def test_what_does_not_fit_is_refused(data: str) -> None:
    cell, objects = Cell(), WideDictionary()
    objects.add(0x2401, 0, Number(IntegerType.INTEGER16, cell.get, cell.set))
    with pytest.raises(SdoAbort):
        objects.find(0x2401, 0).download(bytes.fromhex(data))


def test_a_view_has_the_axis_that_is_chosen_and_the_device() -> None:
    device, axes, chosen = Dictionary(), [Dictionary(), Dictionary()], [0]
    for number, axis in enumerate(axes):
        axis.add(0x2401, 0, constant(IntegerType.UNSIGNED8, number))
    view = AxisView(device, axes, lambda: chosen[-1])
    view.add(0x2000, 0, constant(IntegerType.UNSIGNED8, 9))
    assert device.has_object(0x2000)
    assert (view.has_object(0x2401), view.has_object(0x2000), view.has_object(0x3000)) == (True, True, False)
    for number in (1, 0):
        chosen.append(number)
        assert view.find(0x2401, 0).upload() == bytes([number])
        assert view.find(0x2000, 0).upload() == b"\x09"
