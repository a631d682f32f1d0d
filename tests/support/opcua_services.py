"""One OPC UA server with two users for a module of tests, and what they ask of it."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
import pytest_asyncio
from asyncua import Client, ua

from bridge.config import OpcUaTable, UserTable
from bridge.northbound.opcua.server import OpcUaServer
from tests.support.opcua_raw import subscribed
from tests.support.opcua_site import LocalView, connected, namespace, serving
from tests.support.passwords import cheap_hash

Ids = ua.ObjectIds
LOAD = "bus/can0/load"
NAMESPACES = ua.NodeId(Ids.Server_NamespaceArray)
PASSWORD = "swordfish"
Served = tuple[OpcUaServer, LocalView]


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def served(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Served]:
    line = cheap_hash(PASSWORD)
    users = [UserTable(name=name, role="operator", password_hash=line) for name in ("anna", "otto")]
    settings = OpcUaTable(listen="127.0.0.1:0", no_security=True, anonymous="operator", user=users)
    async with serving(settings, tmp_path_factory.mktemp("state")) as found:
        yield found


@pytest_asyncio.fixture(loop_scope="module")
async def client(served: Served) -> AsyncIterator[Client]:
    async with connected(served[0]) as found:
        yield found


@pytest.fixture
def server(served: Served) -> OpcUaServer:
    return served[0]


@pytest.fixture
def view(served: Served) -> LocalView:
    return served[1]


@asynccontextmanager
async def logged_in(server: OpcUaServer, user: str) -> AsyncIterator[Client]:
    client = Client(server.endpoint_url, timeout=10)
    client.set_user(user)
    client.set_password(PASSWORD)
    async with client:
        yield client


async def point(client: Client, name: str) -> ua.NodeId:
    return ua.NodeId(name, await namespace(client))


def load(view: LocalView, percent: float) -> None:
    view.plant.set(LOAD, percent, time.monotonic())


async def subscription(client: Client, interval_ms: float = 50, **params: object) -> int:
    return (await subscribed(client, interval_ms, **params)).SubscriptionId
