"""The OPC UA layout: a list of points in, a tree of nodes out; no server."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from bridge.command import Action
from bridge.image import Point
from bridge.image.point import DataType
from bridge.northbound.opcua.space.nodes import (
    GROUPS,
    ObjectNode,
    VariableKind,
    VariableNode,
    enum_strings,
    layout,
    pascal_case,
)
from tests.support.opcua_site import make_plant


@pytest.fixture(scope="module")
def points() -> tuple[Point, ...]:
    return make_plant().image.points


@pytest.fixture(scope="module")
def trees(points: tuple[Point, ...]) -> tuple[ObjectNode, ...]:
    return layout(points)


def objects(node: ObjectNode) -> Iterator[ObjectNode]:
    yield node
    for child in node.objects:
        yield from objects(child)


def variables(trees: tuple[ObjectNode, ...]) -> list[VariableNode]:
    found = [variable for tree in trees for node in objects(tree) for variable in node.variables]
    return found + [bit for variable in found for bit in variable.bits]


def ids(trees: tuple[ObjectNode, ...]) -> list[str]:
    found = [node.id for tree in trees for node in objects(tree)]
    found += [method.id for tree in trees for node in objects(tree) for method in node.methods]
    return found + [variable.id for variable in variables(trees)]


def find(trees: tuple[ObjectNode, ...], name: str) -> ObjectNode:
    return next(node for tree in trees for node in objects(tree) if node.id == name)


def test_every_point_has_its_node_and_no_id_is_there_twice(
    points: tuple[Point, ...], trees: tuple[ObjectNode, ...]
) -> None:
    whole = [variable for variable in variables(trees) if variable.bit is None]
    assert sorted(variable.id for variable in whole) == sorted(point.name for point in points)
    assert all(points[variable.index] is variable.point for variable in whole)
    assert len(ids(trees)) == len(set(ids(trees)))


def test_a_drive_has_all_its_folders(trees: tuple[ObjectNode, ...]) -> None:
    drive = find(trees, "conveyor/fu1")
    assert [folder.id for folder in drive.objects] == [f"conveyor/fu1/{group}" for group in GROUPS]
    assert drive.objects[0].browse_name == "Command"
    parameters = [variable.id for variable in find(trees, "conveyor/fu1/parameter").variables]
    assert "conveyor/fu1/parameter/p102" in parameters


def test_site_names_stay_as_they_are_written_and_others_are_pascal_case(
    trees: tuple[ObjectNode, ...],
) -> None:
    assert find(trees, "conveyor").browse_name == "conveyor"
    assert find(trees, "bus/can0").browse_name == "can0"
    assert find(trees, "conveyor/node").browse_name == "Node"
    assert pascal_case("worst_case_stop_ms") == "WorstCaseStopMs"
    assert pascal_case("setpoint_1") == "Setpoint1"


def test_drives_and_nodes_have_their_methods(trees: tuple[ObjectNode, ...]) -> None:
    assert [method.browse_name for method in find(trees, "conveyor/fu1").methods] == [
        "Start",
        "Stop",
        "QuickStop",
        "DisableVoltage",
        "ResetFault",
        "TakeControl",
        "ReleaseControl",
        "KeepAlive",
        "ReadParameter",
        "WriteParameter",
        "WriteParameterIf",
        "SaveParameters",
    ]
    node = find(trees, "conveyor").methods
    assert [(method.action, method.target) for method in node] == [
        (Action.RESET, "conveyor"),
        (Action.RESET_COMMUNICATION, "conveyor"),
        (Action.START_NODE, "conveyor"),
        (Action.STOP_NODE, "conveyor"),
        (Action.ENTER_PRE_OPERATIONAL, "conveyor"),
        (Action.ENABLE, "conveyor"),
        (Action.DISABLE, "conveyor"),
    ]
    bus = find(trees, "bus/can0").methods
    assert [(method.action, method.target, method.id) for method in bus] == [
        (Action.RESET, "bus/can0", "bus/can0/Reset"),
        (Action.RESET_COMMUNICATION, "bus/can0", "bus/can0/ResetCommunication"),
        (Action.START_NODE, "bus/can0", "bus/can0/StartNode"),
        (Action.STOP_NODE, "bus/can0", "bus/can0/StopNode"),
        (Action.ENTER_PRE_OPERATIONAL, "bus/can0", "bus/can0/EnterPreOperational"),
    ]


def test_kinds_follow_from_the_points(trees: tuple[ObjectNode, ...]) -> None:
    kinds = {variable.id: variable.kind for variable in variables(trees)}
    assert kinds["conveyor/fu1/actual/frequency"] is VariableKind.ANALOG
    assert kinds["conveyor/fu1/status/state"] is VariableKind.MULTI_STATE
    assert kinds["conveyor/fu1/status/status_word"] is VariableKind.PLAIN
    assert kinds["conveyor/fu1/status/status_word/fault"] is VariableKind.TWO_STATE


def test_bits_without_a_meaning_are_left_out_and_those_of_a_command_are_writable(
    trees: tuple[ObjectNode, ...],
) -> None:
    word = next(v for v in variables(trees) if v.id == "conveyor/fu1/command/control_word")
    assert word.writable
    assert 13 not in [bit.bit for bit in word.bits]
    assert all(bit.writable for bit in word.bits)
    status = next(v for v in variables(trees) if v.id == "conveyor/fu1/status/status_word")
    assert not any(bit.writable for bit in status.bits)


def test_only_command_points_parameters_and_the_time_out_are_writable(trees: tuple[ObjectNode, ...]) -> None:
    writable = {v.id for v in variables(trees) if v.writable}
    assert {id for id in writable if id.split("/")[2] not in ("command", "parameter")} == {
        "conveyor/fu3/supervision/fieldbus_timeout_ms"
    }
    readings = [v for v in variables(trees) if v.id == "conveyor/fu1/parameter/p700_1"]
    assert [v.writable for v in readings] == [False]


@pytest.mark.parametrize(
    "name", ["alone", "bus/can0", "bridge", "conveyor/fu1", "conveyor/fu1/other/x", "conveyor/node"]
)
def test_a_point_without_a_place_is_an_error(name: str) -> None:
    with pytest.raises(ValueError, match="no place"):
        layout([Point(name=name, data_type=DataType.UINT8)])


def test_two_bits_of_one_name_are_an_error() -> None:
    word = Point(name="bridge/word", data_type=DataType.UINT16, bits=("a", "b", "a"))
    with pytest.raises(ValueError, match="two bits"):
        layout([word])


@pytest.mark.parametrize(
    ("more", "kind"),
    [
        ({}, VariableKind.MULTI_STATE),
        ({"high": 10}, VariableKind.MULTI_STATE),
        ({"low": 0, "high": 10}, VariableKind.MULTI_STATE_VALUE),
    ],
)
def test_codes_that_may_have_no_text_make_no_list(more: dict[str, float], kind: VariableKind) -> None:
    point = Point(name="bridge/source", data_type=DataType.INT16, states=((3, "system bus"),), **more)
    (made,) = variables(layout([point]))
    assert made.kind is kind


def test_sparse_codes_stand_at_their_index() -> None:
    strings = enum_strings([(0, "ok"), (2, "bad"), (255, "unknown")])
    assert (len(strings), strings[0], strings[1], strings[2], strings[255]) == (
        256,
        "ok",
        "",
        "bad",
        "unknown",
    )


def test_each_drive_has_its_black_boxes(points: tuple[Point, ...]) -> None:
    trees = layout(points, black_boxes=2)
    folder = find(trees, "conveyor/fu1/BlackBox")
    assert [(file.id, file.browse_name) for file in folder.files] == [
        ("conveyor/fu1/BlackBox/1", "1"),
        ("conveyor/fu1/BlackBox/2", "2"),
    ]
    assert [one.id for one in folder.files[0].properties][:2] == [
        "conveyor/fu1/BlackBox/1/Size",
        "conveyor/fu1/BlackBox/1/Writable",
    ]
    drives = [name for name in ids(trees) if name.endswith("/BlackBox")]
    assert len(drives) == 4
    assert not any("BlackBox" in name for name in ids(layout(points)))


def test_points_whose_past_is_kept_are_marked(points: tuple[Point, ...]) -> None:
    found = variables(layout(points, [3, 5]))
    assert sorted(variable.index for variable in found if variable.kept) == [3, 5]
