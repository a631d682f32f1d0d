"""Nobody speaks in the bridge's place, or in another's: not on its keys, and not through it."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from bridge.command.drive_link import NodeState
from tests.support.zenoh_peer import Peer, until, zenoh_peer
from tests.support.zenoh_rig import FU3, TOP, Rig, rig
from tests.support.zenoh_site import READY, drive_says, node_is

LIE = '{"ok":true,"forwarded":true,"v":99,"q":"good","t":0.0}'
KEYS = (
    f"{FU3}/status/state",
    f"{FU3}/actual/frequency",
    f"{FU3}/command/control_word",
    f"{TOP}/bridge/version",
    f"{TOP}/@/event/watchdog",
    f"{TOP}/@/controller/plc/conveyor/fu3/command/start",
)
TOKENS = (f"{TOP}/@/bridge", f"{TOP}/@/conveyor", f"{TOP}/@/controller/plc")
PASSWORDS = "bridge:secret\nplc:geheim\nhmi:segreto\n"


def users(folder: Path, lines: str = PASSWORDS) -> dict[str, Any]:
    file = folder / "users"
    file.write_text(lines)
    return {"user": "bridge", "password_file": str(file)}


@asynccontextmanager
async def served(folder: Path, login: tuple[str, ...], mode: str) -> AsyncIterator[Rig]:
    async with rig(login=login, mode=mode, **(users(folder) if login else {})) as r:
        node_is(r.plant, NodeState.OPERATIONAL)
        drive_says(r.fu3, READY)
        yield r


async def lies(liar: Peer) -> None:
    for key in KEYS:
        await liar.do("put", key, payload=LIE)
        await liar.do("delete", key)
    for key in TOKENS:
        await liar.do("token", key)


@pytest.mark.landing(2)
@pytest.mark.parametrize("mode", ["client", "peer"])
@pytest.mark.parametrize("login", [(), ("plc", "geheim")], ids=["open", "users"])
async def test_nobody_else_publishes_or_holds_tokens(
    tmp_path: Path, login: tuple[str, ...], mode: str
) -> None:
    liars = ("hmi", "segreto") if login else ()
    async with served(tmp_path, login, mode) as r, zenoh_peer(r.endpoint, *liars, mode=mode) as liar:
        await r.peer.do("subscribe", f"{TOP}/**")
        await r.peer.do("subscribe", f"{TOP}/@/**")
        await r.peer.do("liveliness", "drives/*/@/**")
        await lies(liar)
        drive_says(r.fu3, READY, 0x1000)
        await r.sees(f"{FU3}/actual/value_1", v=0x1000)
        told = [sample for sample in r.peer.samples if LIE in sample["payload"] or not sample["is_put"]]
        assert told == []
        await until(lambda: r.peer.tokens, "the bridge's tokens")
        assert set(r.peer.tokens) <= {(f"{TOP}/@/bridge", True), (f"{TOP}/@/conveyor", True)}


@pytest.mark.landing(4)
@pytest.mark.parametrize("target", [None, "all"])
@pytest.mark.parametrize("mode", ["client", "peer"])
@pytest.mark.parametrize("login", [(), ("plc", "geheim")], ids=["open", "users"])
async def test_nobody_else_answers(
    tmp_path: Path, login: tuple[str, ...], mode: str, target: str | None
) -> None:
    liars = ("hmi", "segreto") if login else ()
    async with served(tmp_path, login, mode) as r, zenoh_peer(r.endpoint, *liars, mode=mode) as liar:
        for key in ("drives/**", f"{FU3}/command/control_word", f"{TOP}/@/controller/**"):
            await liar.do("answer", key, payload=LIE)
        own = f"{TOP}/@/controller/plc/conveyor/fu3" if login else FU3
        for _ in range(40):
            answer = await r.peer.command(f"{own}/command/control_word", "on", "plc", target)
            assert answer["code"] == "malformed"
        said = await r.peer.do("get", f"{FU3}/**", target=target)
        assert said["values"]
        assert all(value["payload"] != LIE for value in said["values"])


async def test_the_bridge_passes_nothing_on() -> None:
    async with rig(mode="client") as r, zenoh_peer(r.endpoint, mode="client") as other:
        await r.peer.do("subscribe", "elsewhere/**")
        await other.do("answer", "elsewhere/**", payload=LIE)
        await other.do("put", "elsewhere/x", payload=LIE)
        said = await r.peer.do("get", "elsewhere/x")
        assert (said["values"], said["errors"], r.peer.samples) == ([], [], [])


async def test_a_controller_is_the_user_of_its_link(tmp_path: Path) -> None:
    async with (
        served(tmp_path, ("plc", "geheim"), "client") as r,
        zenoh_peer(r.endpoint, "hmi", "segreto", mode="client") as hmi,
    ):
        mine, theirs = (f"{TOP}/@/controller/{name}/conveyor/fu3" for name in ("plc", "hmi"))
        assert (await r.peer.command(f"{mine}/command/control_word", 0x047E, "hmi"))["ok"]
        assert str(r.fu3.channel.owner) == "zenoh:plc", "whatever the payload says"
        # The keys of another lead nowhere, with wildcards or without.
        for key in (mine, f"{TOP}/@/controller/*/conveyor/fu3", f"{TOP}/@/**"):
            said = await hmi.do("get", f"{key}/command/control_word", payload="1150", attachment=None)
            assert (said["values"], said["errors"]) == ([], [])
        refused = await hmi.command(f"{theirs}/command/control_word", 0x047E)
        assert refused["code"] == "not_allowed" and "zenoh:plc" in refused["message"]
        # On the plain keys nobody knows who asks.
        for key, payload in (
            ("command/control_word", "1150"),
            ("command/keep_alive", "{}"),
            ("command/reset_fault", "{}"),
            ("command/release_control", None),
            ("parameter/p102", "1.0"),
        ):
            answer = await hmi.command(f"{FU3}/{key}", payload, "plc")
            assert answer["code"] == "not_allowed" and "@/controller/<user>" in answer["message"], key
        assert (await hmi.command(f"{TOP}/conveyor/node/reset", "{}", "plc"))["code"] == "not_allowed"
        assert str(r.fu3.channel.owner) == "zenoh:plc"
        # A stop is taken from whoever it is.
        assert (await hmi.command(f"{FU3}/command/stop"))["ok"]
        assert (await hmi.value(f"{FU3}/supervision/owner"))["q"] == "good"


async def test_the_only_user_needs_no_keys_of_its_own(tmp_path: Path) -> None:
    lines = "bridge:secret\nplc:geheim\n"
    async with rig(login=("plc", "geheim"), **users(tmp_path, lines)) as r:
        node_is(r.plant, NodeState.OPERATIONAL)
        drive_says(r.fu3, READY)
        assert (await r.peer.command(f"{FU3}/command/control_word", 0x047E, "somebody"))["ok"]
        assert str(r.fu3.channel.owner) == "zenoh:plc"
        own = f"{TOP}/@/controller/plc/conveyor/fu3"
        assert (await r.peer.command(f"{own}/command/keep_alive", "{}"))["ok"]
        said = await r.peer.do("get", f"{TOP}/@/controller/plc/nothing/x/command/start", payload="{}")
        assert json.loads(said["errors"][0])["code"] == "unknown_target"


async def test_only_the_controllers_of_the_site_file_command(tmp_path: Path) -> None:
    settings: dict[str, Any] = {**users(tmp_path), "controllers": ["plc"]}
    async with (
        rig(login=("plc", "geheim"), **settings) as r,
        zenoh_peer(r.endpoint, "hmi", "segreto") as hmi,
    ):
        node_is(r.plant, NodeState.OPERATIONAL)
        drive_says(r.fu3, READY)
        said = await hmi.do("get", f"{TOP}/@/controller/hmi/conveyor/fu3/command/keep_alive", payload="{}")
        assert (said["values"], said["errors"]) == ([], [])
        own = f"{TOP}/@/controller/plc/conveyor/fu3"
        assert (await r.peer.command(f"{own}/command/control_word", 0x047E))["ok"]
        assert (await hmi.value(f"{FU3}/supervision/owner"))["v"] == "zenoh:plc"


@pytest.mark.parametrize("accept_put", [False, True])
async def test_a_put_on_a_command_key_is_its_users(tmp_path: Path, accept_put: bool) -> None:
    settings: dict[str, Any] = {**users(tmp_path), "accept_put": accept_put}
    async with (
        rig(login=("plc", "geheim"), **settings) as r,
        zenoh_peer(r.endpoint, "hmi", "segreto") as hmi,
    ):
        node_is(r.plant, NodeState.OPERATIONAL)
        drive_says(r.fu3, READY)
        own = f"{TOP}/@/controller/plc/conveyor/fu3"
        await hmi.do("put", f"{own}/command/control_word", payload="1150")
        await hmi.do("put", f"{FU3}/command/control_word", payload="1150")
        await hmi.value(f"{FU3}/supervision/owner")
        await asyncio.sleep(0.1)
        assert r.fu3.channel.owner is None
        await r.peer.do("put", f"{own}/command/control_word", payload="1150")
        if accept_put:
            await until(lambda: r.fu3.channel.owner is not None, "the put")
            assert str(r.fu3.channel.owner) == "zenoh:plc"
        else:
            await asyncio.sleep(0.1)
            assert r.fu3.channel.owner is None
