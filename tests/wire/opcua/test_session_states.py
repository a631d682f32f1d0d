"""Which code a request gets in each state of its session: clients repair themselves by it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from asyncua import Client, ua

from bridge.northbound.opcua.server import OpcUaServer
from bridge.uaserver import connection_limits
from bridge.uaserver.routes import ROUTES
from bridge.uaserver.session import Session
from bridge.uaserver.states import REFUSALS, Need, RequestSession
from bridge.uaserver.subscriptions import quotas
from tests.support.opcua_raw import ask, item, monitored, sessions, told
from tests.support.opcua_services import (
    LOAD,
    client,
    load,
    logged_in,
    point,
    served,
    server,
    subscription,
    view,
)
from tests.support.opcua_site import LocalView, break_off, connected
from tests.support.zenoh_peer import until

__all__ = ["client", "served", "server", "view"]

pytestmark = pytest.mark.asyncio(loop_scope="module")
Codes, Errors = ua.StatusCodes, ua.uaerrors


class Channel:
    """A client's connection with a secure channel, without what asyncua's client does by itself."""

    def __init__(self, server: OpcUaServer) -> None:
        self.client = Client(server.endpoint_url, timeout=5)
        self._server = server

    async def open(self) -> None:
        await self.client.connect_socket()
        await self.client.send_hello()
        await self.client.open_secure_channel()

    @property
    def token(self) -> ua.NodeId:
        return self.client.uaclient.protocol.authentication_token

    @token.setter
    def token(self, token: ua.NodeId) -> None:
        self.client.uaclient.session.restore_authentication_token(token)

    async def create(self, timeout_ms: float = 60_000) -> Session:
        params = ua.CreateSessionParameters(RequestedSessionTimeout=timeout_ms)
        await self.client.uaclient.create_session(params)
        return self.session()

    def session(self) -> Session:
        (found,) = (one for one in sessions(self._server) if one.auth_token == self.token)
        return found

    async def activate(self) -> None:
        params = ua.ActivateSessionParameters()
        params.UserIdentityToken = ua.AnonymousIdentityToken(PolicyId="anonymous")
        await self.client.uaclient.activate_session(params)

    async def code(self, service: str) -> int:
        """What the service is answered with, Good for any answer that is not a fault of its session."""
        request: Any = getattr(ua, f"{service}Request")()
        try:
            await self.client.uaclient.protocol.send_request(request)
        except ua.UaStatusCodeError as error:
            return error.code
        return Codes.Good


@asynccontextmanager
async def channel(server: OpcUaServer) -> AsyncIterator[Channel]:
    made = Channel(server)
    await made.open()
    try:
        yield made
    finally:
        break_off(made.client)


@asynccontextmanager
async def in_state(server: OpcUaServer, state: RequestSession) -> AsyncIterator[Channel]:
    async with channel(server) as one, channel(server) as other:
        if state is not RequestSession.NONE:
            await one.create()
        if state not in (RequestSession.NONE, RequestSession.CREATED):
            await one.activate()
        match state:
            case RequestSession.OTHER:
                await other.create()
                one.token = other.token
            case RequestSession.ENDED:
                await one.session().close_session()
            case RequestSession.MOVED:
                other.token = one.token
                await other.activate()
            case _:
                pass
        yield one


def services() -> Iterator[tuple[Need, str]]:
    for need in Need:
        for name in need.value:
            if name != "CloseSecureChannel":  # has no answer
                yield need, name
    for route in ROUTES.values():
        yield Need.USE, route.name


@pytest.mark.landing(3)
@pytest.mark.parametrize("state", RequestSession)
async def test_every_service_is_answered_as_the_table_says(
    server: OpcUaServer, state: RequestSession
) -> None:
    of_sessions = {code for codes in REFUSALS.values() for code in codes.values()}
    wrong: list[str] = []
    for need, service in services():
        async with in_state(server, state) as one:
            code = await one.code(service)
        expected = REFUSALS[need].get(state)
        # What the request is otherwise answered is no matter of its session. One that is not there cannot be
        # activated, whatever the state of this connection.
        is_right = code == expected if expected else code not in of_sessions or need is Need.ACTIVATE
        if not is_right:
            wrong.append(f"{service}: {ua.StatusCode(code).name}")
    assert not wrong


async def test_an_expired_session_is_one_that_is_not_there(
    server: OpcUaServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """node-opcua, Node-RED and FUXA make a new session after this code, and after no other."""
    monkeypatch.setattr(server._server.iserver, "min_session_timeout_ms", 100)  # pyright: ignore
    async with channel(server) as one:
        await one.create(timeout_ms=100)
        await one.activate()
        await asyncio.sleep(0.5)
        assert await one.code("Read") == Codes.BadSessionIdInvalid
        await one.create()
        await one.activate()
        assert await one.code("Read") == Codes.BadNothingToDo


async def test_a_session_that_is_used_before_it_is_activated_ends(server: OpcUaServer) -> None:
    """Part 4 §5.7.3.1. What needs no session does not end it."""
    async with channel(server) as one:
        await one.create()
        assert await one.code("FindServers") == Codes.Good
        assert await one.code("Read") == Codes.BadSessionNotActivated
        with pytest.raises(Errors.BadSessionIdInvalid):
            await one.activate()
        await one.create()
        await one.activate()


async def test_a_session_is_activated_first_where_it_was_created(server: OpcUaServer) -> None:
    """Part 4 §5.6.3."""
    async with channel(server) as one, channel(server) as other:
        await one.create()
        other.token = one.token
        with pytest.raises(Errors.BadSecureChannelIdInvalid):
            await other.activate()
        await one.activate()
        await other.activate()
        assert await other.code("Read") == Codes.BadNothingToDo


async def test_a_session_that_times_out_leaves_its_subscriptions_for_a_transfer(
    server: OpcUaServer, view: LocalView, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Part 4 §5.6.4: only CloseSession may end them with it."""
    monkeypatch.setattr(server._server.iserver, "min_session_timeout_ms", 300)  # pyright: ignore
    gone = Client(server.endpoint_url, timeout=5)
    gone.set_user("anna")
    gone.set_password("swordfish")
    gone.session_timeout = 300
    await gone.connect()
    number = await subscription(gone)
    await monitored(gone, number, [item(await point(gone, LOAD))])
    token = gone.uaclient.protocol.authentication_token
    (before,) = (one for one in sessions(server) if one.auth_token == token)
    break_off(gone)
    async with logged_in(server, "anna") as after:
        await until(lambda: before not in sessions(server), "the session has timed out", 5)
        load(view, 7.0)
        await asyncio.sleep(0.1)
        (result,) = (await ask(after, "TransferSubscriptions", SubscriptionIds=[number])).Parameters.Results
        result.StatusCode.check()
        assert (await told(after, 1))[-1].Value.Value == 7.0


