"""The axes of a node: one mapping, and for each axis its own objects of the profile."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.mapping import Family
from bridge.mapping.axes import MOST_AXES, axis_of, on_axis, on_first
from bridge.mapping.loader import read_family
from bridge.mapping.own_places import places
from bridge.parameter import Names
from bridge.parameter.write_effect import Effect

SLOT = """
[[slot]]
name = "axis{axis}"
axis = {axis}
parameters_by_sdo = true
rpdo = {{ number = {axis}, cob_id = 0x{rpdo:X}, objects = [["{control}:00"], ["{target}:00"]] }}
[slot.tpdo]
number = {axis}
cob_id = 0x{tpdo:X}
objects = [["{status}:00"], ["{actual}:00"], ["{mode}:00/8"]]
"""


def slot(axis: int, number: int | None = None) -> str:
    words = {"control": 0x6040, "target": 0x6042, "status": 0x6041, "actual": 0x6044, "mode": 0x6061}
    cob_ids = {"rpdo": 0x100 + 0x100 * axis, "tpdo": 0x80 + 0x100 * axis}
    objects = {name: f"{on_axis(index, axis):04X}" for name, index in words.items()}
    text = SLOT.format(axis=axis, **cob_ids, **objects)
    return text if number is None else text.replace(f"axis = {axis}\n", f"axis = {number}\n")


def family(folder: Path, *slots: str) -> Family:
    path = folder / "axes.toml"
    own = '[[parameter]]\nname = "2010"\ntitle = "gain"\ndata_type = "uint16"\n'
    path.write_text(f'extends = "cia402/velocity"\nwithout = ["slot:drive"]\n{own}{"".join(slots)}')
    return read_family(path)


@pytest.mark.parametrize("axis", range(1, MOST_AXES + 1))
def test_an_axis_has_the_objects_of_its_logical_device(axis: int) -> None:
    for index in (0x6000, 0x6040, 0x67FF):
        assert on_axis(index, axis) == index + 0x800 * (axis - 1)
        assert on_first(on_axis(index, axis)) == index
        assert axis_of(on_axis(index, axis)) == axis
    for index in (0x1000, 0x2010, 0x5FFF, 0x6800, 0xA000):
        assert on_axis(index, axis) == index, "the node's, whatever the axis"


def test_a_parameter_has_the_same_name_in_each_axis_and_its_own_object(tmp_path: Path) -> None:
    axes = family(tmp_path, slot(1), slot(2), slot(3))
    names = [Names(axes.of_slot(one)) for one in axes.slot]
    found = {
        name: [str(one.resolve(name).address).upper() for one in names]
        for name in ("6083", "6083:00", "6046:01", "2010")
    }
    assert found == {
        "6083": ["6083:00", "6883:00", "7083:00"],
        "6083:00": ["6083:00", "6883:00", "7083:00"],
        "6046:01": ["6046:01", "6846:01", "7046:01"],
        "2010": ["2010:00"] * 3,
    }
    assert [entry.leaf for entry in names[0].points()] == [entry.leaf for entry in names[2].points()]
    assert names[1].resolve("6883:00").name == "6083", "by its object it is found as well"


def test_an_axis_of_an_axis_is_that_axis(tmp_path: Path) -> None:
    axes = family(tmp_path, slot(1), slot(2))
    second = axes.of_axis(2)
    assert second.object_of(second.parameter_named("6083")).index == 0x6883
    assert second.of_axis(1).object_of(second.parameter_named("6083")).index == 0x6083
    assert second.of_axis(2) is second


def test_what_a_word_means_is_asked_of_its_own_axis(tmp_path: Path) -> None:
    axes = family(tmp_path, slot(1), slot(2))
    (meaning,) = [one for one in axes.meaning if one.word == "status_word"]
    assert [axes.of_slot(one).object_of_meaning(meaning, 1).index for one in axes.slot] == [0x6061, 0x6861]
    assert [axes.of_slot(one).told_by(one, meaning) for one in axes.slot] == ["value_2", "value_2"]


def test_each_axis_has_its_own_reaction_and_the_node_one_heartbeat_consumer(tmp_path: Path) -> None:
    axes = family(tmp_path, slot(1), slot(2))
    found = [
        {(f"{one.ref.index:04X}", one.per_drive) for one in places(axes.of_slot(slot))} for slot in axes.slot
    ]
    common = {("1016", False), ("100C", False), ("100D", False)}
    assert found == [common | {("6007", True)}, common | {("6807", True)}]


def test_the_one_axis_of_a_drive_is_as_it_was(tmp_path: Path) -> None:
    (drive,) = [family(tmp_path, slot(1))]
    assert {(one.ref.index, one.per_drive) for one in places(drive) if one.ref.index == 0x6007} == {
        (0x6007, False)
    }


@pytest.mark.parametrize(
    ("index", "effect"),
    [
        (0x6040, Effect.COMMANDS),
        (0x6042, Effect.COMMANDS),
        (0x60FF, Effect.COMMANDS),
        (0x6007, Effect.SUPERVISES),
        (0x605A, Effect.MAKES_SAFE),
    ],
)
def test_every_way_to_an_object_knows_what_it_does(tmp_path: Path, index: int, effect: Effect) -> None:
    """The object is named by its own axis and, as a gateway has it, by another."""
    axes = family(tmp_path, slot(1), slot(2))
    names = [Names(axes.of_slot(one)) for one in axes.slot]
    for axis in (1, 2):
        address = names[0].resolve(f"{on_axis(index, axis):04X}:00").address
        assert [one.protection.effect(address) for one in names] == [effect, effect], address


def test_an_axis_cannot_be_two_drives(tmp_path: Path) -> None:
    with pytest.raises(FileFaults, match="axis '2' is there twice"):
        family(tmp_path, slot(1), slot(2), slot(3, number=2))


@pytest.mark.parametrize("number", [0, 9])
def test_there_are_eight_axes(tmp_path: Path, number: int) -> None:
    with pytest.raises(FileFaults, match="axis"):
        family(tmp_path, slot(1), slot(2, number=number))


def test_the_largest_index_of_eight_axes_is_that_of_the_profiles() -> None:
    assert on_axis(0x67FF, MOST_AXES) == 0x9FFF
