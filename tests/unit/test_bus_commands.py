"""What the commands on a bus make of their words before they open it."""

from __future__ import annotations

from pathlib import Path
from typing import cast, get_args

import pytest
import typer
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from bridge.canopen.datatypes import TypeName
from bridge.canopen.datatypes import encode as as_site_file
from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.cli.app import make_app
from bridge.cli.bus import BusChoice, choose_line, split_site
from bridge.cli.sdo import ValueType, decode, encode, parse_object, why_forced
from bridge.errands.single import NmtErrand, SdoErrand
from bridge.image import DataType
from bridge.parameter import ObjectRef

SITE = """
[site]
name = "two"
[[bus]]
name = "north"
interface = "socketcan"
channel = "can0"
[[bus.node]]
name = "conveyor"
id = 5
mapping = "nord/sk-tu4-cao"
[[bus.node.drive]]
slot = "fu1"
[[bus]]
name = "south"
interface = "socketcan"
channel = "can1"
"""


@pytest.fixture
def site(tmp_path: Path) -> Path:
    path = tmp_path / "site.toml"
    path.write_text(SITE, "utf-8")
    return path


def test_a_bus_is_named_by_its_options() -> None:
    line = choose_line(None, BusChoice(None, "socketcan", "can0", 500_000))
    assert (line.table.channel, line.table.bitrate, line.is_of_site) == ("can0", 500_000, False)


@pytest.mark.parametrize("name", ["P509", "P513", "P151", "P120", "P515", "P546", "2201:00", "6040:00"])
def test_what_supervises_a_drive_takes_force_on_the_command_line(site: Path, name: str) -> None:
    """Said before a bus is opened."""
    arguments = ["parameters", "write", str(site), "conveyor/fu1", name, "1", "--yes"]
    done = CliRunner().invoke(make_app(), arguments)
    assert done.exit_code == 2
    assert "Nothing was written. --force writes" in " ".join(done.output.replace("│", " ").split())


def test_a_site_with_two_buses_needs_the_name_of_one(site: Path) -> None:
    with pytest.raises(typer.BadParameter, match="one of north, south"):
        choose_line(site, BusChoice())
    line = choose_line(site, BusChoice("north"))
    assert line.node_id("conveyor") == 5
    assert line.node_id("0x11") == 17
    with pytest.raises(typer.BadParameter, match="conveyor"):
        line.node_id("conveior")


@pytest.mark.parametrize(
    ("bus", "interface", "channel"),
    [(None, None, None), ("can0", None, None), (None, "socketcan", None), (None, "virtual", "x")],
)
def test_half_a_bus_is_bad_usage(bus: str | None, interface: str | None, channel: str | None) -> None:
    with pytest.raises(typer.BadParameter):
        choose_line(None, BusChoice(bus, interface, channel))


def test_a_site_and_an_interface_are_two_buses(site: Path) -> None:
    with pytest.raises(typer.BadParameter, match="leave the options out"):
        choose_line(site, BusChoice("north", "socketcan", "can0"))


def test_the_site_may_stand_first() -> None:
    assert split_site(["5", "1000"], 2, "") == (None, ["5", "1000"])
    assert split_site(["a.toml", "5", "1000"], 2, "") == (Path("a.toml"), ["5", "1000"])
    with pytest.raises(typer.BadParameter):
        split_site(["5"], 2, "usage")


@pytest.mark.parametrize("text", ["1018:01", "1018:1", "0x1018:0x1", "1018h:01h"])
def test_objects_are_hexadecimal(text: str) -> None:
    assert parse_object(text) == (0x1018, 1)


@pytest.mark.parametrize("text", ["", "1018:", "10188", "1018:100", "xyz", "1018:1:1"])
def test_what_is_no_object_is_bad_usage(text: str) -> None:
    with pytest.raises(typer.BadParameter):
        parse_object(text)


@pytest.mark.parametrize(
    ("kind", "text", "data"),
    [
        ("uint16", "500", "f401"),
        ("uint32", "0x65766173", "73617665"),
        ("int8", "-1", "ff"),
        ("bool", "true", "01"),
        ("float", "1.5", "0000c03f"),
        ("string", "save", "73617665"),
        ("bytes", "73 61", "7361"),
    ],
)
def test_values_on_the_wire(kind: ValueType, text: str, data: str) -> None:
    assert encode(kind, text) == bytes.fromhex(data)


