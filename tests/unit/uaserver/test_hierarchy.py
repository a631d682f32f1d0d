"""Types and their subtypes, on the standard's own address space."""

from __future__ import annotations

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace

from bridge.uaserver.hierarchy import EventTypes, reference_to, related, subtypes, supertypes

Ids = ua.ObjectIds


def node(number: int) -> ua.NodeId:
    return ua.NodeId(number)


def test_a_reference_describes_its_target(space: AddressSpace) -> None:
    found = reference_to(space, node(Ids.Server), node(Ids.HasComponent), forward=False)
    assert (found.ReferenceTypeId, found.NodeId) == (node(Ids.HasComponent), node(Ids.Server))
    assert (found.BrowseName.Name, found.IsForward) == ("Server", False)
    assert found.TypeDefinition == node(Ids.ServerType)


@pytest.mark.landing
def test_a_type_is_its_own_subtype_and_supertype(space: AddressSpace) -> None:
    audit = node(Ids.AuditEventType)
    assert supertypes(space, audit) == [audit, node(Ids.BaseEventType), node(Ids.BaseObjectType)]
    below = subtypes(space, audit)
    assert {audit, node(Ids.AuditWriteUpdateEventType)} <= below
    assert node(Ids.BaseEventType) not in below


def test_what_is_nowhere_has_no_relations(space: AddressSpace) -> None:
    nowhere = ua.NodeId("nowhere", 7)
    assert list(related(space, nowhere, Ids.HasSubtype)) == []
    assert (subtypes(space, nowhere), supertypes(space, nowhere)) == ({nowhere}, [nowhere])


@pytest.mark.parametrize(
    ("kind", "wanted", "is_of"),
    [
        (node(Ids.AuditEventType), node(Ids.BaseEventType), True),
        (node(Ids.BaseEventType), node(Ids.AuditEventType), False),
        (node(Ids.FolderType), node(Ids.BaseEventType), False),
        ("AuditEventType", node(Ids.BaseEventType), False),
        ([1], node(Ids.BaseEventType), False),
    ],
)
def test_an_event_is_of_its_type_and_of_those_above(
    types: EventTypes, kind: object, wanted: ua.NodeId, is_of: bool
) -> None:
    assert types.is_of(kind, wanted) is is_of


def test_only_event_types_are_among_them(types: EventTypes) -> None:
    assert node(Ids.AuditEventType) in types
    for other in (node(Ids.FolderType), "x", [1], None):
        assert other not in types
