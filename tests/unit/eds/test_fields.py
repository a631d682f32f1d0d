"""Single fields of a section: a bad one is reported and left out, an odd one is taken with a warning."""

from __future__ import annotations

import pytest

from bridge.eds.fields import Fields
from bridge.eds.ini import IniValue, Section
from bridge.eds.model import Access, FindingSeverity, Report, StaticDataType, Value


class Case:
    def __init__(self, **keys: str) -> None:
        self.report = Report()
        self.fields = Fields(self.report)
        self.section = Section("1018", 1, {name.lower(): IniValue(text, 7) for name, text in keys.items()})

    @property
    def told(self) -> list[tuple[FindingSeverity, str]]:
        assert all(one.line == 7 for one in self.report.findings())
        return [(one.severity, str(one.said)) for one in self.report.findings()]


def test_a_number_within_its_range_is_taken() -> None:
    case = Case(SubNumber="0x05")
    assert case.fields.number(case.section, "SubNumber", high=5) == 5
    assert case.fields.number(case.section, "other") is None
    assert case.told == []


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("6", "SubNumber=6 is not within 0…5: left out"),
        ("-1", "SubNumber=-1 is not within 0…5: left out"),
        ("x", "SubNumber: x is not a number: left out"),
    ],
)
def test_one_beyond_it_or_none_is_left_out(text: str, told: str) -> None:
    case = Case(SubNumber=text)
    assert case.fields.number(case.section, "SubNumber", high=5) is None
    assert case.told == [(FindingSeverity.ERROR, told)]


@pytest.mark.parametrize(
    ("text", "flag", "told"),
    [
        ("0", False, ""),
        ("1", True, ""),
        ("true", True, "PDOMapping=true should be 1 or 0"),
        ("No", False, "PDOMapping=No should be 1 or 0"),
        ("2", True, "PDOMapping=2 is taken as 1"),
    ],
)
def test_a_flag_is_0_or_1(text: str, flag: bool, told: str) -> None:
    case = Case(PDOMapping=text)
    assert case.fields.flag(case.section, "PDOMapping") is flag
    assert case.told == ([(FindingSeverity.WARNING, told)] if told else [])


def test_a_flag_that_is_missing_is_not_set_and_one_that_is_none_neither() -> None:
    case = Case(PDOMapping="perhaps")
    assert not case.fields.flag(case.section, "other")
    assert not case.fields.flag(case.section, "PDOMapping")
    assert [severity for severity, _ in case.told] == [FindingSeverity.ERROR]


def test_a_value_is_that_of_its_type() -> None:
    case = Case(DefaultValue="010", LowLimit="300")
    assert case.fields.value(case.section, "DefaultValue", StaticDataType.UNSIGNED8) == Value(10)
    assert case.fields.value(case.section, "LowLimit", StaticDataType.UNSIGNED8) is None
    assert case.fields.value(case.section, "HighLimit", StaticDataType.UNSIGNED8) is None
    assert case.told == [
        (FindingSeverity.WARNING, "DefaultValue: 010 is taken as 10, not as octal 8"),
        (FindingSeverity.ERROR, "LowLimit: 300 is beyond UNSIGNED8: left out"),
    ]


@pytest.mark.parametrize("access", Access)
def test_an_access_of_the_standard_is_taken_in_any_case(access: Access) -> None:
    case = Case()
    assert case.fields.access(IniValue(access.value.upper(), 7), Access.RO, 7, "1018") is access
    assert case.told == []


@pytest.mark.parametrize(
    ("text", "access"),
    [("read_write", Access.RW), ("Read Only", Access.RO), ("w", Access.WO), ("nonsense", Access.CONST)],
)
def test_another_word_is_taken_as_what_it_means_or_as_the_default(text: str, access: Access) -> None:
    case = Case()
    assert case.fields.access(IniValue(text, 7), Access.CONST, 7, "1018") is access
    assert case.told == [(FindingSeverity.WARNING, f"AccessType={text} is taken as {access}")]


def test_one_that_is_missing_is_the_default() -> None:
    case = Case()
    assert case.fields.access(None, Access.RW, 7, "1018sub1") is Access.RW
    assert case.told == [(FindingSeverity.WARNING, "1018sub1 has no AccessType: taken as rw")]