SITE_TYPES: dict[str, tuple[bool | int | float | str, str]] = {
    "bool": (True, "true"),
    "int8": (-2, "-2"),
    "int16": (-300, "-300"),
    "int32": (-70_000, "-70000"),
    "int64": (-(1 << 40), str(-(1 << 40))),
    "uint8": (200, "200"),
    "uint16": (60_000, "0xEA60"),
    "uint32": (1 << 31, str(1 << 31)),
    "uint64": (1 << 63, str(1 << 63)),
    "real32": (-1.5, "-1.5"),
    "real64": (0.1, "0.1"),
    "string": ("Förderer", "Förderer"),
    "bytes": ("0A 1B", "0A 1B"),
}


@pytest.mark.parametrize("name", [*get_args(TypeName), *DataType])
def test_the_types_of_the_site_file_and_of_points_are_those_of_sdo(name: str) -> None:
    assert name in get_args(ValueType)
    kind = cast("ValueType", name)
    value, text = SITE_TYPES[{"float": "real32"}.get(name, name)]
    data = encode(kind, text)
    if name in get_args(TypeName):
        assert data == as_site_file(name, value)
    assert decode(kind, data) == value


@pytest.mark.parametrize(
    ("kind", "text"),
    [("uint8", "256"), ("uint8", "-1"), ("bool", "2"), ("bytes", "7")],
)
def test_values_that_do_not_fit(kind: ValueType, text: str) -> None:
    with pytest.raises(ValueError, match=f"no {kind} value"):
        encode(kind, text)


def test_an_answer_that_is_too_short_is_named() -> None:
    with pytest.raises(ValueError, match="uint32 has 4 bytes, the node sent 2"):
        decode("uint32", bytes(2))


@given(st.sampled_from(["uint64", "int32", "uint16"]), st.data())
def test_what_is_written_is_read(kind: ValueType, data: st.DataObject) -> None:
    bits = int(kind.removeprefix("u").removeprefix("int"))
    low, high = (0, 2**bits - 1) if kind.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    value = data.draw(st.integers(low, high))
    assert decode(kind, encode(kind, str(value))) == value


# errands


def test_an_nmt_command_is_followed_when_the_node_says_so() -> None:
    errand = NmtErrand(NmtCommand.START, 5, 10.0, 2.0)
    errand.on_frame(Frame(0x705, b"\x05", 10.0))  # said before the command
    assert errand.take_frames() == [Frame(0, b"\x01\x05")]
    errand.on_frame(Frame(0x705, b"\x7f", 10.1))
    errand.on_frame(Frame(0x706, b"\x05", 10.1))
    assert not errand.is_finished(10.1)
    errand.on_frame(Frame(0x705, b"\x05", 10.2))
    assert errand.is_finished(10.2)
    assert (errand.states, errand.reached) == ({5: NmtState.OPERATIONAL}, {5})


def test_a_reset_is_seen_by_the_boot_up_message() -> None:
    errand = NmtErrand(NmtCommand.RESET_NODE, 5, 10.0, 2.0)
    errand.take_frames()
    errand.on_frame(Frame(0x705, b"\x7f", 10.1))
    assert not errand.is_finished(10.1)
    errand.on_frame(Frame(0x705, b"\x00", 10.2))
    assert errand.is_finished(10.2)
    assert errand.states == {5: NmtState.PRE_OPERATIONAL}


def test_a_silent_node_is_waited_for_and_then_not() -> None:
    errand = NmtErrand(NmtCommand.STOP, 0, 10.0, 2.0)
    assert errand.next_deadline() == 12.0
    assert errand.is_finished(12.0)
    assert errand.states == {}


