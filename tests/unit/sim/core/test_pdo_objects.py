"""Rules for changing PDOs by their objects."""

from __future__ import annotations

import pytest

from bridge.sim.core.communication_settings import CobId, CommunicationSettings, PdoSettings, SlaveRules
from bridge.sim.core.dictionary import Cell, Dictionary, IntegerType, Number, constant
from bridge.sim.core.pdo_objects import PdoConfigurator, check_cob_id, check_length
from bridge.sim.core.sdo_abort import AbortCode, SdoAbort
from bridge.sim.core.store import Store

OFF = 0x8000_0000


class Rig:
    def __init__(self) -> None:
        self.state_is_right = True
        self.objects = Dictionary()
        self.store = Store(
            lambda: CommunicationSettings(
                emcy=CobId(0x85),
                sdo=[],
                rpdo=[PdoSettings(0x205, entries=[0] * 4)],
                tpdo=[PdoSettings(0x185, entries=[0] * 4)],
            )
        )
        word, status = Cell(), constant(IntegerType.UNSIGNED16, 0)
        self.objects.add(0x6040, 0, Number(IntegerType.UNSIGNED16, word.get, word.set, in_rpdo=True))
        self.objects.add(0x6041, 0, Number(IntegerType.UNSIGNED16, status.read, in_tpdo=True))
        self.objects.add(0x607A, 0, Number(IntegerType.INTEGER32, word.get, word.set, in_rpdo=True))
        PdoConfigurator(self.objects, self.store, SlaveRules(), lambda: self.state_is_right).add()

    def write(self, index: int, sub: int, value: int) -> int:
        """The abort code, 0 where it was taken."""
        entry = self.objects.find(index, sub)
        assert isinstance(entry, Number)
        try:
            entry.download(entry.data_type.encode(value))
        except SdoAbort as abort:
            return abort.code
        return 0


def test_an_rpdo_is_mapped_as_cia_301_has_it() -> None:
    rig = Rig()
    steps = [
        (0x1600, 0, 0, AbortCode.UNSUPPORTED_ACCESS),  # while it is on
        (0x1400, 1, OFF | 0x205, 0),
        (0x1600, 0, 0, 0),
        (0x1600, 1, 0x6040_0010, 0),
        (0x1600, 2, 0x0005_0008, 0),  # a gap
        (0x1600, 3, 0x6041_0010, AbortCode.NOT_MAPPABLE),  # sent, not received
        (0x1600, 3, 0x6040_0020, AbortCode.NOT_MAPPABLE),  # of another length
        (0x1600, 3, 0x7000_0010, AbortCode.NOT_MAPPABLE),
        (0x1600, 0, 3, AbortCode.NOT_MAPPABLE),  # one of them is empty
        (0x1600, 0, 9, AbortCode.VALUE_RANGE),
        (0x1600, 0, 2, 0),
        (0x1400, 1, 0x205, 0),
    ]
    assert [(rig.write(index, sub, value)) for index, sub, value, _ in steps] == [code for *_, code in steps]
    (pdo,) = rig.store.current.rpdo
    assert (pdo.enabled, pdo.mapping) == (True, [0x6040_0010, 0x0005_0008])


@pytest.mark.parametrize(
    ("value", "code"),
    [
        (0x300, AbortCode.VALUE_RANGE),  # another one while it is on
        (OFF | 0x300, 0),
        (OFF | 0x2000_0300, AbortCode.VALUE_RANGE),  # 29 bits
    ],
)
def test_an_identifier_is_changed_while_the_pdo_is_off(value: int, code: int) -> None:
    assert Rig().write(0x1400, 1, value) == code


def test_nothing_changes_in_operational() -> None:
    rig = Rig()
    rig.state_is_right = False
    assert rig.write(0x1400, 1, OFF | 0x205) == AbortCode.WRONG_STATE


@pytest.mark.parametrize("kind", [241, 252, 253])
def test_reserved_transmission_types_are_refused(kind: int) -> None:
    rig = Rig()
    assert rig.write(0x1800, 2, kind) == AbortCode.VALUE_RANGE
    assert rig.write(0x1800, 2, 1) == 0


def test_eight_bytes_and_no_identifier_of_others() -> None:
    check_length([0x6064_0020, 0x6064_0020])
    with pytest.raises(SdoAbort):
        check_length([0x6064_0020, 0x6064_0020, 0x6040_0008])
    check_cob_id(0x701, enabled=False)
    for cob_id in (0x000, 0x581, 0x605, 0x701):
        with pytest.raises(SdoAbort):
            check_cob_id(cob_id, enabled=True)
