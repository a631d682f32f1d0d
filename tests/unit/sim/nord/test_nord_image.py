"""Process data between CANopen and the system bus (BU 2500 §6.7.5)."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from bridge.sim.core.dictionary import Dictionary
from bridge.sim.nord.nord_image import ProcessImage, add_parameter, display, fixed


class Rig:
    def __init__(self) -> None:
        self.online = True
        drives: Any = [
            SimpleNamespace(
                status_word=0x100 + place, actual_value=lambda value, place=place: 10 * place + value
            )
            for place in range(4)
        ]
        self.image = ProcessImage(drives, lambda drive: self.online, "three")
        self.objects = Dictionary()
        self.image.add_to(self.objects)

    def read(self, index: int, sub: int) -> int:
        return int.from_bytes(self.objects.find(index, sub).upload(), "little")

    def write(self, index: int, sub: int, value: int) -> None:
        self.objects.find(index, sub).download(value.to_bytes(2, "little"))


def test_words_of_a_drive_lie_at_its_place() -> None:
    rig = Rig()
    rig.write(0x3000, 2, 0x047E)
    rig.write(0x3002, 4, 0x2000)
    assert (rig.image.control[1], rig.image.setpoints_of(1)) == (0x047E, [0x2000, 0, 0])
    assert rig.image.take_touched() == [1]
    assert rig.image.take_touched() == []
    assert (rig.read(0x3001, 3), rig.read(0x3003, 8)) == (0x102, 22)
    rig.online = False
    assert (rig.read(0x3001, 3), rig.read(0x3003, 8)) == (0, 0)


def test_a_word_said_again_is_a_telegram_but_no_news() -> None:
    rig = Rig()
    rig.write(0x3000, 1, 7)
    rig.image.dirty.is_set = False
    rig.write(0x3000, 1, 7)
    assert (rig.image.dirty.is_set, rig.image.take_touched()) == (False, [0])
    rig.image.clear()
    assert (rig.image.dirty.is_set, rig.image.control) == (True, [0] * 4)


@pytest.mark.parametrize("element", [1, 2, 3, 6])
def test_p176_shows_outputs_and_then_four_words_of_each_drive(element: int) -> None:
    rig = Rig()
    rig.image.set_outputs(3)
    rig.write(0x3000, 1, 4)
    rig.write(0x3002, 1, 5)
    rig.write(0x3000, 2, 6)
    assert rig.image.bus_in(element) == {1: 3, 2: 4, 3: 5, 6: 6}[element]
    assert rig.image.bus_out(6) == 0x101


def test_a_parameter_of_the_interface_has_no_sub_index_0() -> None:
    objects = Dictionary()
    add_parameter(objects, 173, [display(lambda: 7), fixed(9)])
    assert [objects.find(0x20AD, sub).upload()[0] for sub in (1, 2)] == [7, 9]
