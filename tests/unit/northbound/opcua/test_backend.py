"""The bridge behind the OPC UA server: who may do what, and what the view is told."""

from __future__ import annotations

from typing import Any

import pytest
from asyncua import ua
from cryptography.hazmat.primitives.asymmetric.rsa import generate_private_key

from bridge.command.messages.request import Action, Identity, Role, Source
from bridge.image import DataType, Point
from bridge.northbound.opcua.backend import Backend, SessionUser
from bridge.northbound.opcua.methods import Caller
from bridge.northbound.opcua.nodes import MethodNode, VariableKind, VariableNode
from bridge.northbound.opcua.writes import Writer
from bridge.northbound.pulse import Pulse
from bridge.uaserver.application import NOBODY, LoginAttempt

KEY = generate_private_key(65537, 2048)


def user(name: str = "anna", role: Role = Role.OPERATOR, connection: str = "") -> SessionUser:
    return SessionUser(Identity(Source.OPCUA, name, role, "10.0.0.1", connection=connection))


class Told:
    """In place of the users, the writer, the caller, the view and the past."""

    files: Any = None

    def __init__(self) -> None:
        self.calls: list[tuple[object, ...]] = []

    async def identify(self, *how: object, encrypted: bool) -> Identity:
        self.calls.append((*how, encrypted))
        return user().identity

    async def write(self, identity: Identity, writes: object, explain: object) -> list[object]:
        self.calls.append((identity, writes))
        return []

    async def call(self, identity: Identity, calls: list[object], explain: object) -> list[object]:
        return await self.write(identity, calls, explain) or calls

    def file(self, where: ua.NodeId) -> None: ...

    async def read(self, identity: Identity, nodes: object) -> dict[object, object]:
        self.calls.append((identity, nodes))
        return {}

    def count(self, leaf: str) -> None:
        self.calls.append((leaf,))

    def on_connection(self, identity: Identity, *, is_there: bool, has_others: bool) -> None:
        self.calls.append((identity, is_there, has_others))


def backend(told: Any, pulse: Any = None) -> Backend:
    return Backend(told, told, told, told, told, pulse, told)


@pytest.mark.parametrize(
    ("where", "least"),
    [
        ("conveyor/fu1/command/control_word", Role.OPERATOR),
        ("conveyor/fu1/Start", Role.OPERATOR),
        ("conveyor/fu1/parameter/p102", Role.ENGINEER),
        ("conveyor/fu1/WriteParameter", Role.ENGINEER),
        ("conveyor/fu1/SaveParameters", Role.ENGINEER),
        ("conveyor/fu1/ReadParameter", Role.OBSERVER),
        ("conveyor/fu1/status/status_word", Role.OPERATOR),
    ],
)
def test_what_a_user_may_write_and_call_follows_from_the_role(where: str, least: Role) -> None:
    told: Any = Told()
    method = where.rpartition("/")[2]
    actions = {"".join(part.title() for part in action.split("_")): action for action in Action}
    found = MethodNode(where, method, actions[method], "", "") if method in actions else None
    point = Point(name=where, data_type=DataType.FLOAT, writable="/status/" not in where)
    variable = VariableNode(where, "", VariableKind.PLAIN, point, 0) if found is None else None
    writer = Writer(told, told, lambda _: variable if variable and variable.writable else None)
    made = Backend(told, told, writer, Caller(told, told, lambda _: found), told, told, told)
    allowed = [role for role in Role if made.may(user(role=role), ua.NodeId(where, 2))]
    assert allowed == [role for role in Role if role >= least]


async def test_a_login_becomes_a_user_whose_connection_is_the_session() -> None:
    told = Told()
    login = LoginAttempt("token", b"nonce", KEY, "10.0.0.1", "session 1f3a", encrypted=True)
    found = await backend(told).identify(login)
    assert found.identity == user(connection="session 1f3a").identity
    assert told.calls == [("token", b"nonce", KEY, "10.0.0.1", True)]


def test_a_user_is_the_same_over_any_session_and_nobody_is_none() -> None:
    assert user(connection="session a").is_same(user(connection="session b"))
    assert not user().is_same(user("eva"))
    assert not user().is_same(NOBODY)
    assert (user("anonymous").is_anonymous, user().is_anonymous) == (True, False)
    assert [user(role=role).has_rights for role in Role] == [False, True, True]


async def test_the_view_is_told_by_the_identity() -> None:
    told = Told()
    made, who = backend(told), user()
    await made.write(who, [], lambda place, why: None)
    call = ua.CallMethodRequest()
    assert await made.call(who, [call], lambda place, why: None) == [call]
    await made.refresh(who, [])
    made.on_connection(who, is_there=True, has_others=False)
    made.on_refused()
    made.on_broken()
    assert told.calls == [
        (who.identity, []),
        (who.identity, [call]),
        (who.identity, []),
        (who.identity, True, False),
        ("opcua_refused_connections",),
        ("opcua_broken_connections",),
    ]


def test_what_is_crowded_may_have_waited_for_ever() -> None:
    pulse = Pulse(lambda: 100.0)
    arrivals = backend(Told(), pulse).arrivals()
    assert arrivals.arrive(crowded=True) == float("-inf")
    assert isinstance(arrivals.arrive(crowded=False), float)
