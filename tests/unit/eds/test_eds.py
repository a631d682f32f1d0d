"""EDS and DCF as they are found in the field: what is odd is reported with its line and read all the same."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.eds import (
    Access,
    Description,
    Finding,
    FindingSeverity,
    StaticDataType,
    Value,
    read_device,
    read_device_file,
)
from bridge.eds.pdos import pdos

HEAD = """[DeviceInfo]
VendorName=Acme
VendorNumber=0x3B
ProductName=Mover
ProductNumber=7
RevisionNumber=0x00010002
BaudRate_250=1
BaudRate_500=1

[MandatoryObjects]
SupportedObjects=1
1=0x1000

[1000]
ParameterName=Device Type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x00010192
PDOMapping=0
"""


def read(text: str | bytes) -> Description:
    return read_device(text.encode() if isinstance(text, str) else text, "test.eds")


def odd(text: str) -> tuple[Description, list[Finding]]:
    """HEAD and ``text``, with what ``text`` is reported for besides not being listed."""
    description = read(HEAD + text)
    return description, [one for one in description.findings if "not listed" not in str(one.said)]


def entry(keys: str, section: str = "2000") -> str:
    return f"[{section}]\nParameterName=Speed\n{keys}\n"


def test_a_file_as_the_standard_has_it_has_no_findings() -> None:
    description = read(HEAD)
    assert description.findings == ()
    assert description.format == "EDS"
    assert description.device_info.vendor_id == 0x3B
    assert description.device_info.revision == 0x10002
    assert description.device_info.bitrates == (250_000, 500_000)
    assert description.number(0x1000) == 0x10192


@pytest.mark.parametrize("encoding", ["cp1252", "utf-8", "utf-8-sig", "utf-16"])
def test_umlauts_are_read_however_they_were_saved(encoding: str) -> None:
    description = read(HEAD.replace("Mover", "Überströmer").encode(encoding))
    assert description.device_info.product == "Überströmer"
    assert all(finding.severity is FindingSeverity.WARNING for finding in description.findings)


def test_the_line_of_the_first_foreign_character_is_named() -> None:
    [finding] = read(HEAD.replace("Mover", "Über").encode("cp1252")).findings
    assert (finding.line, "Windows-1252" in str(finding.said)) == (4, True)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_any_line_end_ends_a_line(end: str) -> None:
    assert read(HEAD.replace("\n", end)).number(0x1000) == 0x10192


def test_lower_case_keys_are_read_and_reported_once() -> None:
    description = read(HEAD.lower())
    assert description.number(0x1000) == 0x10192
    [finding] = description.findings
    assert "not spelt as CiA 306 has it" in str(finding.said)
    assert finding.line == 2


def test_a_stray_line_is_named_and_ignored() -> None:
    description, [finding] = odd("this is nothing\n")
    assert (finding.line, finding.severity) == (21, FindingSeverity.ERROR)
    assert "this is nothing" in str(finding.said)
    assert description.number(0x1000) == 0x10192


def test_comments_are_no_oddity() -> None:
    _, findings = odd("; a comment\n# another\n   ; indented\n")
    assert findings == []


def test_of_a_key_that_is_there_twice_the_first_counts() -> None:
    description, [finding] = odd(entry("DataType=6\nAccessType=rw\nDefaultValue=1\nDefaultValue=2"))
    assert description.number(0x2000) == 1
    assert (finding.line, finding.severity) == (26, FindingSeverity.ERROR)


def test_a_section_that_is_there_twice_is_joined() -> None:
    description, [finding] = odd(entry("DataType=6") + "[2000]\nAccessType=wo\n")
    found = description.entry(0x2000)
    assert found
    assert (found.data_type, found.access) == (StaticDataType.UNSIGNED16, Access.WO)
    assert "appears again, first in line 21" in str(finding.said)


@pytest.mark.parametrize(
    ("text", "number"), [("001", 1), ("0x1F", 31), ("0X1f", 31), ("010", 10), ("1Fh", 31), ("5 ; five", 5)]
)
def test_numbers_in_every_form(text: str, number: int) -> None:
    description, _ = odd(entry(f"DataType=0x7\nAccessType=rw\nDefaultValue={text}"))
    assert description.number(0x2000) == number


def test_a_number_that_c_would_read_in_octal_says_how_it_is_taken() -> None:
    _, [finding] = odd(entry("DataType=7\nAccessType=rw\nDefaultValue=010"))
    assert "taken as 10, not as octal 8" in str(finding.said)


@pytest.mark.parametrize(
    "text",
    [
        "$NODEID+0x180",
        "0x180+$NODEID",
        "$NODEID + 0x180",
        " 0x180 + $nodeid",
        "$NodeID+384",
        "NODEID+180h",
        "($NODEID+0x180)",
        "$NODEID+0x100+0x80",
    ],
)
def test_the_node_id_in_every_form(text: str) -> None:
    description, _ = odd(entry(f"DataType=7\nAccessType=rw\nDefaultValue={text}"))
    assert description.number(0x2000, node_id=5) == 0x185
    assert description.number(0x2000) is None


@pytest.mark.parametrize("text", ["$NODEID+$NODEID", "-$NODEID", "$NODEID*2", "$NODEID+", "$NODEID+x"])
def test_what_is_no_expression_is_left_out_and_named(text: str) -> None:
    description, [finding] = odd(entry(f"DataType=7\nAccessType=rw\nDefaultValue={text}"))
    assert description.number(0x2000, node_id=5) is None
    assert (finding.line, finding.severity) == (25, FindingSeverity.ERROR)


@pytest.mark.parametrize(
    ("code", "text", "value"),
    [
        (0x3, "0xFFFF", -1),
        (0x3, "-32768", -32768),
        (0x1, "true", 1),
        (0x8, "0x3F800000", 1.0),
        (0x8, "2.5", 2.5),
        (0x9, "a = b", "a = b"),
        (0xA, "0A 0b", b"\x0a\x0b"),
    ],
)
def test_values_follow_their_type(code: int, text: str, value: int | float | str | bytes) -> None:
    description, findings = odd(entry(f"DataType={code}\nAccessType=rw\nDefaultValue={text}"))
    found = description.entry(0x2000)
    assert found
    assert found.default == Value(value)
    assert findings == []


@pytest.mark.parametrize("value", ["256", "-1", "lots", "1.5"])
def test_a_value_beyond_its_type_is_left_out(value: str) -> None:
    description, [finding] = odd(entry(f"DataType=5\nAccessType=rw\nDefaultValue={value}"))
    found = description.entry(0x2000)
    assert found
    assert found.default is None
    assert finding.severity is FindingSeverity.ERROR


def test_what_is_missing_gets_its_default() -> None:
    description, findings = odd(
        "[2000]\nParameterName=List\nObjectType=8\n"
        "[2000sub0]\nParameterName=Count\nDefaultValue=2\n"
        "[2000sub1]\nParameterName=A\nDataType=6\n"
        "[2000sub2]\nParameterName=B\n"
    )
    count, first, second = description.objects[1].entries
    assert (count.data_type, count.access) == (StaticDataType.UNSIGNED8, Access.RO)
    assert (first.access, second.access) == (Access.RW, Access.RW)
    assert second.data_type is StaticDataType.UNSIGNED16
    assert {finding.severity for finding in findings} == {FindingSeverity.WARNING}
    assert len(findings) == 5


def test_a_missing_sub_0_is_made() -> None:
    description, [finding] = odd(
        "[2000]\nParameterName=List\nObjectType=8\n[2000sub3]\nParameterName=C\nDataType=6\nAccessType=rw\n"
    )
    assert description.number(0x2000, 0) == 3
    assert "no sub-index 0" in str(finding.said)


def test_compact_sub_indices_have_names_and_values_of_their_own() -> None:
    description, findings = odd(
        "[2000]\nParameterName=Ramp\nObjectType=8\nDataType=6\nAccessType=rw\nDefaultValue=7\n"
        "CompactSubObj=3\n[2000Name]\nNrOfEntries=1\n2=Slow\n[2000Value]\nNrOfEntries=1\n3=9\n"
    )
    count, one, two, three = description.objects[1].entries
    assert findings == []
    assert count.default == Value(3)
    assert (one.name, two.name) == ("Ramp1", "Slow")
    assert [entry.current for entry in (one, two, three)] == [Value(7), Value(7), Value(9)]


def test_compact_pdos_are_written_out() -> None:
    text = HEAD.replace("[MandatoryObjects]", "CompactPDO=0x13\nNrOfRXPDO=2\nNrOfTXPDO=5\n[MandatoryObjects]")
    description = read(text)
    found = list(pdos(description, 5))
    assert [pdo.name for pdo in found] == ["RPDO1", "RPDO2", "TPDO1", "TPDO2", "TPDO3", "TPDO4", "TPDO5"]
    assert [pdo.cob_id for pdo in found[:4]] == [0x205, 0x305, 0x185, 0x285]
    assert not found[-1].enabled
    assert description.entry(0x1800, 5)
    assert not description.entry(0x1800, 3)
    assert description.findings == ()


@pytest.mark.parametrize("section", ["DeviceComissioning", "DeviceCommissioning"])
def test_both_spellings_of_commissioning_are_read(section: str) -> None:
    description = read(f"{HEAD}[{section}]\nNodeID=0x05\nNodeName=lift\nBaudrate=250\n")
    assert description.format == "DCF"
    commissioning = description.commissioning
    assert (commissioning.node_id, commissioning.node_name, commissioning.bitrate) == (5, "lift", 250_000)


def test_a_type_that_the_file_itself_describes_is_looked_up() -> None:
    """CANFestival writes limited types like this."""
    description, findings = odd(entry("DataType=0xA0\nAccessType=rw") + "[A0]\n[A0sub1]\nDefaultValue=0x6\n")
    found = description.entry(0x2000)
    assert found
    assert found.data_type is StaticDataType.UNSIGNED16
    assert findings == []


def test_lists_and_objects_that_disagree_are_named() -> None:
    description = read(HEAD.replace("1=0x1000", "1=0x1001"))
    texts = [str(finding.said) for finding in description.findings]
    assert texts == ["1001h is listed and not described", "1000h is described and not listed: taken"]


@pytest.mark.parametrize(
    "content", [b"", b"\0\0\0", b"hello", b"[FileInfo]\n", b"<", b"<a/>", b"\xff\xfe<\0"]
)
def test_what_is_no_description_at_all_is_a_fault(content: bytes) -> None:
    with pytest.raises(FileFaults, match="is not a device description"):
        read(content)


def test_a_file_that_cannot_be_opened_is_a_fault(tmp_path: Path) -> None:
    with pytest.raises(FileFaults, match="cannot be read"):
        read_device_file(tmp_path / "none.eds")
    with pytest.raises(FileFaults, match="cannot be read"):
        read_device_file(tmp_path)


def test_the_report_of_a_wild_file_stays_short() -> None:
    description = read(HEAD + "nothing\n" * 10_000)
    assert len(description.findings) == 501
    assert str(description.findings[-1].said) == "and 9500 more of this kind"