def test_a_nodes_own_time_and_retries_are_taken_from_the_site(site: Path) -> None:
    text = site.read_text("utf-8").replace("id = 5", "id = 5\nsdo_timeout_ms = 700\nsdo_retries = 3")
    site.write_text(text, "utf-8")
    line = choose_line(site, BusChoice("north"))
    assert line.sdo_policy(5) == (0.7, 3)
    assert line.sdo_policy(6) == (0.5, 0), "a node that the site does not have"


def test_a_further_sdo_channel_has_the_cob_ids_of_the_mapping(site: Path) -> None:
    """BU 2500 §6.4: SDO3 is 440h and 3C0h + node id."""
    line = choose_line(site, BusChoice("north"))
    assert line.sdo_server(5, 1) is None
    server = line.sdo_server(5, 3)
    assert server is not None
    errand = SdoErrand(5, 0x2069, 1, None, 10.0, 0.5, server=server)
    assert [frame.can_id for frame in errand.take_frames()] == [0x445]
    errand.on_frame(Frame(0x3C5, bytes.fromhex("4B692001F4010000"), 10.1))
    assert errand.result == b"\xf4\x01"
    with pytest.raises(typer.BadParameter, match="no SDO channel 9: 1, 2, 3, 4"):
        line.sdo_server(5, 9)
    with pytest.raises(typer.BadParameter, match="give SITE"):
        choose_line(None, BusChoice(None, "socketcan", "can0")).sdo_server(5, 2)


@pytest.mark.parametrize("kind", ["int16", "uint8", "float", "double"])
@pytest.mark.parametrize("text", ["2,5", "1,500", "1_0", "\u0662", "nan", "inf", "0b1"])
def test_sdo_write_sends_no_number_that_may_be_another(kind: ValueType, text: str) -> None:
    with pytest.raises(ValueError, match=r"write 2\.5|write 1500 or 1\.5|is no number|only the digits"):
        encode(kind, text)


def test_sdo_write_takes_the_manuals_hexadecimal() -> None:
    assert encode("uint16", "047Fh") == encode("uint16", "0x47f") == bytes.fromhex("7F 04")


def test_an_sdo_errand_asks_again_as_often_as_it_was_told() -> None:
    errand = SdoErrand(5, 0x1000, 0, None, 10.0, 0.5, retries=2)
    asked, now = 0, 10.0
    while not errand.is_finished(now):
        asked += sum(frame.data[0] == 0x40 for frame in errand.take_frames())
        now = errand.next_deadline() or now
        errand.on_time(now)
    assert (asked, now) == (3, 11.5)


def test_an_sdo_errand_ends_with_its_answer() -> None:
    errand = SdoErrand(5, 0x1000, 0, None, 10.0, 0.5)
    errand.on_time(10.0)
    [request] = errand.take_frames()
    assert request == Frame(0x605, bytes.fromhex("4000100000000000"))
    errand.on_frame(Frame(0x586, bytes.fromhex("4300100001000000"), 10.1))
    assert not errand.is_finished(10.1)
    errand.on_frame(Frame(0x585, bytes.fromhex("4300100092010200"), 10.1))
    assert errand.is_finished(10.1)
    assert errand.result == bytes.fromhex("92010200")


@pytest.mark.parametrize(
    ("address", "why"),
    [
        ("1017", "belongs to the communication"),
        ("1400:02", "belongs to the communication"),
        ("20A2:02", "stands for 1400:02"),
        ("3000:01", "is process data, which the drive's controller alone commands"),
        ("2097:01", "P151 decides who commands the drive and what supervises it"),
    ],
)
def test_what_is_protected_is_written_with_force_only(site: Path, address: str, why: str) -> None:
    command = ["sdo", "write", str(site), "conveyor", address, "1", "--type", "uint16", "--yes"]
    result = CliRunner().invoke(make_app(), [*command, "--bus", "north"], env={"COLUMNS": "300"})
    assert result.exit_code == 2
    said = " ".join(result.output.replace("│", " ").split())
    assert why in said
    assert "--force" in said


def test_anything_else_is_written_without(site: Path) -> None:
    line = choose_line(site, BusChoice("north"))
    assert not why_forced(line, 5, ObjectRef(0x2066, 1))
    assert not why_forced(line, 6, ObjectRef(0x1017, 0)), "no node of the site"
