"""Communication objects of an 8400 motec (EDS84DMOTCAN 3.0, §13)."""

from __future__ import annotations

import pytest

from bridge.sim.core.dictionary import Dictionary, Number
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.sdo_abort import AbortCode, SdoAbort
from bridge.sim.core.store import Store
from bridge.sim.lenze.lenze_objects import VENDOR_ID, LenzeObjects
from bridge.sim.lenze.lenze_settings import RULES, LenzeCodes, communication

OFF = 0x8000_0000


class Rig:
    def __init__(self) -> None:
        self.codes = Store(lambda: LenzeCodes(5))
        self.stack = Store(lambda: communication(self.codes.current, (4, 4)))
        self.objects = Dictionary()
        self.rules = LenzeObjects(self.codes, self.stack)
        self.rules.add_to(self.objects, EmcyProducer(self.stack, RULES))

    def number(self, index: int, sub: int) -> Number:
        entry = self.objects.find(index, sub)
        assert isinstance(entry, Number)
        return entry

    def read(self, index: int, sub: int = 0) -> int:
        return int.from_bytes(self.number(index, sub).upload(), "little")

    def write(self, index: int, sub: int, value: int) -> int:
        entry = self.number(index, sub)
        try:
            entry.download(entry.data_type.encode(value))
        except SdoAbort as abort:
            return abort.code
        return 0


def test_a_write_changes_the_stack_and_the_codes() -> None:
    rig = Rig()
    assert rig.write(0x1017, 0, 203) == 0
    assert (rig.codes.current.heartbeat_ms, rig.stack.current.heartbeat_ms) == (203, 200)
    assert rig.write(0x1800, 5, 100) == 0
    assert rig.codes.current.times_ms[4] == 100
    assert rig.read(0x1018, 1) == VENDOR_ID


@pytest.mark.parametrize(
    ("index", "sub", "value", "code"),
    [
        (0x1400, 1, 0x180, AbortCode.VALUE_RANGE),  # below 385
        (0x1400, 1, OFF | 0x300, 0),
        (0x1400, 1, 0x300, AbortCode.VALUE_RANGE),  # another one while it is on
        (0x1400, 2, 255, AbortCode.VALUE_RANGE),
        (0x1400, 2, 1, 0),
        (0x1006, 0, 1500, AbortCode.VALUE_RANGE),
        (0x1006, 0, 2000, 0),
        (0x1016, 1, 128 << 16, AbortCode.VALUE_RANGE),
        (0x1014, 0, 0x99, AbortCode.VALUE_RANGE),
        (0x1014, 0, OFF | 0x99, 0),
        (0x1201, 1, 0x645, 0),
        (0x1600, 1, 0x2000_0110, AbortCode.NOT_MAPPABLE),
        (0x1600, 0, 0, 0),
    ],
)
def test_each_object_has_its_rule(index: int, sub: int, value: int, code: int) -> None:
    assert Rig().write(index, sub, value) == code


def test_an_inhibit_time_is_changed_while_its_pdo_is_off() -> None:
    rig = Rig()
    assert rig.write(0x1800, 3, 100) == AbortCode.WRONG_STATE
    rig.rules.set_pdo_off(1, 1)
    assert rig.write(0x1800, 3, 105) == 0
    assert rig.codes.current.inhibit_ms == [0, 10, 0]
