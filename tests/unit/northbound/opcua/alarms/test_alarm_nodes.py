"""Nodes of the alarms: as clients find them, each with all that its type asks for."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace

from bridge.northbound.opcua.server import OpcUaServer
from tests.support.opcua_site import OPEN, LocalView, make_plant

Ids = ua.ObjectIds
SPACE = 2
HIERARCHY = (Ids.HasComponent, Ids.HasProperty)
READ = ua.AttributeIds


@pytest.fixture(scope="module")
def space(tmp_path_factory: pytest.TempPathFactory) -> AddressSpace:
    async def served(folder: Path) -> AddressSpace:
        server = OpcUaServer(LocalView(make_plant()), OPEN, folder, "hall")
        await server.start()
        held: Any = server._server
        await server.close()
        return held.iserver.aspace

    return asyncio.run(served(tmp_path_factory.mktemp("state")))


def node(name: str) -> ua.NodeId:
    return ua.NodeId(name, SPACE)


def below(space: AddressSpace, where: ua.NodeId) -> Iterator[tuple[str, ua.NodeId]]:
    """Names and ids of all that is below a node, and not of the standard's own."""
    for one in space[where].references:
        ours = one.NodeId.NamespaceIndex == SPACE
        if one.IsForward and ours and one.ReferenceTypeId in [ua.NodeId(kind) for kind in HIERARCHY]:
            yield one.BrowseName.Name, one.NodeId
            for name, found in below(space, one.NodeId):
                yield f"{one.BrowseName.Name}/{name}", found


ALARMS = ("conveyor/fu1/Alarm", "conveyor/Alarm", "bus/can0/Alarm", "bridge/Alarm", "bridge/CertificateAlarm")


@pytest.mark.parametrize("alarm", ALARMS)
def test_an_alarm_has_all_that_is_mandatory_in_its_type(space: AddressSpace, alarm: str) -> None:
    has = dict(below(space, node(alarm)))
    (kind,) = (
        one.NodeId
        for one in space[node(alarm)].references
        if one.ReferenceTypeId.Identifier == Ids.HasTypeDefinition
    )
    while kind != ua.NodeId(Ids.BaseObjectType):
        for one in space[kind].references:
            if one.IsForward and one.ReferenceTypeId.Identifier in HIERARCHY:
                declared = space[one.NodeId].references
                rules = [rule.NodeId for rule in declared]
                if ua.NodeId(Ids.ModellingRule_Mandatory) in rules and one.NodeClass == ua.NodeClass.Variable:
                    assert one.BrowseName.Name in has, f"{kind}: {one.BrowseName.Name}"
        (kind,) = (
            one.NodeId
            for one in space[kind].references
            if not one.IsForward and one.ReferenceTypeId.Identifier == Ids.HasSubtype
        )


@pytest.mark.parametrize("alarm", ALARMS)
def test_what_is_found_is_there_and_leads_back(space: AddressSpace, alarm: str) -> None:
    found = list(below(space, node(alarm)))
    assert len(found) >= 47
    for name, where in found:
        assert where.Identifier == f"{alarm}/{name}"
        held = space[where]
        up = [one for one in held.references if not one.IsForward]
        (above,) = up
        assert above.NodeId.Identifier == str(where.Identifier).rpartition("/")[0]
        forward = [one for one in space[above.NodeId].references if one.IsForward and one.NodeId == where]
        assert [one.ReferenceTypeId for one in forward] == [above.ReferenceTypeId]
        for attribute in held.attributes:
            value = space.read_attribute_value(where, attribute)
            assert value.StatusCode is not None, (name, attribute)


def test_each_variable_has_a_value_of_its_data_type(space: AddressSpace) -> None:
    """Or BadNoData: a time at which nothing has happened yet."""
    kinds = {Ids.UtcTime: ua.VariantType.DateTime, Ids.Duration: ua.VariantType.Double}
    for _, where in below(space, node("conveyor/fu1/Alarm")):
        if READ.DataType not in space[where].attributes:
            continue
        value = space.read_attribute_value(where, READ.Value)
        wanted = space.read_attribute_value(where, READ.DataType).Value
        assert wanted is not None
        if value.Value is None or value.Value.Value is None:
            assert value.StatusCode is not None
            assert value.StatusCode.name == "BadNoData"
            continue
        number = wanted.Value.Identifier
        assert value.Value.VariantType is kinds.get(number, ua.VariantType(number) if number < 26 else None)


@pytest.mark.parametrize(
    "name",
    [
        "conveyor/fu9/Alarm",
        "conveyor/fu1/Alarm/",
        "conveyor/fu1/Alarm/Nothing",
        "conveyor/fu1/Alarm/Alarm",
        "conveyor/fu1/Alarm/NormalState",
        "bridge/ModbusAlarm",
        "Alarm/",
    ],
)
def test_what_is_not_there_is_not_found(space: AddressSpace, name: str) -> None:
    assert space.get(node(name)) is None


def test_the_server_object_says_what_it_sends(space: AddressSpace) -> None:
    generates = [
        one.NodeId.Identifier
        for one in space[ua.NodeId(Ids.ServerType)].references
        if one.IsForward and one.ReferenceTypeId.Identifier == Ids.GeneratesEvent
    ]
    assert {"DriveEventType", "DriveBridgeAlarmType", "CertificateAlarmType"} <= set(generates)


def test_nothing_is_held_of_what_nobody_looks_at(space: AddressSpace) -> None:
    """Nodes are made when they are asked for, anew each time."""
    where = node("conveyor/fu1/Alarm/AckedState/Id")
    assert space[where] is not space[where]
