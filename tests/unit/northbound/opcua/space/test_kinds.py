"""Shared parts of the nodes of a kind."""

from __future__ import annotations

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace

from bridge.image import DataType, Point
from bridge.northbound.opcua.space.kinds import Kinds
from bridge.northbound.opcua.space.nodes import ObjectNode, VariableNode, layout
from bridge.uaserver.address_space import is_empty
from tests.support.standard_space import standard_space

Ids = ua.AttributeIds


@pytest.fixture(scope="module")
def space() -> AddressSpace:
    return standard_space()


def variables() -> list[VariableNode]:
    words = [Point(name=f"bridge/{name}", data_type=DataType.UINT16) for name in ("a", "b")]
    number = Point(name="bridge/speed", data_type=DataType.FLOAT, unit="Hz")
    *_, bridge = layout([*words, number])
    return bridge.variables


@pytest.mark.landing
def test_nodes_of_one_kind_share_what_they_have(space: AddressSpace) -> None:
    kinds = Kinds(space)
    first, second, number = map(kinds.of, variables())
    assert first is second
    assert first is not number
    assert (first.type_id, number.type_id) == (
        ua.NodeId(ua.ObjectIds.BaseDataVariableType),
        ua.NodeId(ua.ObjectIds.AnalogUnitType),
    )
    assert kinds.name("Speed", 2, True) is kinds.name("Speed", 2, True)


def test_a_kind_has_nothing_that_is_empty(space: AddressSpace) -> None:
    found = Kinds(space).of(variables()[0])
    assert Ids.Value in found.attributes, "which each node has for itself"
    assert not any(is_empty(held) for kind, held in found.attributes.items() if kind != Ids.Value)


@pytest.mark.parametrize(("notifier", "bits"), [(True, 1), (False, 0)])
def test_where_events_come_from_can_be_subscribed_to(space: AddressSpace, notifier: bool, bits: int) -> None:
    found = Kinds(space).of(ObjectNode("x", "X", folder=False, notifier=notifier))
    assert found.attributes[Ids.EventNotifier].value.Value.Value == bits
    assert found.type_id == ua.NodeId(ua.ObjectIds.BaseObjectType)
