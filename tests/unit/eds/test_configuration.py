"""Downloads from a DCF, and the files a site names for it."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.config.download import to_concise_dcf
from bridge.eds import configuration, read_configuration, read_device
from bridge.project import load_project
from bridge.text import render

DCF = """[DeviceComissioning]
NodeID=5
[1017]
ParameterName=Heartbeat
DataType=6
AccessType=rw
DefaultValue=0
ParameterValue=100
[1018]
ParameterName=Identity
DataType=7
AccessType=ro
ParameterValue=7
[1010]
ParameterName=Store
DataType=7
AccessType=rw
ParameterValue=1
[1600]
ParameterName=Mapping
ObjectType=9
[1600sub0]
ParameterName=Count
DataType=5
AccessType=rw
DefaultValue=1
ParameterValue=2
[1600sub1]
ParameterName=First
DataType=7
AccessType=rw
ParameterValue=0x30000110
[2000]
ParameterName=Same as default
DataType=6
AccessType=rw
DefaultValue=5
ParameterValue=0x5
[2001]
ParameterName=Command
DataType=5
AccessType=wo
ParameterValue=1
[2002]
ParameterName=Not to be written
DataType=5
AccessType=rw
ObjFlags=1
ParameterValue=1
[2003]
ParameterName=Identifier
DataType=7
AccessType=rw
ParameterValue=$NODEID+0x200
"""
SITE = """
[site]
name = "dcf"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "conveyor"
id = 5
mapping = "nord/sk-tu4-cao"
configuration = "conveyor.dcf"
[[bus.node.drive]]
slot = "fu1"
"""


def shown(path: Path, node_id: int | None = None) -> list[str]:
    return [f"{one.name}={one.data.hex()}" for one in read_configuration(path, node_id)]


def test_application_objects_come_first_and_a_mappings_count_after_its_entries(tmp_path: Path) -> None:
    file = tmp_path / "a.dcf"
    file.write_text(DCF)
    assert shown(file) == [
        "2001h:00=01",
        "2003h:00=05020000",
        "1017h:00=6400",
        "1600h:01=10010030",
        "1600h:00=02",
    ]


def test_what_can_only_be_written_is_not_read_back(tmp_path: Path) -> None:
    file = tmp_path / "a.dcf"
    file.write_text(DCF)
    assert [one.read_back for one in read_configuration(file)] == [False, True, True, True, True]


def test_the_node_of_the_site_file_wins_over_that_of_the_dcf(tmp_path: Path) -> None:
    file = tmp_path / "a.dcf"
    file.write_text(DCF)
    assert "2003h:00=06020000" in shown(file, 6)


def test_a_concise_dcf_gives_the_same_back(tmp_path: Path) -> None:
    downloads = configuration(read_device(DCF.encode(), "a.dcf"))
    file = tmp_path / "a.cdcf"
    file.write_bytes(to_concise_dcf(downloads))
    assert file.read_bytes().startswith(struct.pack("<IHBI", 5, 0x2001, 0, 1))
    assert shown(file) == [f"{one.name}={one.data.hex()}" for one in downloads]


@pytest.mark.parametrize(("name", "old", "new"), [("a.dcf", "=100", "=70000"), ("a.cdcf", "[", "[")])
def test_half_a_configuration_is_none(tmp_path: Path, name: str, old: str, new: str) -> None:
    file = tmp_path / name
    file.write_text(DCF.replace(old, new))
    with pytest.raises(FileFaults):
        read_configuration(file)


@pytest.mark.parametrize(
    ("content", "english", "german"),
    [
        (
            b"\x02",
            "is too short for a concise DCF: it begins with the number of entries",
            "ist zu kurz für eine Concise DCF: sie beginnt mit der Anzahl der Einträge",
        ),
        (b"\2\0\0\0\0\x20", "ends within entry 1 of 2", "endet innerhalb von Eintrag 1 von 2"),
    ],
)
def test_what_a_concise_dcf_has_wrong_is_told_in_both_languages(
    tmp_path: Path, content: bytes, english: str, german: str
) -> None:
    file = tmp_path / "a.cdcf"
    file.write_bytes(content)
    with pytest.raises(FileFaults) as caught:
        read_configuration(file)
    [fault] = caught.value.faults
    assert [render(fault.said, language) for language in ("en", "de")] == [english, german]


def test_a_site_takes_the_configuration_file_it_names(tmp_path: Path) -> None:
    (tmp_path / "site.toml").write_text(SITE)
    (tmp_path / "conveyor.dcf").write_text(DCF)
    assert len(load_project(tmp_path / "site.toml").downloads["conveyor"]) == 5


def test_a_configuration_file_that_is_not_there_is_a_fault_of_the_site_file(tmp_path: Path) -> None:
    (tmp_path / "site.toml").write_text(SITE)
    with pytest.raises(FileFaults) as caught:
        load_project(tmp_path / "site.toml")
    [fault] = caught.value.faults
    assert (fault.line, fault.key) == (11, "bus[0].node[0].configuration")
    file = tmp_path / "conveyor.dcf"
    assert render(fault.said, "de") == f"{file}: kann nicht gelesen werden: No such file or directory"


def test_a_bad_line_of_a_configuration_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "site.toml").write_text(SITE)
    (tmp_path / "conveyor.dcf").write_text(DCF.replace("=100", "=hundred"))
    with pytest.raises(FileFaults) as caught:
        load_project(tmp_path / "site.toml")
    [fault] = caught.value.faults
    assert (Path(fault.file).name, fault.line) == ("conveyor.dcf", 8)


def of_another_node(*entries: tuple[str, str, str]) -> str:
    """A DCF of node 20h; of each entry the section, the default and the value."""
    text = "[DeviceComissioning]\nNodeID=0x20\n"
    for section, default, value in entries:
        text += f"[{section}]\nParameterName=x\nDataType=7\nAccessType=rw\n"
        text += f"DefaultValue={default}\nParameterValue={value}\n"
    return text


@pytest.mark.parametrize(
    ("section", "value"),
    [
        ("1014", "0xA0"),
        ("1200sub1", "0x620"),
        ("1201sub2", "0x5A0"),
        ("1400sub1", "0x220"),
        ("15FFsub1", "0x40000520"),
        ("1800sub1", "0x800001A0"),
    ],
)
def test_an_identifier_of_another_node_is_refused_by_name(tmp_path: Path, section: str, value: str) -> None:
    file = tmp_path / "a.dcf"
    file.write_text(of_another_node((section, "", value)))
    assert len(shown(file)) == len(shown(file, 0x20)) == 1
    with pytest.raises(FileFaults) as caught:
        read_configuration(file, 10)
    [fault] = caught.value.faults
    assert fault.line == 3
    assert f"= {int(value, 16):X}h is an identifier of node 32" in fault.message
    assert "not of node 10" in fault.message


@pytest.mark.parametrize(
    ("section", "default", "value", "downloads"),
    [
        pytest.param("1400sub1", "$NODEID+0x200", "0x220", [], id="its default there"),
        pytest.param("2001", "$NODEID", "0x20", [], id="the number itself"),
        pytest.param("1400sub1", "", "$NODEID+0x200", ["1400h:01=0a020000"], id="any node"),
        pytest.param("1400sub1", "", "0x18A", ["1400h:01=8a010000"], id="what node 10 sends"),
        pytest.param("1400sub2", "", "0x20", ["1400h:02=20000000"], id="no identifier"),
        pytest.param("2001", "", "0x220", ["2001h:00=20020000"], id="a number of the maker"),
    ],
)
def test_what_does_not_tell_the_nodes_apart_is_taken(
    tmp_path: Path, section: str, default: str, value: str, downloads: list[str]
) -> None:
    file = tmp_path / "a.dcf"
    file.write_text(of_another_node((section, default, value)))
    assert shown(file, 10) == downloads


def test_a_text_that_no_device_can_hold_is_refused_and_not_replaced(tmp_path: Path) -> None:
    file = tmp_path / "a.dcf"
    text = "[2003]\nParameterName=Label\nDataType=9\nAccessType=rw\nParameterValue={}\n"
    file.write_text(text.format("Lüfter µ"), encoding="utf-8")
    assert shown(file) == [f"2003h:00={'Lüfter µ'.encode('latin-1').hex()}"]
    file.write_text(text.format("10 kΩ"), encoding="utf-8")
    with pytest.raises(FileFaults, match="beyond ISO 8859-1"):
        read_configuration(file)
