"""Who keeps what the bridge publishes does not answer in its place."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from bridge.command.drive_link import NodeState
from tests.support.zenoh_peer import until, zenoh_peer
from tests.support.zenoh_rig import FU3, TOP, Rig, rig
from tests.support.zenoh_router import zenoh_router
from tests.support.zenoh_site import READY, drive_says, node_is

COMMANDS = 25


@asynccontextmanager
async def behind(where: str) -> AsyncIterator[Rig]:
    """A bridge that listens, or that has connected to a router, and a client of the same."""
    if where == "bridge":
        async with rig() as r:
            yield r
    else:
        async with zenoh_router() as endpoint, rig(router=endpoint, mode="client") as r:
            yield r


@pytest.mark.landing(4)
@pytest.mark.parametrize("complete", ["no", "yes"])
@pytest.mark.parametrize("where", ["bridge", "router"])
async def test_a_command_is_answered_by_the_bridge_and_not_with_what_is_stored(
    where: str, complete: str
) -> None:
    key = f"{FU3}/command/setpoint_1"
    async with behind(where) as r, zenoh_peer(r.endpoint, mode="client") as storage:
        await storage.do("store", "drives/**", complete=complete)
        await r.peer.do("subscribe", key)
        node_is(r.plant, NodeState.OPERATIONAL)
        drive_says(r.fu3, READY)
        # Behind a router a storage that says it has everything is asked in our place, unless all are asked.
        target = "all" if (where, complete) == ("router", "yes") else None
        for value in range(1, COMMANDS):
            answer = await r.peer.command(key, {"v": value}, "plc", target)
            assert answer == {"ok": True, "forwarded": False, "message": answer.get("message")}, answer
            await until(
                lambda v=value: (r.peer.latest(key) or {}).get("v") == v, "it is published, and stored"
            )
        said = await r.peer.do("get", key, payload="7", target=target)
        assert any("not_allowed" in error for error in said["errors"]), said


async def test_a_storage_behind_the_bridge_is_never_asked() -> None:
    async with rig() as r, zenoh_peer(r.endpoint) as storage:
        await storage.do("store", "drives/**", complete="yes")
        await storage.do("subscribe", f"{TOP}/**")
        node_is(r.plant, NodeState.OPERATIONAL)
        await until(lambda: storage.samples, "it stores what is published")
        said = await r.peer.do("get", f"{TOP}/**", target="all")
        assert len(said["values"]) == len(r.plant.image.points)


@pytest.mark.parametrize("encoding", ["json", "bare"])
async def test_every_reply_has_a_time_stamp(encoding: str) -> None:
    async with rig(encoding=encoding) as r:
        node_is(r.plant, NodeState.OPERATIONAL)
        drive_says(r.fu3, READY)
        for key, payload in (
            (f"{FU3}/actual/frequency", None),
            (f"{FU3}/**", None),
            ("drives/**", None),
            (f"{FU3}/parameter/p102?cached", None),
            (f"{FU3}/command/keep_alive", "{}"),
            (f"{FU3}/command", '{"setpoint_1": 5}'),
            (f"{FU3}/command/stop", None),
        ):
            said = await r.peer.do("get", key, payload=payload)
            assert said["values"], (key, said)
            assert all(value["stamped"] for value in said["values"]), key
