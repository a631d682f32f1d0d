"""Properties that an XDD leaves to the parameters of its application process (CiA 311 §6.4.5)."""

from __future__ import annotations

import pytest

from bridge.eds import Access, Description, Entry, StaticDataType, Value, configuration, read_device

FILE = """<?xml version="1.0" encoding="utf-8"?>
<ISO15745ProfileContainer xmlns="http://www.canopen.org/xml/1.1"><ISO15745Profile><ProfileBody>
 <DeviceIdentity><vendorName>Acme</vendorName></DeviceIdentity>
 <ApplicationProcess>{process}</ApplicationProcess>
 <ApplicationLayers><CANopenObjectList>{objects}</CANopenObjectList></ApplicationLayers>
</ProfileBody></ISO15745Profile></ISO15745ProfileContainer>
"""
OBJECT = '<CANopenObject index="2000" name="Thing" objectType="{kind}" uniqueIDRef="P"{more}/>'
EVERY_TYPE = {
    "BOOL": (StaticDataType.BOOLEAN, "1", 1),
    "BITSTRING": (StaticDataType.OCTET_STRING, "56 34 12", b"\x56\x34\x12"),
    "CHAR": (StaticDataType.INTEGER8, "-1", -1),
    "SINT": (StaticDataType.INTEGER8, "-1", -1),
    "INT": (StaticDataType.INTEGER16, "0xFFFF", -1),
    "DINT": (StaticDataType.INTEGER32, "-70000", -70000),
    "LINT": (StaticDataType.INTEGER64, "-1", -1),
    "USINT": (StaticDataType.UNSIGNED8, "255", 255),
    "BYTE": (StaticDataType.UNSIGNED8, "255", 255),
    "UINT": (StaticDataType.UNSIGNED16, "65535", 65535),
    "WORD": (StaticDataType.UNSIGNED16, "65535", 65535),
    "UDINT": (StaticDataType.UNSIGNED32, "0x12345678", 0x1234_5678),
    "DWORD": (StaticDataType.UNSIGNED32, "0x12345678", 0x1234_5678),
    "ULINT": (StaticDataType.UNSIGNED64, "1", 1),
    "LWORD": (StaticDataType.UNSIGNED64, "1", 1),
    "REAL": (StaticDataType.REAL32, "1.5", 1.5),
    "LREAL": (StaticDataType.REAL64, "1.5", 1.5),
    "STRING": (StaticDataType.VISIBLE_STRING, "abc", "abc"),
    "WSTRING": (StaticDataType.UNICODE_STRING, "abc", "abc"),
}
"""The simple types of CiA 311's schema, each with a default value."""


def read(process: str, *, kind: int = 7, more: str = "", objects: str = "") -> Description:
    objects = objects or OBJECT.format(kind=kind, more=more)
    return read_device(FILE.format(process=process, objects=objects).encode(), "test.xdd")


def parameter(content: str, attributes: str = "") -> str:
    return f'<parameterList><parameter uniqueID="P" {attributes}>{content}</parameter></parameterList>'


def only(description: Description) -> Entry:
    entry = description.entry(0x2000)
    assert entry
    return entry


@pytest.mark.parametrize("name", EVERY_TYPE)
def test_every_type_of_the_schema_is_a_type(name: str) -> None:
    data_type, text, value = EVERY_TYPE[name]
    description = read(parameter(f'<{name}/><defaultValue value="{text}"/>', 'access="readWrite"'))
    entry = only(description)
    assert description.findings == ()
    assert (entry.data_type, entry.default) == (data_type, Value(value))


def test_the_bit_string_of_a_domain_is_a_domain() -> None:
    assert only(read(parameter("<BITSTRING/>"), kind=2)).data_type is StaticDataType.DOMAIN


@pytest.mark.parametrize(
    ("attributes", "access"),
    [
        ("", Access.RO),
        ('access=""', Access.RO),
        ('access="const"', Access.CONST),
        ('access="read"', Access.RO),
        ('access="write"', Access.WO),
        ('access="readWrite"', Access.RW),
        ('access="readWriteInput"', Access.RWR),
        ('access="readWriteOutput"', Access.RWW),
        ('access="noAccess"', Access.RO),
    ],
)
def test_an_access_that_is_left_out_is_read_only(attributes: str, access: Access) -> None:
    description = read(parameter("<UINT/>", attributes))
    assert description.findings == ()
    assert only(description).access is access


def test_an_unknown_access_is_read_only_and_told() -> None:
    description = read(parameter("<UINT/>", 'access="sometimes"'))
    assert only(description).access is Access.RO
    assert [str(one.said) for one in description.findings] == ["access=sometimes is taken as ro"]


def test_what_the_object_says_itself_comes_first() -> None:
    entry = only(read(parameter("<UINT/>", 'access="read"'), more=' accessType="rw" dataType="05"'))
    assert (entry.access, entry.data_type) == (Access.RW, StaticDataType.UNSIGNED8)


def test_an_object_without_any_access_is_read_only_and_told() -> None:
    bare = '<CANopenObject index="2000" name="Thing" objectType="7" dataType="06"/>'
    description = read("", objects=bare)
    assert only(description).access is Access.RO
    assert [str(one.said) for one in description.findings] == ["2000 has no accessType: taken as ro"]


def test_nothing_is_configured_that_may_only_be_read() -> None:
    """An XDC's value of a parameter without an access: nobody said that it may be written."""
    assert configuration(read(parameter('<UINT/><actualValue value="5"/>'))) == ()
    [download] = configuration(read(parameter('<UINT/><actualValue value="5"/>', 'access="readWrite"')))
    assert download.data == b"\x05\x00"


def test_limits_and_values_are_taken_from_the_parameter() -> None:
    range_ = '<range><minValue value="-5"/><maxValue value="5"/></range>'
    content = f'<INT/><defaultValue value="1"/><allowedValues>{range_}</allowedValues>'
    entry = only(read(parameter(content)))
    assert (entry.low, entry.high, entry.default) == (Value(-5), Value(5), Value(1))
    entry = only(read(parameter(content.replace(range_, 2 * range_))))
    assert (entry.low, entry.high) == (None, None), "two ranges are no limits"


def test_a_type_that_the_file_derives_is_the_one_it_is_made_of() -> None:
    types = (
        '<dataTypeList><derived uniqueID="D1"><dataTypeIDRef uniqueIDRef="D2"/></derived>'
        '<enum uniqueID="D2"><enumValue value="1"/><USINT/></enum></dataTypeList>'
    )
    entry = only(read(types + parameter('<dataTypeIDRef uniqueIDRef="D1"/>')))
    assert entry.data_type is StaticDataType.UNSIGNED8
    circle = '<dataTypeList><derived uniqueID="D1"><dataTypeIDRef uniqueIDRef="D1"/></derived></dataTypeList>'
    assert only(read(circle + parameter('<dataTypeIDRef uniqueIDRef="D1"/>'))).data_type is None


def test_a_parameter_says_what_its_template_says() -> None:
    template = (
        '<templateList><parameterTemplate uniqueID="T" access="readWrite"><UINT/><defaultValue value="7"/>'
        "</parameterTemplate></templateList>"
    )
    entry = only(read(template + parameter("", 'templateIDRef="T"')))
    assert (entry.access, entry.data_type, entry.default) == (Access.RW, StaticDataType.UNSIGNED16, Value(7))
    entry = only(read(template + parameter("<UDINT/>", 'templateIDRef="T" access="read"')))
    assert (entry.access, entry.data_type) == (Access.RO, StaticDataType.UNSIGNED32)
