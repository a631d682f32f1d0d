"""Device descriptions as values: objects by index, values with a node id, findings in order."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.eds.model import (
    Access,
    Description,
    Entry,
    Finding,
    FindingSeverity,
    Module,
    Object,
    ObjectType,
    Report,
    StaticDataType,
    Value,
)
from bridge.text import Text


@pytest.mark.parametrize(
    ("kind", "code"),
    [
        (StaticDataType.BOOLEAN, 0x01),
        (StaticDataType.INTEGER8, 0x02),
        (StaticDataType.UNSIGNED8, 0x05),
        (StaticDataType.UNSIGNED16, 0x06),
        (StaticDataType.UNSIGNED32, 0x07),
        (StaticDataType.REAL32, 0x08),
        (StaticDataType.VISIBLE_STRING, 0x09),
        (StaticDataType.OCTET_STRING, 0x0A),
        (StaticDataType.DOMAIN, 0x0F),
        (StaticDataType.INTEGER24, 0x10),
        (StaticDataType.REAL64, 0x11),
        (StaticDataType.INTEGER64, 0x15),
        (StaticDataType.UNSIGNED24, 0x16),
        (StaticDataType.UNSIGNED64, 0x1B),
    ],
)
def test_the_codes_of_data_types(kind: StaticDataType, code: int) -> None:
    """CiA 301 §7.4.7.1, table 44."""
    assert kind == code


@pytest.mark.parametrize(
    ("access", "readable", "writable"),
    [
        (Access.RO, True, False),
        (Access.WO, False, True),
        (Access.RW, True, True),
        (Access.RWR, True, True),
        (Access.RWW, True, True),
        (Access.CONST, True, False),
    ],
)
def test_an_access_reads_and_writes(access: Access, readable: bool, writable: bool) -> None:
    """CiA 301 §7.4.5."""
    assert (access.readable, access.writable) == (readable, writable)


def test_a_value_may_need_the_node_id() -> None:
    assert Value(5).at(None) == 5
    assert Value(0x180, True).at(5) == 0x185
    assert Value(0x180, True).at(None) is None
    assert Value("text", True).at(None) == "text"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (Value(0x180, True), "$NODEID+0x180"),
        (Value(-1, True), "$NODEID-0x1"),
        (Value(b"\x0a\x1b"), "0a 1b"),
        (Value(5), "5"),
    ],
)
def test_a_value_in_words(value: Value, text: str) -> None:
    assert str(value) == text


def entry(index: int, sub: int = 0, **more: object) -> Entry:
    return Entry(index, sub, "x", StaticDataType.UNSIGNED8, Access.RW, **more)  # type: ignore[arg-type]


def test_what_a_file_configures_counts_before_the_default() -> None:
    assert entry(1).current is None
    assert entry(1, default=Value(1)).current == Value(1)
    assert entry(1, default=Value(1), parameter_value=Value(2)).current == Value(2)


@given(st.sets(st.integers(0x1000, 0x1010), max_size=8), st.integers(0x0FFE, 0x1012))
def test_an_object_is_found_by_its_index(indices: set[int], wanted: int) -> None:
    objects = tuple(
        Object(index, "x", ObjectType.VAR, (entry(index, default=Value(index)),)) for index in sorted(indices)
    )
    found = Description("EDS", objects=objects)
    assert (found.object(wanted) is not None) is (wanted in indices)
    assert found.number(wanted) == (wanted if wanted in indices else None)
    assert found.entry(wanted, 1) is None


def test_findings_come_in_the_order_of_the_file_and_their_number_has_an_end() -> None:
    report = Report()
    report.warning(9, Text.plain("second"))
    report.error(2, Text.plain("first"))
    assert [str(one.said) for one in report.findings()] == ["first", "second"]
    for number in range(Report.most + 10):
        report.warning(100 + number, Text.plain("more"))
    found = report.findings()
    assert len(found) == Report.most + 1
    assert "12" in str(found[-1].said), "those that are left out are counted"


def test_where_a_file_breaks_off_is_an_error_with_its_line() -> None:
    report, ends = Report(), Text.plain("ends")
    report.breaks_off(7, ends)
    assert report.broken_off_at == 7
    assert report.findings() == (Finding(7, FindingSeverity.ERROR, ends),)
    assert str(Finding(7, FindingSeverity.ERROR, ends)) == "error: line 7: ends"
    assert str(Finding(0, FindingSeverity.WARNING, Text.plain("odd"))) == "warning: odd"


@pytest.mark.parametrize(
    ("module", "text"),
    [(Module(3), "3"), (Module(3, "DI 8"), "3 (DI 8)"), (Module(3, "DI 8", "750-1"), "3 (750-1, DI 8)")],
)
def test_a_module_in_words(module: Module, text: str) -> None:
    assert str(module) == text
