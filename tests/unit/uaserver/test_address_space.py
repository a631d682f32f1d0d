"""Nodes that are made when somebody looks at them."""

from __future__ import annotations

import pytest
from asyncua import ua
from asyncua.server.address_space import AttributeValue, NodeData

from bridge.uaserver.address_space import Attributes, Nodes, is_empty

Ids = ua.AttributeIds
HERE, MADE, NOWHERE = ua.NodeId("here", 1), ua.NodeId("made", 1), ua.NodeId("nowhere", 1)


def held(value: object = None, code: int = 0) -> AttributeValue:
    return AttributeValue(ua.DataValue(ua.Variant(value), ua.StatusCode(code)))


def test_good_and_null_is_empty() -> None:
    assert is_empty(held())
    assert is_empty(AttributeValue(None))
    assert not is_empty(held(0))
    assert not is_empty(held(None, ua.StatusCodes.BadNotSupported))
    computed = held()
    computed.value_callback = lambda *_: ua.DataValue()
    assert not is_empty(computed)


def test_a_node_is_found_among_those_that_are_held_and_those_that_are_made() -> None:
    made: list[ua.NodeId] = []

    def find(where: ua.NodeId) -> NodeData | None:
        if where != MADE:
            return None
        made.append(where)
        return NodeData(where)

    nodes = Nodes({HERE: NodeData(HERE)}, find)
    assert nodes[HERE].nodeid == HERE and not made
    assert nodes[MADE].nodeid == MADE
    assert nodes.get(MADE).nodeid == MADE
    assert (HERE in nodes, MADE in nodes, NOWHERE in nodes, "x" in nodes) == (True, True, False, False)
    assert (nodes.get(NOWHERE), nodes.get(NOWHERE, 7)) == (None, 7)
    with pytest.raises(KeyError):
        nodes[NOWHERE]
    assert len(nodes) == 1, "what is made is not kept"


def test_attributes_are_its_own_or_those_of_its_kind() -> None:
    common = {Ids.NodeClass: held(2), Ids.BrowseName: held("kind")}
    found = Attributes(common, {Ids.BrowseName: lambda node: held(f"of {node}")}, "fu1")
    assert found[Ids.BrowseName].value.Value.Value == "of fu1"
    assert found[Ids.NodeClass] is common[Ids.NodeClass]
    assert (list(found), len(found)) == (list(common), 2)
    assert Ids.Value not in found
    with pytest.raises(KeyError):
        found[Ids.Value]
