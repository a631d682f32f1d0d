"""Permissions on nodes: what clients are told is what is decided."""

from __future__ import annotations

import pytest
from asyncua import ua

from bridge.command.messages.request import LEAST_ROLE, Action, Role
from bridge.image.point import DataType, Point, WriteKind
from bridge.northbound.opcua.space.nodes import MethodNode, ObjectNode, VariableKind, VariableNode
from bridge.northbound.opcua.space.permissions import (
    ROLE_NODES,
    action_of,
    least_role,
    permission,
    role_permissions,
)

Permission = ua.PermissionType


def variable(write: WriteKind, *, writable: bool = True, bit: int | None = None) -> VariableNode:
    # The name says nothing: rights are the point's own.
    point = Point(name="a/status/x", data_type=DataType.FLOAT, writable=writable, write=write)
    return VariableNode("a/status/x", "X", VariableKind.PLAIN, point, 0, bit=bit)


def method(action: Action) -> MethodNode:
    return MethodNode(f"a/{action}", str(action), action, "a", "")


@pytest.mark.parametrize(
    ("write", "least"),
    [
        (WriteKind.TELEGRAM, Role.OPERATOR),
        (WriteKind.PARAMETER, Role.ENGINEER),
        (WriteKind.TIMEOUT, Role.OPERATOR),
    ],
)
def test_a_write_needs_the_role_of_what_it_becomes(write: WriteKind, least: Role) -> None:
    assert least_role(variable(write)) is least
    assert least_role(variable(write, writable=False)) is None
    assert least_role(variable(write, bit=3)) is None


def test_a_call_needs_the_role_of_its_action_and_objects_none() -> None:
    assert {action: least_role(method(action)) for action in Action} == LEAST_ROLE
    assert least_role(ObjectNode("a", "a")) is None
    assert action_of(ObjectNode("a", "a")) is None


@pytest.mark.parametrize("least", [*Role, None])
def test_a_client_is_told_who_may(least: Role | None) -> None:
    for node in (method(Action.STOP), variable(WriteKind.TELEGRAM)):
        more = permission(node)
        held = role_permissions(least, more, sends_events=False).value
        told = {one.RoleId.Identifier: one.Permissions for one in held.Value.Value}  # pyright: ignore
        assert told.keys() == {where for nodes in ROLE_NODES.values() for where in nodes}
        for role, nodes in ROLE_NODES.items():
            for where in nodes:
                assert Permission.Read in told[where]
                assert (more in told[where]) == (least is not None and role >= least)


def test_events_come_from_what_sends_them() -> None:
    for sends in (True, False):
        held = role_permissions(None, Permission.Write, sends_events=sends).value
        assert held is not None
        assert all((Permission.ReceiveEvents in one.Permissions) == sends for one in held.Value.Value)  # pyright: ignore