async def test_what_is_left_behind_takes_no_items_from_who_comes_again(
    server: OpcUaServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(quotas, "MOST_ITEMS_OF_ADDRESS", 3)
    async with logged_in(server, "anna") as before:
        number = await subscription(before)
        where = await point(before, LOAD)
        results = await monitored(before, number, [item(where)] * 4)
        codes = [one.StatusCode.value for one in results]
        assert codes == [Codes.Good] * 3 + [Codes.BadTooManyMonitoredItems]
        await before.uaclient.close_session(False)
    async with logged_in(server, "anna") as after:
        results = await monitored(after, await subscription(after), [item(where)] * 3)
        assert all(one.StatusCode.is_good() for one in results)


async def test_there_is_a_channel_left_beside_all_sessions(
    server: OpcUaServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who has lost its connection without the server's knowing comes back to its session on another one."""
    monkeypatch.setattr(quotas, "MOST_SESSIONS_OF_ADDRESS", 3)
    monkeypatch.setattr(connection_limits, "MOST_OF_ADDRESS", 4)
    async with channel(server) as one, connected(server), connected(server), channel(server) as spare:
        await one.create()
        await one.activate()
        with pytest.raises(Errors.BadTooManySessions):
            await spare.create()
        spare.token = one.token
        await spare.activate()
        assert await spare.code("Read") == Codes.BadNothingToDo


async def test_a_session_without_a_connection_makes_room_for_a_new_one(
    server: OpcUaServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(quotas, "MOST_SESSIONS_OF_ADDRESS", 1)
    async with channel(server) as before:
        await before.create()
        await before.activate()
        await subscription(before.client)
    await until(lambda: sessions(server)[0].holder is None, "its connection is gone", 5)
    async with connected(server) as after:
        await after.nodes.server_state.read_value()
        assert len(sessions(server)) == 1
