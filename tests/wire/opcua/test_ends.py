"""The end of the server is announced to those who follow it; asyncua's client."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from asyncua import Client, ua

from bridge.config import OpcUaTable
from bridge.image import Quality
from bridge.northbound.opcua.server import OpcUaServer
from tests.support.opcua_client import node
from tests.support.opcua_site import LocalView, connected, serving
from tests.support.zenoh_peer import until

Ids = ua.ObjectIds
FOLLOWED = {
    Ids.Server_ServiceLevel: "level",
    Ids.Server_ServerStatus_State: "state",
    Ids.Server_ServerStatus_SecondsTillShutdown: "seconds",
    Ids.Server_ServerStatus_ShutdownReason: "reason",
}
NOTICE_S = 1.2
SETTINGS = OpcUaTable(
    listen="127.0.0.1:0",
    no_security=True,
    anonymous="operator",
    shutdown_notice_s=NOTICE_S,
    return_after_s=30.0,
)
Served = tuple[OpcUaServer, LocalView]


@pytest.fixture
async def served(tmp_path: Path) -> AsyncIterator[Served]:
    async with serving(SETTINGS, tmp_path) as found:
        yield found


class Follower:
    """What a client was told of the server, in its order."""

    def __init__(self) -> None:
        self.told: list[tuple[str, object]] = []

    def datachange_notification(self, node_: object, value: object, data: object) -> None:
        self.told.append((FOLLOWED[getattr(node_, "nodeid").Identifier], value))  # noqa: B009

    async def until(self, what: str, value: object) -> None:
        await until(lambda: (what, value) in self.told, f"{what} {value}")


async def follow(client: Client) -> Follower:
    follower = Follower()
    subscription = await client.create_subscription(50, follower)
    await subscription.subscribe_data_change([client.get_node(one) for one in FOLLOWED])
    await follower.until("level", 255)
    follower.told.clear()
    return follower


async def test_clients_are_told_at_once_and_have_their_time(served: Served) -> None:
    server, _ = served
    async with connected(server) as client:
        follower = await follow(client)
        began = time.monotonic()
        server.announce_end()
        await follower.until("level", 0)
        await follower.until("state", ua.ServerState.Shutdown)
        assert time.monotonic() - began < 0.5
        first = dict(reversed(follower.told))
        assert first["seconds"] == 2
        assert first["reason"] == ua.LocalizedText("the bridge is being stopped", "en")
        # Everything goes on meanwhile.
        assert await (await node(client, "conveyor/fu1/status/status_word")).read_value() is not None
        await server.end()
        assert time.monotonic() - began == pytest.approx(NOTICE_S, abs=0.4)
        await follower.until("seconds", 0)
        status = await client.get_node(Ids.Server_ServerStatus).read_value()
        assert (status.State, status.SecondsTillShutdown) == (ua.ServerState.Shutdown, 0)
        back = await client.get_node(Ids.Server_EstimatedReturnTime).read_value()
        assert (back - status.CurrentTime).total_seconds() == pytest.approx(30, abs=3)


async def test_who_asks_for_german_is_told_in_german(served: Served) -> None:
    server, _ = served
    client = Client(server.endpoint_url, timeout=10)
    client.set_locale(["de-DE"])
    async with client:
        follower = await follow(client)
        server.announce_end()
        await follower.until("level", 0)
        assert ("reason", ua.LocalizedText("die Bridge wird angehalten", "de")) in follower.told


async def test_without_clients_the_end_waits_for_nobody(served: Served) -> None:
    server, _ = served
    began = time.monotonic()
    await server.end()
    assert time.monotonic() - began < 0.3


async def test_without_the_bus_process_the_level_says_so(served: Served) -> None:
    server, view = served
    async with connected(server) as client:
        follower = await follow(client)
        version = "bridge/version"
        for quality, level in ((Quality.DEAD, 1), (Quality.GOOD, 255)):
            view.plant.set(version, "1", time.monotonic(), quality)
            await follower.until("level", level)
