"""The router's settings of the how-to do what it says."""

from __future__ import annotations

import itertools
import re
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from bridge.command.drive_link import NodeState
from bridge.config import ZenohTable
from bridge.northbound.zenoh import ZenohServer
from tests.support.views import view_of
from tests.support.zenoh_peer import Peer, until, zenoh_peer
from tests.support.zenoh_rig import FU3, TOP, Rig, rig
from tests.support.zenoh_router import zenoh_router
from tests.support.zenoh_site import READY, drive_says, epoch, make_plant, node_is

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "follow-drives-with-zenoh.md"
LIE = '{"ok":true,"forwarded":true}'


def settings(folder: Path) -> str:
    """Of the how-to, with files and the site of this test."""
    users = folder / "router.users"
    users.write_text("router:r\nhall3:secret\nplc:geheim\nhmi:segreto\n")
    [block] = re.findall(r"```json5\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert "/etc/zenohd/users" in block and "drives/hall3" in block
    for given, here in (("/etc/zenohd/users", str(users)), ("…", "r"), ("drives/hall3", "drives/demo")):
        block = block.replace(given, here)
    return block


@asynccontextmanager
async def served(folder: Path) -> AsyncIterator[Rig]:
    own = folder / "users"
    own.write_text("hall3:secret\n")
    login: dict[str, Any] = {"user": "hall3", "password_file": str(own)}
    async with (
        zenoh_router(settings(folder)) as router,
        rig(router=router, login=("plc", "geheim"), mode="client", **login) as r,
    ):
        node_is(r.plant, NodeState.OPERATIONAL)
        drive_says(r.fu3, READY)
        yield r


async def test_the_plc_commands_and_the_display_reads(tmp_path: Path) -> None:
    async with served(tmp_path) as r, zenoh_peer(r.endpoint, "hmi", "segreto", mode="client") as hmi:
        for peer in (r.peer, hmi):
            await peer.do("subscribe", f"{TOP}/**")
            await peer.do("liveliness", f"{TOP}/@/**")
        taken = await r.peer.command(f"{FU3}/command/control_word", 0x047E, "plc")
        assert taken["ok"], taken
        assert str(r.fu3.channel.owner) == "zenoh:plc"
        refused = await r.peer.command(f"{FU3}/command/setpoint_1", 1, "somebody")
        assert refused["code"] == "not_allowed"
        drive_says(r.fu3, READY, 0x1000)
        for peer in (r.peer, hmi):
            await until(lambda p=peer: p.latest(f"{FU3}/actual/value_1"), "values come")
            await until(lambda p=peer: (f"{TOP}/@/bridge", True) in p.tokens, "the bridge's token")
        assert (await hmi.value(f"{FU3}/actual/frequency"))["q"] == "good"
        said = await hmi.do("get", f"{FU3}/command/control_word", payload="1151")
        assert (said["values"], said["errors"]) == ([], [])


def shown(peer: Peer) -> object:
    return (peer.latest(f"{FU3}/actual/value_1") or {}).get("v")


@pytest.mark.landing(3)
@pytest.mark.parametrize(("ours", "theirs"), [("client", "client"), ("client", "peer"), ("peer", "client")])
async def test_the_bridge_knows_who_reads_behind_a_router(ours: str, theirs: str) -> None:
    plant = make_plant()
    node_is(plant, NodeState.OPERATIONAL)
    (fu3,) = (drive for drive in plant.drives.values() if drive.name.endswith("/fu3"))
    drive_says(fu3, READY, 5)
    async with zenoh_router("{}") as router:
        table = ZenohTable.model_validate({"mode": ours, "connect": [router], "listen": []})
        server = ZenohServer(view_of(plant, epoch_ns=epoch), table, "demo", time.monotonic)
        await server.start()
        try:
            async with zenoh_peer(router, mode=theirs) as peer:
                await peer.do("subscribe", f"{FU3}/actual/*")
                await until(lambda: shown(peer) == 5, "the first gets what changed before it came")
            async with zenoh_peer(router, mode=theirs) as other:
                await other.do("subscribe", f"{FU3}/actual/*")
                values = itertools.count(6)
                await until(lambda: drive_says(fu3, READY, next(values)) or shown(other), "another is served")
        finally:
            await server.close()


async def test_nobody_speaks_in_the_bridges_place(tmp_path: Path) -> None:
    async with served(tmp_path) as r, zenoh_peer(r.endpoint, "hmi", "segreto", mode="client") as liar:
        await r.peer.do("subscribe", f"{TOP}/**")
        await r.peer.do("liveliness", f"{TOP}/@/**")
        for key in ("drives/**", f"{FU3}/command/control_word"):
            await liar.do("answer", key, payload=LIE)
        await liar.do("put", f"{FU3}/actual/frequency", payload=LIE)
        await liar.do("token", f"{TOP}/@/liar")
        for _ in range(20):
            assert (await r.peer.command(f"{FU3}/command/control_word", "on", "plc"))["code"] == "malformed"
        drive_says(r.fu3, READY, 0x1001)
        await r.sees(f"{FU3}/actual/value_1", v=0x1001)
        assert all(sample["payload"] != LIE for sample in r.peer.samples)
        assert (f"{TOP}/@/liar", True) not in r.peer.tokens
