"""The whole tree as clients see it: what asyncua would have held, whoever looks first and from which end."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

import pytest
from asyncua import Client, ua
from asyncua.ua.ua_binary import struct_to_binary

from bridge.config.point_patterns import HISTORY_POINTS
from bridge.northbound.opcua.history.value_rings import chosen
from bridge.northbound.opcua.server import OpcUaServer
from bridge.northbound.opcua.space.nodes import layout
from tests.support.opcua_held import HeldTree, Seen, as_told, copy_of
from tests.support.opcua_site import OPEN, LocalView, connected, namespace
from tests.support.standard_space import standard_space

pytestmark = pytest.mark.asyncio(loop_scope="module")

AT_ONCE = 100
ALL = 0x3F
BOTH = ua.BrowseDirection.Both
KINDS = set(ua.AttributeIds) - {
    # Depend on who asks.
    ua.AttributeIds.UserAccessLevel,
    ua.AttributeIds.UserExecutable,
    ua.AttributeIds.UserRolePermissions,
    # Not made by asyncua: test_security.py, test_attributes.py.
    ua.AttributeIds.RolePermissions,
    ua.AttributeIds.AccessRestrictions,
    ua.AttributeIds.AccessLevelEx,
}


async def look(client: Client, ids: Sequence[ua.NodeId], points: set[ua.NodeId]) -> dict[ua.NodeId, Seen]:
    seen: dict[ua.NodeId, Seen] = {}
    for start in range(0, len(ids), AT_ONCE):
        some = ids[start : start + AT_ONCE]
        asked = [ua.BrowseDescription(one, BOTH, ua.NodeId(), True, 0, ALL) for one in some]
        for where, result in zip(
            some, await client.uaclient.browse(ua.BrowseParameters(NodesToBrowse=asked)), strict=True
        ):
            # Alarms stand beside the tree: tests/unit/northbound/opcua/alarms/test_alarm_nodes.py.
            of_points = [one for one in result.References if not str(one.NodeId.Identifier).endswith("Alarm")]
            seen[where] = [struct_to_binary(one) for one in of_points], {}
        wanted = [ua.ReadValueId(one, kind) for one in some for kind in KINDS]
        for one, value in zip(
            wanted, await client.uaclient.read(ua.ReadParameters(NodesToRead=wanted)), strict=True
        ):
            is_missing = value.StatusCode.value == ua.StatusCodes.BadAttributeIdInvalid
            if not is_missing and not (one.AttributeId == ua.AttributeIds.Value and one.NodeId in points):
                seen[one.NodeId][1][int(one.AttributeId)] = as_told(value)
    return seen


@pytest.mark.landing
async def test_two_who_look_at_once_from_both_ends_see_what_asyncua_would_have_held(
    served: tuple[OpcUaServer, LocalView], client: Client
) -> None:
    server, view = served
    points = view.image.points
    trees = layout(points, chosen(points, HISTORY_POINTS), OPEN.history.black_boxes)
    held = HeldTree(copy_of(standard_space()), await namespace(client), trees, notifies=5)
    async with connected(server) as other:
        found = await asyncio.gather(
            look(client, held.ids, held.points), look(other, held.ids[::-1], held.points)
        )
    for where in held.ids:
        references, attributes = held.seen(where)
        expected = references, {kind: value for kind, value in attributes.items() if kind in KINDS}
        assert [seen[where] for seen in found] == [expected, expected], where
