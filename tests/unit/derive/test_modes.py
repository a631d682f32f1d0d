"""Modes of CiA 402 that a mapping can drive a device in, by its description."""

from __future__ import annotations

import pytest

from bridge.derive.modes import MODES, bits_of, modes_of
from bridge.eds import Description, read_device
from tests.support.invented_eds import I16, I32, U8, U16, U32, eds, mapped, var

WORDS = {"6040": mapped("control", U16), "6041": mapped("status", U16, "ro")}
VELOCITY = {"6042": mapped("target", I16), "6044": mapped("actual", I16, "ro")}
PROFILE = {"60FF": mapped("target", I32), "606C": mapped("actual", I32, "ro")}
POSITION = {"607A": mapped("target", I32), "6064": mapped("actual", I32, "ro")}


def names(
    *groups: dict[str, dict[str, str]], supported: int = 0, device_type: int = 0x0002_0192
) -> list[str]:
    objects = {**WORDS, **{name: one for group in groups for name, one in group.items()}}
    objects["1000"] = var("device type", U32, "ro", hex(device_type))
    if supported:
        objects["6502"] = var("supported", U32, "ro", hex(supported))
    return [mode.name for mode in modes_of(read_device(eds(objects), "x.eds"))]


@pytest.mark.parametrize(
    ("name", "number", "setpoint", "actual"),
    [
        ("profile-position", 1, 0x607A, 0x6064),
        ("velocity", 2, 0x6042, 0x6044),
        ("profile-velocity", 3, 0x60FF, 0x606C),
        ("homing", 6, None, 0x6064),
        ("cyclic-position", 8, 0x607A, 0x6064),
        ("cyclic-velocity", 9, 0x60FF, 0x606C),
    ],
)
def test_the_numbers_of_the_standard(name: str, number: int, setpoint: int | None, actual: int) -> None:
    """IEC 61800-7-201, object 6060h."""
    (mode,) = (one for one in MODES if one.name == name)
    assert (mode.number, mode.setpoint, mode.actual) == (number, setpoint, actual)
    assert mode.mapping == f"cia402/{name}"
    assert mode.commanded[0] == (0x6040, 16)
    assert mode.told[0] == (0x6041, 16)
    assert len(mode.commanded) == (1 if setpoint is None else 2)


def test_a_mode_needs_its_objects() -> None:
    assert names() == []
    assert names(VELOCITY) == ["velocity"]
    assert names({"6042": mapped("target", I16)}) == []
    assert names({**VELOCITY, "6042": mapped("target", I32)}) == [], "in their lengths"


def test_what_the_device_says_that_it_supports_counts() -> None:
    """6502h: bit n - 1 is mode n."""
    assert names(VELOCITY, PROFILE, supported=1 << 1) == ["velocity"]
    assert names(VELOCITY, PROFILE, supported=1 << 2) == ["profile-velocity"]


def test_where_it_does_not_say_cyclic_modes_and_homing_come_last() -> None:
    found = names(PROFILE, POSITION)
    assert set(found[-3:]) == {"cyclic-velocity", "cyclic-position", "homing"}
    assert found[0] == "profile-velocity"


def test_a_frequency_converter_is_driven_in_velocity_mode() -> None:
    assert names(VELOCITY, PROFILE, device_type=0x0001_0192)[0] == "velocity"
    assert names(VELOCITY, PROFILE)[0] == "profile-velocity"


def test_the_length_of_an_object() -> None:
    objects = {"2000": var("a", U8), "2001": var("b", "0x9"), "2002": var("c", "0x10")}
    description: Description = read_device(eds(objects), "x.eds")
    assert [bits_of(description, index) for index in (0x2000, 0x2001, 0x2002, 0x2003)] == [
        8,
        None,
        None,
        None,
    ]
