"""``drivebridge sdo``: objects and values as they are typed, and what takes ``--force``."""

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
from bridge.cli.app import make_app
from bridge.cli.bus_runner import BusChoice, choose_bus
from bridge.cli.sdo_command import ValueType, decode, encode, parse_object, why_forced
from bridge.image import DataType
from bridge.parameter import ObjectRef


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


@pytest.mark.parametrize("kind", ["int16", "uint8", "float", "double"])
@pytest.mark.parametrize("text", ["2,5", "1,500", "1_0", "\u0662", "nan", "inf", "0b1"])
def test_sdo_write_sends_no_number_that_may_be_another(kind: ValueType, text: str) -> None:
    with pytest.raises(ValueError, match=r"write 2\.5|write 1500 or 1\.5|is no number|only the digits"):
        encode(kind, text)


def test_sdo_write_takes_the_manuals_hexadecimal() -> None:
    assert encode("uint16", "047Fh") == encode("uint16", "0x47f") == bytes.fromhex("7F 04")


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
    line = choose_bus(site, BusChoice("north"))
    assert not why_forced(line, 5, ObjectRef(0x2066, 1))
    assert not why_forced(line, 6, ObjectRef(0x1017, 0)), "no node of the site"
