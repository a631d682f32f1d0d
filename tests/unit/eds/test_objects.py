"""One object of an EDS with its sub-indices (CiA 306 §4.6.3): compact ones, missing ones, and their types."""

from __future__ import annotations

import pytest

from bridge.eds import Description, read_device
from bridge.eds.model import Object, ObjectType, StaticDataType


def read(text: str) -> tuple[Object, list[str]]:
    listed = "[DeviceInfo]\n[OptionalObjects]\nSupportedObjects=1\n1=0x2000\n"
    found: Description = read_device(f"{listed}{text}".encode(), "x.eds")
    one = found.object(0x2000)
    assert one is not None
    return one, [text for one in found.findings if "2000h" in (text := str(one.said))]


VAR = "[2000]\nParameterName=Own\nObjectType=0x7\nDataType=0x0006\nAccessType=rw\n"
ARRAY = "[2000]\nParameterName=Own\nObjectType=0x8\n"


def sub(number: int, more: str = "DataType=0x0006\n") -> str:
    return f"[2000sub{number:X}]\nParameterName=e{number}\nObjectType=0x7\nAccessType=rw\n{more}"


def test_a_variable_is_its_own_entry() -> None:
    one, told = read(VAR)
    assert (one.name, one.object_type, [entry.sub for entry in one.entries]) == ("Own", ObjectType.VAR, [0])
    assert one.entries[0].data_type is StaticDataType.UNSIGNED16
    assert told == []


def test_the_number_of_sub_indices_that_are_there_counts() -> None:
    one, told = read(f"{ARRAY}SubNumber=5\n{sub(0)}{sub(1)}")
    assert [entry.sub for entry in one.entries] == [0, 1]
    assert told == ["2000h says 5 sub-indices and has 2: those that are there count"]


def test_without_sub_index_0_it_is_made_from_the_highest() -> None:
    one, told = read(f"{ARRAY}SubNumber=2\n{sub(1)}{sub(3)}")
    first = one.entry(0)
    assert first is not None
    assert first.default is not None
    assert first.default.plain == 3
    assert told == ["2000h has no sub-index 0: made from the highest one"]


def test_compact_sub_indices_are_all_there() -> None:
    """CiA 306 §4.6.3.2: CompactSubObj."""
    one, _ = read(f"{ARRAY}CompactSubObj=3\nDataType=0x0006\nAccessType=rw\nDefaultValue=7\n")
    assert [entry.sub for entry in one.entries] == [0, 1, 2, 3]
    third = one.entry(3)
    assert third is not None
    assert third.data_type is StaticDataType.UNSIGNED16
    assert third.default is not None
    assert third.default.plain == 7


def test_an_object_with_sub_indices_that_has_none_is_named() -> None:
    one, told = read(ARRAY)
    assert one.entries == ()
    assert "2000h has no sub-indices" in told


@pytest.mark.parametrize("name", ["", "ParameterName=\n"])
def test_what_has_no_name_is_called_by_its_number(name: str) -> None:
    one, told = read(VAR.replace("ParameterName=Own\n", name))
    assert one.name == "2000h"
    assert told == ["2000h has no ParameterName"]
