"""Codes as objects."""

from __future__ import annotations

import pytest

from bridge.sim.core.dictionary import Cell, Dictionary, IntegerType, Number
from bridge.sim.core.sdo_abort import AbortCode, SdoAbort
from bridge.sim.core.store import Store
from bridge.sim.lenze.lenze_code_table import CodeTable
from bridge.sim.lenze.lenze_settings import LenzeCodes

U8 = IntegerType.UNSIGNED8


@pytest.fixture
def rig() -> tuple[Dictionary, Store[LenzeCodes], CodeTable]:
    objects, codes = Dictionary(), Store(lambda: LenzeCodes(5))
    return objects, codes, CodeTable(objects, codes)


def test_the_index_counts_down_from_5fffh(rig: tuple[Dictionary, Store[LenzeCodes], CodeTable]) -> None:
    objects, codes, table = rig
    table.setting(11, 0, IntegerType.UNSIGNED16, "reference_rpm", (50, 50_000))
    entry = objects.find(0x5FF4, 0)
    entry.download((3000).to_bytes(2, "little"))
    assert codes.current.reference_rpm == 3000
    codes.power_on()
    assert entry.upload() == (1500).to_bytes(2, "little"), "it is that of the store at each access"


def test_a_list_takes_what_is_in_it(rig: tuple[Dictionary, Store[LenzeCodes], CodeTable]) -> None:
    objects, _, table = rig
    cell = Cell()
    table.choice(7, 0, Number(U8, cell.get, cell.set), (10, 40))
    with pytest.raises(SdoAbort) as refused:
        objects.find(0x5FF8, 0).download(b"\x0b")
    assert refused.value.code == AbortCode.VALUE_RANGE
    objects.find(0x5FF8, 0).download(b"\x28")
    assert cell.value == 40


def test_sub_codes_are_counted(rig: tuple[Dictionary, Store[LenzeCodes], CodeTable]) -> None:
    objects, codes, table = rig
    written: list[tuple[int, int]] = []
    table.array(593, U8, lambda: codes.current.rpdo_reactions, (0, 4), lambda *how: written.append(how))
    table.displays(360, IntegerType.UNSIGNED16, 3, lambda place: 10 * place)
    assert [objects.find(0x5FFF - number, 0).upload() for number in (593, 360)] == [b"\2", b"\3"]
    objects.find(0x5FFF - 593, 2).download(b"\1")
    assert written == [(1, 1)]
    assert objects.find(0x5FFF - 360, 3).upload() == b"\x14\0"
