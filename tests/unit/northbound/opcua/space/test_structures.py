"""Properties of variables; no server."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from bridge.image import Point
from bridge.northbound.opcua.space.nodes import (
    ObjectNode,
    VariableNode,
    layout,
)
from bridge.northbound.opcua.space.structures import property_nodes
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


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("bus/can0/load", 0.0, 100.0),
        # P105 = 50 Hz is 4000h; the words are two's complements
        ("conveyor/fu1/command/frequency", -100.0, 50 * 0x7FFF / 0x4000),
    ],
)
def test_values_with_ends_have_their_range(
    trees: tuple[ObjectNode, ...], name: str, low: float, high: float
) -> None:
    (variable,) = [variable for variable in variables(trees) if variable.id == name]
    (limits,) = [one.content.value.Value for one in property_nodes(variable) if one.browse_name == "EURange"]
    assert (limits.Low, limits.High) == (low, high)
