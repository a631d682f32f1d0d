"""Every attribute of every node, as clients read it: nothing is Good and null, and each drive stands once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import pytest
from asyncua import Client, ua
from asyncua.server.address_space import AddressSpace

from bridge.northbound.opcua.server import OpcUaServer, built_at
from bridge.uaserver.hierarchy import subtypes
from bridge.uaserver.selfdescription import NOT_DONE, VALUES
from tests.support.opcua_raw import sessions
from tests.support.opcua_site import LocalView, namespace

pytestmark = pytest.mark.asyncio(loop_scope="module")
Served = tuple[OpcUaServer, LocalView]
Ids, Attribute, Codes = ua.ObjectIds, ua.AttributeIds, ua.StatusCodes
NEITHER = ua.TimestampsToReturn.Neither


def walked(space: AddressSpace) -> list[ua.NodeId]:
    """Every node to which some reference leads from the root, also those that are made when they are seen."""
    found, waiting = {ua.NodeId(Ids.RootFolder)}, [ua.NodeId(Ids.RootFolder)]
    while waiting:
        node = space.get(waiting.pop())
        for reference in node.references if node else ():
            if reference.NodeId not in found and space.get(reference.NodeId):
                found.add(reference.NodeId)
                waiting.append(reference.NodeId)
    return sorted(found)


@pytest.mark.landing
async def test_no_attribute_of_any_node_is_good_and_null(served: Served, client: Client) -> None:
    (session,) = sessions(served[0])
    nodes = walked(session.aspace)
    assert len(nodes) > 5000
    assert len(Attribute) == 27
    empty: list[str] = []
    for where in nodes:
        for attribute in Attribute:
            wanted = ua.ReadValueId(NodeId=where, AttributeId=attribute)
            # What every Read is answered, without its way over the wire.
            value = session._read(wanted, NEITHER)  # pyright: ignore[reportPrivateUsage]
            is_good = value.StatusCode is None or not value.StatusCode.is_bad()
            if is_good and (value.Value is None or value.Value.Value is None):
                empty.append(f"{where} {attribute.name}")
    assert not empty, (len(empty), empty[:20])


OF_ALL = (Attribute.NodeId, Attribute.NodeClass, Attribute.BrowseName, Attribute.DisplayName)
OF_CLASS = {
    ua.NodeClass.Object: (Attribute.EventNotifier,),
    ua.NodeClass.Variable: (
        *(Attribute.Value, Attribute.DataType, Attribute.ValueRank, Attribute.AccessLevel),
        *(Attribute.UserAccessLevel, Attribute.Historizing),
    ),
    ua.NodeClass.Method: (Attribute.Executable, Attribute.UserExecutable),
    ua.NodeClass.ObjectType: (Attribute.IsAbstract,),
    ua.NodeClass.VariableType: (Attribute.DataType, Attribute.ValueRank, Attribute.IsAbstract),
    ua.NodeClass.ReferenceType: (Attribute.IsAbstract, Attribute.Symmetric),
    ua.NodeClass.DataType: (Attribute.IsAbstract,),
}
"""Mandatory attributes of each NodeClass (OPC 10000-3 §5)."""


@pytest.mark.landing
async def test_each_node_has_the_mandatory_attributes_of_its_class(served: Served, client: Client) -> None:
    (session,) = sessions(served[0])
    missing: list[str] = []
    seen: set[ua.NodeClass] = set()
    for where in walked(session.aspace):

        def read(attribute: Attribute, where: ua.NodeId = where) -> ua.DataValue:
            wanted = ua.ReadValueId(NodeId=where, AttributeId=attribute)
            return session._read(wanted, NEITHER)  # pyright: ignore[reportPrivateUsage]

        def is_missing(attribute: Attribute) -> bool:
            code = read(attribute).StatusCode
            return code is not None and code.value == Codes.BadAttributeIdInvalid

        node_class = ua.NodeClass(read(Attribute.NodeClass).Value.Value)
        seen.add(node_class)
        missing += [
            f"{where} {attribute.name}"
            for attribute in (*OF_ALL, *OF_CLASS[node_class])
            if is_missing(attribute)
        ]
    assert not missing, (len(missing), missing[:20])
    assert seen == set(OF_CLASS)


@pytest.mark.landing
async def test_each_type_that_is_used_is_there_below_its_root(served: Served, client: Client) -> None:
    (session,) = sessions(served[0])
    space = session.aspace
    roots = (Ids.BaseObjectType, Ids.BaseVariableType, Ids.BaseDataType, Ids.References)
    objects, variables, data, references = (subtypes(space, ua.NodeId(root)) for root in roots)
    missing: set[str] = set()
    for where in walked(space):
        node = space[where]
        for reference in node.references:
            if reference.ReferenceTypeId not in references:
                missing.add(f"{where} has the reference {reference.ReferenceTypeId}")
            is_type = reference.IsForward and reference.ReferenceTypeId == ua.NodeId(Ids.HasTypeDefinition)
            if is_type and reference.NodeId not in objects | variables:
                missing.add(f"{where} is a {reference.NodeId}")
        kind = node.attributes.get(Attribute.DataType)
        if kind and kind.value and kind.value.Value and kind.value.Value.Value not in data:
            missing.add(f"{where} holds {kind.value.Value.Value}")
    assert not missing, (len(missing), sorted(missing)[:20])


async def test_what_the_server_says_of_itself_is_read(served: Served, client: Client) -> None:
    for name, value in VALUES.items():
        assert await client.get_node(ua.NodeId(getattr(Ids, name))).read_value() == value.Value, name
    for name in (*NOT_DONE, "Server_ServerRedundancy_CurrentServerId"):
        with pytest.raises(ua.uaerrors.BadNotSupported):
            await client.get_node(ua.NodeId(getattr(Ids, name))).read_value()
    for kind in (Ids.ServerState, Ids.Range, Ids.EUInformation):
        with pytest.raises(ua.uaerrors.BadAttributeIdInvalid):
            await client.get_node(ua.NodeId(kind)).read_attribute(Attribute.DataTypeDefinition)
    build_date = await client.get_node(ua.NodeId(Ids.Server_ServerStatus_BuildInfo_BuildDate)).read_value()
    start = await client.get_node(ua.NodeId(Ids.Server_ServerStatus_StartTime)).read_value()
    assert abs((build_date - built_at()).total_seconds()) < 1
    assert build_date < start


async def test_nothing_stands_twice_below_its_node_for_who_follows_hierarchical_references(
    served: Served, client: Client
) -> None:
    (session,) = sessions(served[0])
    space, own = session.aspace, await namespace(client)
    hierarchical = subtypes(space, ua.NodeId(Ids.HierarchicalReferences))

    def below(where: ua.NodeId) -> Iterator[ua.NodeId]:
        node = space.get(where)
        for reference in node.references if node else ():
            if reference.IsForward and reference.ReferenceTypeId in hierarchical:
                yield reference.NodeId

    looked_at = 0
    for where in [node for node in walked(space) if node.NamespaceIndex == own] + [
        ua.NodeId(Ids.ObjectsFolder)
    ]:
        twice = [str(one) for one, count in Counter(below(where)).items() if count > 1]
        assert not twice, (where, twice)
        looked_at += 1
    assert looked_at > 100
    node = await client.nodes.objects.get_child([f"{own}:Drives", f"{own}:conveyor", f"{own}:fu1"])
    assert node.nodeid == ua.NodeId("conveyor/fu1", own)


async def test_a_drive_is_found_once_by_its_path(client: Client) -> None:
    """With any hierarchical reference, as many clients ask: one that is found twice is ambiguous."""
    own = await namespace(client)
    path = ua.RelativePath(
        [
            ua.RelativePathElement(
                ua.NodeId(Ids.HierarchicalReferences), False, True, ua.QualifiedName(name, own)
            )
            for name in ("Drives", "conveyor", "fu1")
        ]
    )
    (result,) = await client.uaclient.translate_browsepaths_to_nodeids(
        [ua.BrowsePath(ua.NodeId(Ids.ObjectsFolder), path)]
    )
    assert [target.TargetId for target in result.Targets] == [ua.NodeId("conveyor/fu1", own)]


@pytest.mark.landing
async def test_every_variable_is_read_and_written_whole(served: Served, client: Client) -> None:
    """Part 3 §8.58: neither NonatomicRead nor NonatomicWrite, but WriteFullArrayOnly."""
    (session,) = sessions(served[0])
    seen: list[tuple[int, int]] = []
    for where in walked(session.aspace):
        both = (
            session._read(ua.ReadValueId(NodeId=where, AttributeId=attribute), NEITHER)  # pyright: ignore
            for attribute in (Attribute.AccessLevel, Attribute.AccessLevelEx)
        )
        access, extended = both
        if access.StatusCode.is_good():
            seen.append((access.Value.Value, extended.Value.Value))
            assert extended.Value.VariantType is ua.VariantType.UInt32
    assert len(seen) > 3000
    assert [one for one in seen if one[1] != one[0] | 1 << 10] == []
