"""The published models behind asyncua's address space: whole, and nothing of them empty."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec
import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace
from asyncua.ua.ua_binary import variant_to_binary

from bridge.northbound.opcua.models.assets import read_models
from bridge.uaserver.address_space import is_empty, put_behind
from bridge.uaserver.hierarchy import related, subtypes, supertypes
from bridge.uaserver.library import node_id
from bridge.uaserver.nodesets import Models, NodesetStore, NoInstances, load_models
from tests.support.standard_space import standard_space

Ids = ua.ObjectIds
DI, MACHINERY, POWERTRAIN = (
    f"http://opcfoundation.org/UA/{name}/" for name in ("DI", "Machinery", "Powertrain")
)
FIRST = 3


@pytest.fixture(scope="module")
def models() -> Models:
    return read_models()


@pytest.fixture(scope="module")
def space(models: Models) -> AddressSpace:
    made = standard_space()
    indexes = range(FIRST, FIRST + len(models.namespaces))
    put_behind(made, NodesetStore(models, made, indexes, NoInstances()).find)
    return made


@pytest.fixture(scope="module")
def of(models: Models) -> Iterator[dict[str, int]]:
    yield {uri: FIRST + place for place, uri in enumerate(models.namespaces)}


def every(models: Models) -> Iterator[ua.NodeId]:
    for row in models.nodes:
        place, _, identifier = row.id.partition(";")
        value = identifier[2:]
        number = int(value) if identifier.startswith("i=") else value
        yield node_id(number, FIRST + int(place) - 1)


def test_every_reference_leads_to_a_node_and_every_attribute_says_something(
    models: Models, space: AddressSpace
) -> None:
    for where in every(models):
        node = space[where]
        assert node.nodeid == where
        for reference in node.references:
            assert reference.NodeId in space, (where, reference)
            assert reference.ReferenceTypeId in space
            assert reference.BrowseName.Name
        for attribute, held in node.attributes.items():
            assert not is_empty(held), (where, attribute)
            assert variant_to_binary(held.value.Value)


def test_types_are_found_from_the_standards_own(space: AddressSpace, of: dict[str, int]) -> None:
    below = subtypes(space, node_id(Ids.BaseObjectType))
    converter = node_id(1016, of[POWERTRAIN])
    assert converter in below
    names = [
        space[one].attributes[ua.AttributeIds.BrowseName].value.Value.Value.Name
        for one in supertypes(space, converter)
    ]
    assert names == ["PtAssetFrequencyConverterType", "PtAssetDriveType", "PtAssetType", "BaseObjectType"]
    objects = [found.BrowseName.Name for found in related(space, node_id(Ids.ObjectsFolder), Ids.Organizes)]
    assert objects[-2:] == ["DeviceSet", "Machines"]


def test_what_serves_nothing_is_left_out(models: Models) -> None:
    left_out = {"FxRoot", "NetworkSet", "DeviceTopology", "MaxInactiveLockTime", "ConnectionAdmin"}
    assert not left_out & {row.browse_name.partition(";")[2] for row in models.nodes if row.node_class == 1}


def test_an_enumeration_and_a_structure_say_what_they_are(space: AddressSpace, of: dict[str, int]) -> None:
    definition = ua.AttributeIds.DataTypeDefinition
    health = space.read_attribute_value(node_id(6244, of[DI]), definition).Value.Value
    assert [(one.Value, one.Name) for one in health.Fields][:2] == [(0, "NORMAL"), (1, "FAILURE")]
    fetch = space.read_attribute_value(node_id(6525, of[DI]), definition).Value.Value
    assert isinstance(fetch, ua.StructureDefinition)
    assert fetch.DefaultEncodingId in space
    assert [one.Name for one in fetch.Fields] == ["NodePath", "StatusCode", "Diagnostics"]


@pytest.mark.parametrize("where", [node_id(99999, 3), node_id("x", 3), node_id(1, 77), node_id(2253, 0)])
def test_what_no_model_has_is_not_made(models: Models, space: AddressSpace, where: ua.NodeId) -> None:
    bare = msgspec.structs.replace(models, outside=[])
    assert NodesetStore(bare, space, range(3, 3 + len(models.namespaces)), NoInstances()).find(where) is None


def test_a_file_of_something_else_is_refused() -> None:
    with pytest.raises(ValueError, match="namespaces"):
        load_models(b"{}")
