"""A whole server without a bridge: an application of the test, and asyncua's client."""

from __future__ import annotations

import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
from asyncua import Client, ua

from bridge.uaserver import decoding
from bridge.uaserver.bound import BoundServer
from bridge.uaserver.connections.security import Refused
from bridge.uaserver.inner_server import InnerServer
from tests.support.opcua_application import Served, User, add_variable

WORD = ua.NodeId("word", 1)


class AllTrusted:
    def refusal(self, sent: bytes, source: str, application_uri: str | None = None) -> Refused | None:
        return None


@asynccontextmanager
async def serving(application: Served) -> AsyncIterator[str]:
    decoding.install()
    bound = socket.create_server(("127.0.0.1", 0))
    bound.setblocking(False)
    url = f"opc.tcp://127.0.0.1:{bound.getsockname()[1]}"
    inner = InnerServer(no_security=True)
    inner.application = application
    server = BoundServer(inner, bound, AllTrusted())
    server.set_endpoint(url)
    await server.init()
    server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
    server.set_identity_tokens([ua.AnonymousIdentityToken, ua.UserNameIdentityToken])
    add_variable(inner.aspace, WORD, 7, access=3)
    inner.subscriptions.prepare()
    await server.start()
    try:
        yield url
    finally:
        await server.stop()
        bound.close()


@pytest.mark.landing
async def test_an_application_without_a_bridge_is_served() -> None:
    application = Served({"anonymous": User("anonymous", is_anonymous=True)})
    async with serving(application) as url, Client(url) as client:
        node = client.get_node(WORD)
        assert await node.read_value() == 7
        await node.write_value(ua.DataValue(ua.Variant(8, ua.VariantType.UInt16)))
        assert application.written == [("anonymous", 8)]
        assert application.told == [("anonymous", True, False)]
    assert application.told[-1] == ("anonymous", False, False)


@pytest.mark.landing
async def test_who_is_not_identified_is_refused_and_counted() -> None:
    application = Served()
    async with serving(application) as url:
        with pytest.raises(ua.UaStatusCodeError) as refused:
            async with Client(url):
                pass
        assert refused.value.code == ua.StatusCodes.BadUserAccessDenied
        assert (application.refusals, application.told) == (1, [])
