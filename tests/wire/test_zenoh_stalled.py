"""Clients that do not read hold up nobody: a controller whose answers are late would let its drive trip."""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from bridge.command.drive_link import NodeState
from tests.support.zenoh_rig import FU3, TOP, Rig, rig
from tests.support.zenoh_site import ENABLED, drive_says, node_is

CROWD = Path(__file__).parents[1] / "peers" / "zenoh_crowd.py"
MORE_NODES = 6
"""So that all values together are more than a connection and its queue hold."""
LASTS_S = 4.0
WORKED_OFF_S = 5.0
"""Within which all is answered that the clients asked before they stopped: work that others wait for."""
USUAL_S = 0.1
LATEST_S = 0.5
"""Within which half and 99 of 100 of the answers come then, on a machine that does other things, too. Who
waits for one client that does not read waits for all of them, one after the other."""


@asynccontextmanager
async def stopped_clients(endpoint: str, count: int) -> AsyncIterator[None]:
    process = await asyncio.create_subprocess_exec(
        sys.executable, str(CROWD), endpoint, TOP, str(count), stdout=asyncio.subprocess.PIPE
    )
    try:
        assert process.stdout
        assert await asyncio.wait_for(process.stdout.readline(), 30) == b"stopping\n"
        yield
    finally:
        process.kill()
        await process.wait()


async def values_change(r: Rig) -> None:
    for value in range(1_000_000):
        drive_says(r.fu3, ENABLED, value % 0x8000, value % 0x8000)
        await asyncio.sleep(0.01)


async def answers_of(r: Rig, key: str, payload: str | None) -> list[float]:
    """How long each answer of one client took that asks again and again."""
    took: list[float] = []
    end = time.monotonic() + LASTS_S
    while time.monotonic() < end:
        begin = time.monotonic()
        await r.peer.do("get", key, payload=payload)
        took.append(time.monotonic() - begin)
        await asyncio.sleep(0.01)
    return sorted(took)


async def test_each_of_many_commands_at_once_is_answered() -> None:
    """Answers are dropped for who does not read, and for nobody else."""
    async with rig(mode="client") as r:
        node_is(r.plant, NodeState.OPERATIONAL)
        said = await asyncio.gather(
            *(r.peer.do("get", f"{FU3}/command/keep_alive", payload="{}") for _ in range(300)),
            *(r.peer.do("get", f"{FU3}/command/control_word", payload="on") for _ in range(300)),
            *(r.peer.do("get", f"{FU3}/**") for _ in range(10)),
        )
    for answer in said[:600]:
        # Some are refused: nobody has so many commands under way.
        [text] = [*answer["errors"], *(value["payload"] for value in answer["values"])]
        assert "ok" in json.loads(text)
    assert len({len(answer["values"]) for answer in said[600:]}) == 1


@pytest.mark.landing
@pytest.mark.parametrize("count", [6, 12])
async def test_stopped_clients_do_not_hold_up_the_commands_of_others(count: int) -> None:
    async with rig(mode="client", further=MORE_NODES, room=32768) as r:
        node_is(r.plant, NodeState.OPERATIONAL)
        changing = asyncio.create_task(values_change(r))
        try:
            async with stopped_clients(r.endpoint, count):
                await asyncio.wait_for(r.peer.do("get", f"{FU3}/actual/frequency"), WORKED_OFF_S)
                commands, values, refused = await asyncio.gather(
                    answers_of(r, f"{FU3}/command/keep_alive", "{}"),
                    answers_of(r, f"{FU3}/actual/frequency", None),
                    answers_of(r, f"{FU3}/command/control_word", "on"),
                )
        finally:
            changing.cancel()
        for took in (commands, values, refused):
            assert len(took) > 50
            assert took[len(took) // 2] <= USUAL_S, took
            assert took[int(len(took) * 0.99)] <= LATEST_S, took[-10:]
