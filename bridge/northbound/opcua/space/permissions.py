"""Permissions on nodes: one table decides what a user may do and what a client is told of it.

Roles are OPC UA's well-known ones (OPC 10000-18 §4.2), each of which may what the one before it may.
"""

from __future__ import annotations

from functools import cache
from typing import Final

from asyncua.server.address_space import AttributeValue

from bridge.command.messages.request import (
    LEAST_ROLE,
    Action,
    Role,
    SetTimeout,
    Write,
    WriteParameter,
)
from bridge.image.point import WriteKind
from bridge.northbound.opcua.space.nodes import FileNode, LiveProperty, MethodNode, ObjectNode, VariableNode
from bridge.northbound.opcua.space.structures import PropertyNode
from bridge.uaserver.library import ObjectIds, data_value, make, node_id, ua, variant

COMMAND_OF: Final = {
    WriteKind.TELEGRAM: Write,
    WriteKind.PARAMETER: WriteParameter,
    WriteKind.TIMEOUT: SetTimeout,
}
"""Command that a write becomes."""

ROLE_NODES: Final = {
    Role.OBSERVER: (ObjectIds.WellKnownRole_Observer,),
    Role.OPERATOR: (ObjectIds.WellKnownRole_Operator,),
    Role.ENGINEER: (ObjectIds.WellKnownRole_Engineer,),
    Role.ADMIN: (ObjectIds.WellKnownRole_ConfigureAdmin, ObjectIds.WellKnownRole_SecurityAdmin),
}
"""Role objects below RoleSet, by the roles of the site file."""

_Permission = ua.PermissionType
_SEES: Final = _Permission.Browse | _Permission.ReadRolePermissions | _Permission.Read
_Described = ObjectNode | MethodNode | VariableNode | PropertyNode | FileNode | LiveProperty


def action_of(node: _Described) -> Action | None:
    """Action of a client that calls or writes this node; None for one that is only read."""
    if isinstance(node, MethodNode):
        return node.action
    if isinstance(node, VariableNode) and node.writable:
        return COMMAND_OF[node.point.write].action
    return None


def least_role(node: _Described) -> Role | None:
    """The role that calling or writing this node needs; None where nobody may."""
    action = action_of(node)
    return None if action is None else LEAST_ROLE[action]


def permission(node: _Described) -> ua.PermissionType:
    """Permission that the least role has beside those that everybody has."""
    return _Permission.Call if isinstance(node, MethodNode) else _Permission.Write


@cache
def role_permissions(
    least: Role | None, more: ua.PermissionType, *, sends_events: bool = False, is_kept: bool = False
) -> AttributeValue:
    """RolePermissions (Part 3 §5.2.9) of a node that needs ``least`` for ``more``; ``is_kept``: it has a
    history, which everybody may read."""
    seen = _SEES | _Permission.ReceiveEvents if sends_events else _SEES
    seen = seen | _Permission.ReadHistory if is_kept else seen
    table = [
        make(
            ua.RolePermissionType,
            RoleId=node_id(where),
            Permissions=seen | more if least is not None and role >= least else seen,
        )
        for role, nodes in ROLE_NODES.items()
        for where in nodes
    ]
    return AttributeValue(data_value(variant(table, ua.VariantType.ExtensionObject)))
