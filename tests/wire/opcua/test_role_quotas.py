"""Who yields where there is no room for all: an observer to an operator, an operator to an engineer."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path

import pytest
from asyncua import Client, ua

from bridge.config import OpcUaTable, UserTable
from bridge.uaserver.subscriptions import quotas
from tests.support.opcua_peers import PASSWORD, Served, logged_in
from tests.support.opcua_site import connected, serving
from tests.support.passwords import cheap_hash


@asynccontextmanager
async def plant(folder: Path) -> AsyncIterator[Served]:
    line = cheap_hash(PASSWORD)
    users = [
        UserTable(name=name, role=role, password_hash=line)
        for name, role in (("anna", "operator"), ("eva", "engineer"))
    ]
    site = OpcUaTable(listen="127.0.0.1:0", no_security=True, anonymous="observer", user=users)
    async with serving(site, folder) as served:
        yield served


class Ignored:
    def datachange_notification(self, node: object, value: object, data: object) -> None:
        pass


async def lives(client: Client) -> bool:
    try:
        await client.nodes.server_state.read_value()
    except (ConnectionError, ua.UaError):
        return False
    return True


async def test_the_last_session_is_for_a_higher_role(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(quotas, "MOST_SESSIONS_OF_ADDRESS", 3)
    async with plant(tmp_path) as served, AsyncExitStack() as stack:
        observers = [await stack.enter_async_context(_of(served)) for _ in range(3)]
        async with logged_in(served, None, "anna", PASSWORD) as operator:
            assert await lives(operator)
            async with logged_in(served, None, "eva", PASSWORD) as engineer:
                assert [await lives(one) for one in observers].count(True) == 1
                assert await lives(operator)
                # Whoever comes next takes the last observer's place, never theirs.
                async with _of(served) as another:
                    assert await lives(another)
                    assert await lives(engineer)
                    assert await lives(operator)


async def test_subscriptions_and_items_of_a_lower_role_make_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(quotas, "MOST_OF_ADDRESS", 2)
    monkeypatch.setattr(quotas, "MOST_ITEMS_OF_ADDRESS", 3)
    async with plant(tmp_path) as served, AsyncExitStack() as stack:
        observer = await stack.enter_async_context(_of(served))
        mine = await observer.create_subscription(1000, Ignored())
        await observer.create_subscription(1000, Ignored())
        async with logged_in(served, None, "anna", PASSWORD) as operator:
            for _ in range(2):
                held = await operator.create_subscription(1000, Ignored())
            assert not await lives(observer), "its session has made room"
            other = await stack.enter_async_context(_of(served))
            with pytest.raises(ua.uaerrors.BadTooManySubscriptions):
                await other.create_subscription(1000, Ignored())
            assert await lives(operator)
            nodes = [operator.nodes.server_state] * 3
            await held.subscribe_data_change(nodes)
            async with logged_in(served, None, "eva", PASSWORD) as engineer:
                own = await engineer.create_subscription(1000, Ignored())
                await own.subscribe_data_change(engineer.nodes.server_state)
                assert not await lives(operator)
        del mine


@asynccontextmanager
async def _of(served: Served) -> AsyncIterator[Client]:
    """An observer, who may have been ended by the time it goes."""
    try:
        async with connected(served[0]) as client:
            yield client
    except (ConnectionError, ua.UaError):
        pass
