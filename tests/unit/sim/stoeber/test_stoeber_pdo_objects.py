"""PDO objects of CAN 5000 (ID 441684.06 §7.3, §8.1)."""

from __future__ import annotations

import pytest

from bridge.sim.core.dictionary import Cell, Dictionary, IntegerType, Number
from bridge.sim.core.sdo_abort import AbortCode, SdoAbort
from bridge.sim.core.store import Store
from bridge.sim.stoeber.stoeber_pdo_objects import StoeberPdoObjects, resolved
from bridge.sim.stoeber.stoeber_settings import factory_communication


class Rig:
    def __init__(self) -> None:
        self.objects = Dictionary()
        self.store = Store(lambda: factory_communication(5, 1, mapped=False))
        cell = Cell()
        number = Number(IntegerType.INTEGER16, cell.get, cell.set, in_rpdo=True, in_tpdo=True)
        self.objects.add(0x2401, 0, number)
        StoeberPdoObjects(5, self.objects, self.store, lambda: True).add()

    def write(self, index: int, sub: int, value: int) -> int:
        entry = self.objects.find(index, sub)
        assert isinstance(entry, Number)
        try:
            entry.download(entry.data_type.encode(value))
        except SdoAbort as abort:
            return abort.code
        return 0


def test_a_bare_function_code_means_with_the_address() -> None:
    assert (resolved(0x200, 0x200, 5), resolved(0x207, 0x200, 5)) == (0x205, 0x207)
    rig = Rig()
    assert rig.write(0x1401, 1, 0x300) == 0
    assert rig.store.current.rpdo[1].cob_id == 0x305


@pytest.mark.parametrize(
    ("kind", "code"), [(254, 0), (255, AbortCode.VALUE_RANGE), (241, AbortCode.VALUE_RANGE)]
)
def test_of_the_events_one_type_is_to_be_set(kind: int, code: int) -> None:
    assert Rig().write(0x1800, 2, kind) == code


def test_a_length_is_filled_in_and_places_may_be_empty() -> None:
    rig = Rig()
    assert rig.write(0x1600, 3, 0x2401_0000) == 0
    (pdo, *_) = rig.store.current.rpdo
    assert (pdo.mapping, pdo.count) == ([0x2401_0010], 1)
    assert rig.write(0x1600, 1, 0x0005_0008) == AbortCode.NOT_MAPPABLE, "there are no dummies"
    assert rig.write(0x1600, 1, 0x2999_0000) == AbortCode.NOT_MAPPABLE
    assert rig.write(0x1600, 0, 1) == AbortCode.READ_ONLY
