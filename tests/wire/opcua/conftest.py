"""One server and one client for a module of tests."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest
import pytest_asyncio
from asyncua import Client

from bridge.northbound.opcua.server import OpcUaServer
from tests.support.opcua_site import OPEN, LocalView, connected, serving


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def served(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[tuple[OpcUaServer, LocalView]]:
    async with serving(OPEN, tmp_path_factory.mktemp("state")) as found:
        yield found


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def client(served: tuple[OpcUaServer, LocalView]) -> AsyncIterator[Client]:
    async with connected(served[0]) as found:
        yield found


@pytest.fixture
def view(served: tuple[OpcUaServer, LocalView]) -> LocalView:
    served[1].requests.clear()
    served[1].rejections.clear()
    return served[1]
