"""A drive's state machine as its family declares it."""

from __future__ import annotations

import pytest

from bridge.mapping import load_family
from bridge.sim.generic.generic_axis import GenericAxis
from bridge.sim.generic.generic_family import plan_of_family


class Rig:
    def __init__(self, family: str = "cia402/velocity") -> None:
        self.told: list[int] = []
        (plan,) = plan_of_family(load_family(family), 5).axes
        self.axis = GenericAxis(plan, self.told.append)

    def word(self, word: int) -> str:
        self.axis.write(word, 0, 0xFFFF)
        assert self.axis.obey()
        return self.axis.state


def test_it_is_enabled_step_by_step_and_shows_the_words_of_its_family() -> None:
    rig = Rig()
    assert [rig.word(word) for word in (6, 7, 15)] == ["ready", "switched_on", "operation_enabled"]
    assert rig.axis.status_word & 0x6F == 0x27
    assert rig.axis.is_enabled
    assert rig.word(0) == "switch_on_inhibited"


def test_a_word_in_two_parts_takes_effect_once() -> None:
    rig = Rig()
    assert not rig.axis.obey()
    rig.axis.write(0x06, 0, 0xFF)
    rig.axis.write(0x00, 8, 0xFF)
    assert rig.axis.control_word == 0
    assert rig.axis.obey()
    assert rig.axis.state == "ready"


def test_a_fault_is_acknowledged_by_an_edge() -> None:
    rig = Rig()
    rig.word(0x80)
    rig.axis.fail(0x2310)
    assert rig.word(0x80) == "fault"
    rig.word(0)
    assert rig.word(0x80) == "switch_on_inhibited"
    assert rig.told == [0x2310, 0]


@pytest.mark.parametrize("is_faulty", [False, True])
def test_without_a_master_there_is_no_voltage_and_a_fault_stays(is_faulty: bool) -> None:
    rig = Rig()
    for word in (6, 7, 15):
        rig.word(word)
    if is_faulty:
        rig.axis.fail(1)
    rig.axis.master_lost()
    assert rig.axis.state == ("fault" if is_faulty else "switch_on_inhibited")
    rig.axis.power_on()
    assert rig.axis.state == "switch_on_inhibited"
