"""The object dictionary of simulated nodes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.sim.core.dictionary import (
    Cell,
    Dictionary,
    Domain,
    IntegerType,
    Number,
    VisibleString,
    constant,
    item,
    variable,
)
from bridge.sim.core.sdo_abort import AbortCode, SdoAbort


@given(st.sampled_from(list(IntegerType)), st.data())
def test_what_is_encoded_is_decoded(kind: IntegerType, data: st.DataObject) -> None:
    low, high = constant(kind, 0).limits
    value = data.draw(st.integers(low, high))
    assert kind.decode(kind.encode(value)) == value
    assert len(kind.encode(value)) == kind.size
    assert kind.decode(kind.encode(high + 1)) == low, "a register wraps"


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"\1\0\0", AbortCode.LENGTH_TOO_HIGH),
        (b"\1", AbortCode.LENGTH_TOO_LOW),
        (b"\x0b\0", AbortCode.VALUE_RANGE),
        (b"\0\0", AbortCode.VALUE_RANGE),
    ],
)
def test_a_number_takes_its_size_and_its_range_only(data: bytes, code: AbortCode) -> None:
    cell = Cell(7)
    number = Number(IntegerType.UNSIGNED16, cell.get, cell.set, low=1, high=10)
    with pytest.raises(SdoAbort) as refused:
        number.download(data)
    assert (refused.value.code, cell.value) == (code, 7)
    number.download(b"\x0a\0")
    assert number.upload() == b"\x0a\0"


def test_what_is_read_only_or_write_only_says_so() -> None:
    cell = Cell()
    for act, code in (
        (lambda: constant(IntegerType.UNSIGNED8, 1).download(b"\1"), AbortCode.READ_ONLY),
        (lambda: constant(IntegerType.UNSIGNED8, 1).check_writable(), AbortCode.READ_ONLY),
        (lambda: VisibleString("SK").download(b"x"), AbortCode.READ_ONLY),
        (lambda: Number(IntegerType.UNSIGNED8, None, cell.set).upload(), AbortCode.WRITE_ONLY),
        (lambda: Domain(2, bytes, lambda data: None).download(b"abc"), AbortCode.LENGTH_TOO_HIGH),
    ):
        with pytest.raises(SdoAbort) as refused:
            act()
        assert refused.value.code == code


def test_a_missing_object_is_told_from_a_missing_sub_index() -> None:
    objects = Dictionary()
    objects.add_array(0x1018, [constant(IntegerType.UNSIGNED32, number) for number in (1, 2, 3)])
    assert objects.find(0x1018, 0).upload() == b"\3"
    assert objects.has_object(0x1018) and not objects.has_object(0x1019)
    for at, code in (((0x1019, 0), AbortCode.OBJECT_MISSING), ((0x1018, 4), AbortCode.SUBINDEX_MISSING)):
        with pytest.raises(SdoAbort) as refused:
            objects.find(*at)
        assert refused.value.code == code


def test_one_value_under_two_indices_is_the_same() -> None:
    cells = {3: 5}
    cell = Cell(1)
    first, second = (
        variable(IntegerType.UNSIGNED8, lambda: cell, "value"),
        item(IntegerType.UNSIGNED8, lambda: cells, 3),
    )
    first.download(b"\7")
    second.download(b"\x09")
    assert (cell.value, cells, second.upload()) == (7, {3: 9}, b"\x09")
