"""Values of 32 bits in two registers: types, signs, and ranges that begin and end between values."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.image import DataType, Image, Point, Quality, Value
from bridge.northbound.modbus.pdu import ExceptionCode, ModbusException
from bridge.northbound.modbus.registers import RegisterTable, Row, Words32
from bridge.northbound.modbus.values32 import Values32, value_of, words_of

BIG = Words32("ABCD")


def row(kind: str, name: str = "x") -> Row:
    return Row(RegisterTable.INPUT_REGISTER, 32, name, kind, "r")


@pytest.mark.parametrize(
    ("kind", "value", "words"),
    [
        ("float32", 1.5, (0x3FC0, 0)),
        ("int32", -2, (0xFFFF, 0xFFFE)),
        ("uint32", 0x1234_5678, (0x1234, 0x5678)),
        ("uint16", 0xABCD, (0xABCD,)),
        ("int16", -1, (0xFFFF,)),
        ("bool", True, (1,)),
    ],
)
def test_a_value_is_read_and_written_by_its_type(kind: str, value: Value, words: tuple[int, ...]) -> None:
    assert words_of(row(kind), value, BIG) == words
    assert value_of(row(kind), words, BIG) == value


@given(st.integers(-(1 << 31), (1 << 31) - 1), st.sampled_from(["ABCD", "CDAB", "BADC", "DCBA"]))
def test_a_value_is_the_same_in_every_word_order(value: int, order: str) -> None:
    words32 = Words32(order)  # type: ignore[arg-type]
    assert value_of(row("int32"), words_of(row("int32"), value, words32), words32) == value


class Case:
    """Three values from register 32 on."""

    def __init__(self) -> None:
        self.image = Image(Point(name=f"d/{name}", data_type=DataType.INT32) for name in "abc")
        self.values = Values32([row("int32", name) for name in "abc"], "d", self.image, BIG, 32)

    def set(self, name: str, value: int, quality: Quality = Quality.GOOD) -> None:
        self.image.set(self.image.index[f"d/{name}"], value, 1.0, quality)


def test_a_range_has_the_values_within_it() -> None:
    case = Case()
    for number, name in enumerate("abc", 1):
        case.set(name, number)
    assert case.values.read(32, 38) == [0, 1, 0, 2, 0, 3]
    assert case.values.read(34, 36) == [0, 2]
    assert case.values.read(10, 34) == [0, 1], "what lies before is others'"


def test_one_that_is_not_there_reads_as_0_beside_others_and_alone_it_is_refused() -> None:
    case = Case()
    case.set("a", 7)
    assert case.values.read(32, 38) == [0, 7, 0, 0, 0, 0]
    with pytest.raises(ModbusException) as caught:
        case.values.read(34, 38)
    assert caught.value.code is ExceptionCode.NOT_RESPONDING
    assert case.values.read(34, 38, beside=True) == [0, 0, 0, 0]


def test_what_is_not_configured_is_refused_as_that() -> None:
    case = Case()
    case.set("b", 0, Quality.CONFIG_ERROR)
    with pytest.raises(ModbusException) as caught:
        case.values.read(34, 36)
    assert caught.value.code is ExceptionCode.PATH_UNAVAILABLE


def test_which_are_not_good() -> None:
    case = Case()
    case.set("a", 7)
    case.set("b", 7, Quality.STALE)
    assert case.values.not_good() == [False, True, True]


def test_what_is_written_is_by_name() -> None:
    found = Case().values.written(34, [0, 5, 0xFFFF, 0xFFFF])
    assert [(one.name, value) for one, value in found] == [("b", 5), ("c", -1)]
