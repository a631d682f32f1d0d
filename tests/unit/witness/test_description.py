"""Device descriptions as the witness reads them: names, types and numbers, from EDS, DCF and XDD."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.witness.description import DictionaryEntry, ObjectDictionary, Unreadable, describe

EDS = """\
[DeviceInfo]
VendorName=Acme
[1400]
ParameterName=RPDO communication
SubNumber=2
[1400sub1]
ParameterName=COB-ID
DataType=0x0007
DefaultValue=$NODEID+0x200
[6200]
ParameterName=Outputs
DataType=0x0005
[6200sub1]
ParameterName=Outputs 1 to 8
[6200sub2]
ParameterName=9 to 16
DataType=0x0006
ParameterValue=7
DefaultValue=5
[2000]
ParameterName=Mode
DataType=0x2
DefaultValue=-0x10
"""


def read(text: str = EDS, node_id: int = 5) -> ObjectDictionary:
    return describe(text.encode(), node_id)


def test_objects_and_their_elements_have_names_types_and_numbers() -> None:
    found = read().entries
    assert found[0x2000, 0] == DictionaryEntry("Mode", 2, -16, False)
    assert found[0x1400, 1] == DictionaryEntry("COB-ID", 7, 0x205, False)
    assert (0x6200, 0) not in found, "an object with elements has no number of its own"


def test_what_the_file_configures_counts_before_the_default() -> None:
    found = read()
    assert found.number(0x6200, 2) == 7
    assert found.entries[0x6200, 2].is_configured
    assert found.number(0x6200, 9) is None


def test_an_element_without_a_type_has_that_of_its_object() -> None:
    assert read().entries[0x6200, 1].data_type == 5
    assert read().entries[0x6200, 2].data_type == 6


def test_a_title_has_the_objects_name_first_once() -> None:
    found = read()
    assert found.title((0x6200, 1)) == "Outputs 1 to 8"
    assert found.title((0x6200, 2)) == "Outputs 9 to 16"


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("5", 5),
        ("0x10", 16),
        ("10h", 16),
        ("$NODEID + 0x180", 0x185),
        ("0x180+NODE_ID", 0x185),
        ("(5)", 5),
        ("-3", -3),
        ("5 ; comment", 5),
        ("1.5", None),
        ("x", None),
        ("", None),
    ],
)
def test_numbers_are_written_in_many_ways(text: str, number: int | None) -> None:
    assert read(EDS.replace("-0x10", text)).number(0x2000, 0) == number


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_encodings_and_line_ends_do_not_matter(encoding: str, end: str) -> None:
    text = EDS.replace("ParameterName=Mode", "ParameterName=Größe").replace("\n", end)
    assert describe(text.encode(encoding), 5).entries[0x2000, 0].name == "Größe"


def test_what_is_there_twice_counts_as_it_stands_first() -> None:
    assert read(EDS + "[2000]\nDefaultValue=9\nLowLimit=1\n").number(0x2000, 0) == -16


XDD = """<?xml version="1.0"?>
<x:Profile xmlns:x="http://x">
  <x:CANopenObject index="6200" name="Outputs" dataType="05">
    <x:CANopenSubObject subIndex="01" name="1 to 8" dataType="05" defaultValue="3"/>
    <x:CANopenSubObject subIndex="0A" name="more" dataType="0x0006" actualValue="9"/>
  </x:CANopenObject>
</x:Profile>"""


def test_an_xdd_says_the_same_with_hexadecimal_types() -> None:
    """CiA 311."""
    found = read(XDD).entries
    assert found[0x6200, 1] == DictionaryEntry("1 to 8", 5, 3, False)
    assert found[0x6200, 10] == DictionaryEntry("more", 6, 9, True)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "describes no objects"),
        ("nonsense", "describes no objects"),
        ("<a", "no element found|unclosed"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><a/>', "has a document type"),
        (XDD.replace('index="6200"', 'index="62x0"'), 'index = "62x0" is no number'),
    ],
)
def test_what_is_no_description_is_refused(text: str, why: str) -> None:
    with pytest.raises(Unreadable, match=why):
        read(text)


@given(st.binary(max_size=80))
def test_no_content_raises_anything_else(content: bytes) -> None:
    try:
        describe(b"[2000]\nDataType=5\n" + content, 5)
    except Unreadable as error:
        assert str(error)
