"""The bridge behind the OPC UA server: who may do what, and what the view is told."""

from __future__ import annotations

from typing import Any

import pytest
from asyncua import ua
from cryptography.hazmat.primitives.asymmetric.rsa import generate_private_key

from bridge.command.messages.request import Identity, Role, Source
from bridge.northbound.opcua.backend import Backend
from bridge.northbound.opcua.requests.session_user import SessionUser
from bridge.northbound.pulse import Pulse
from bridge.uaserver.application import NOBODY, LoginAttempt

KEY = generate_private_key(65537, 2048)


def user(name: str = "anna", role: Role = Role.OPERATOR, connection: str = "") -> SessionUser:
    return SessionUser(Identity(Source.OPCUA, name, role, "10.0.0.1", connection=connection))


PUSH = ua.NodeId(12740)


class Told:
    """In place of the users, the writer, the caller, the view and the past."""

    files: Any = None

    def __init__(self) -> None:
        self.calls: list[tuple[object, ...]] = []

    async def identify(self, login: LoginAttempt) -> Identity:
        self.calls.append((login,))
        return user().identity

    async def write(self, identity: Identity, writes: object, explain: object) -> list[object]:
        self.calls.append((identity, writes))
        return []

    async def call(
        self, identity: Identity, calls: list[object], explain: object = None, **_: object
    ) -> list[object]:
        return await self.write(identity, calls, explain) or calls

    def has(self, where: object) -> bool:
        return where == PUSH

    def file(self, where: ua.NodeId) -> None: ...

    async def read(self, identity: Identity, nodes: object) -> dict[object, object]:
        self.calls.append((identity, nodes))
        return {}

    def count(self, leaf: str) -> None:
        self.calls.append((leaf,))

    def on_connection(self, identity: Identity, *, is_there: bool, has_others: bool) -> None:
        self.calls.append((identity, is_there, has_others))


def backend(told: Any, pulse: Any = None) -> Backend:
    return Backend(told, lambda _: None, told, told, told, told, told, pulse, told)


@pytest.mark.parametrize("least", [*Role, None])
def test_what_a_user_may_write_and_call_follows_from_the_role(least: Role | None) -> None:
    """What nobody may is for no observer either."""
    told: Any = Told()
    made = Backend(told, lambda _: least, told, told, told, told, told, told, told)
    allowed = [role for role in Role if made.may(user(role=role), ua.NodeId("conveyor/fu1", 2))]
    assert allowed == [role for role in Role if role >= (Role.OPERATOR if least is None else least)]


async def test_a_login_becomes_a_user_whose_connection_is_the_session() -> None:
    told = Told()
    login = LoginAttempt("token", None, b"nonce", KEY, b"own", "10.0.0.1", "session 1f3a", encrypted=True)
    found = await backend(told).identify(login)
    assert found.identity == user(connection="session 1f3a").identity
    assert told.calls == [(login,)]


def test_a_user_is_the_same_over_any_session_and_nobody_is_none() -> None:
    assert user(connection="session a").is_same(user(connection="session b"))
    assert not user().is_same(user("eva"))
    assert not user().is_same(NOBODY)
    assert (user("anonymous").is_anonymous, user().is_anonymous) == (True, False)
    assert [user(role=role).rank for role in Role] == [0, 1, 2, 3]


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


async def test_the_methods_of_the_server_itself_are_for_admins_on_an_encrypted_channel() -> None:
    told = Told()
    made = backend(told)
    for role in Role:
        for encrypted in (False, True):
            who = SessionUser(user(role=role).identity, encrypted)
            assert made.may(who, PUSH) == (encrypted and role is Role.ADMIN)


@pytest.mark.parametrize(
    ("method", "least"),
    [
        (ua.ObjectIds.ConditionType_ConditionRefresh, Role.OBSERVER),
        (ua.ObjectIds.AcknowledgeableConditionType_Acknowledge, Role.OPERATOR),
        (ua.ObjectIds.AlarmConditionType_ShelvingState_TimedShelve, Role.OPERATOR),
        (ua.ObjectIds.ConditionType_Disable, Role.ENGINEER),
    ],
)
def test_methods_of_alarms_have_their_roles(method: int, least: Role) -> None:
    told: Any = Told()
    made = backend(told)
    allowed = [role for role in Role if made.may(user(role=role), ua.NodeId(method))]
    assert allowed == [role for role in Role if role >= least]
