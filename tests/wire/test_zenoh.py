"""The zenoh server and a second process that speaks plain zenoh."""

from __future__ import annotations

import asyncio
import itertools
import json
import time
from typing import Any

import pytest

from bridge.command.drive_link import NodeState
from bridge.config import ZenohTable
from bridge.northbound.zenoh import ZenohServer
from bridge.zenohlink import Value
from bridge.zenohlink.publishers import Publishers
from tests.support.node_states import run_timers
from tests.support.views import view_of
from tests.support.zenoh_peer import free_port, until, zenoh_peer
from tests.support.zenoh_rig import FU3, TOP, rig
from tests.support.zenoh_site import (
    ENABLED,
    READY,
    SWITCH_ON_INHIBITED,
    drive_says,
    epoch,
    make_plant,
    node_is,
)


async def test_section_6_8_of_the_manual_is_played_through_zenoh() -> None:
    async with rig() as r:
        await r.peer.subscribe(f"{FU3}/**")
        node_is(r.plant, NodeState.OPERATIONAL)
        drive_says(r.fu3, SWITCH_ON_INHIBITED)
        await r.sees(f"{FU3}/status/state", v=1, s="switch_on_inhibited", q="good")

        answer = await r.peer.command(f"{FU3}/command/control_word", {"v": 0x047E}, "plc")
        assert answer == {"ok": True, "forwarded": True}
        assert r.on_the_bus == (0x047E, 0, 0, 0, 0)
        drive_says(r.fu3, READY)
        await r.sees(f"{FU3}/status/status_word", v=READY)

        telegram = {"control_word": 0x047F, "setpoint_1": 0x2000}
        assert (await r.peer.command(f"{FU3}/command", telegram, "plc"))["forwarded"]
        assert r.on_the_bus == (0x047F, 0x2000, 0, 0, 0)
        drive_says(r.fu3, ENABLED, 0x2000)
        await r.sees(f"{FU3}/status/state", s="operation_enabled")
        await r.sees(f"{FU3}/actual/frequency", v=25.0, q="good")
        await r.sees(f"{FU3}/supervision/owner", v="zenoh:plc")

        assert (await r.peer.command(f"{FU3}/command/control_word", "0x047E", "plc"))["ok"]
        assert r.on_the_bus[0] == 0x047E


async def test_a_scaled_setpoint_is_written_under_its_meaning() -> None:
    async with rig() as r:
        node_is(r.plant, NodeState.OPERATIONAL)
        drive_says(r.fu3, READY)
        assert (await r.peer.command(f"{FU3}/command/control_word", 0x047E))["ok"]
        assert (await r.peer.command(f"{FU3}/command/frequency", {"v": 12.5}))["ok"]
        assert r.on_the_bus == (0x047E, 0x1000, 0, 0, 0)
        refused = await r.peer.command(f"{FU3}/command/frequency", {"v": 5000})
        assert refused["code"] == "out_of_range" and "Hz" in refused["message"]
        assert r.on_the_bus == (0x047E, 0x1000, 0, 0, 0)


async def test_methods() -> None:
    async with rig() as r:
        node_is(r.plant, NodeState.OPERATIONAL)
        drive_says(r.fu3, READY)
        started = asyncio.create_task(r.peer.command(f"{FU3}/command/start", {"direction": 0}, "plc"))
        await until(lambda: r.on_the_bus[0] == 0x047F, "the enabling control word")
        assert not started.done()
        drive_says(r.fu3, ENABLED)
        r.plant.deliver_outcomes()
        assert await started == {"ok": True, "forwarded": True}
        assert (await r.peer.command(f"{FU3}/command/keep_alive", {}, controller="plc"))["ok"]
        assert (await r.peer.command(f"{FU3}/command/stop", "{}", controller="somebody"))["ok"]
        assert r.on_the_bus[0] & 0x000F != 0x000F
        taken = await r.peer.command(f"{TOP}/conveyor/fu4/command/take_control", {"ttl_ms": 500}, "a")
        assert taken["ok"]
        other = await r.peer.command(f"{TOP}/conveyor/fu4/command/take_control", {"ttl_ms": 500}, "b")
        assert other["code"] == "not_allowed" and "zenoh:a" in other["message"]


async def test_who_does_not_own_the_drive_is_refused() -> None:
    async with rig() as r:
        await r.peer.subscribe(f"{TOP}/@/event/**")
        answer = await r.peer.command(f"{TOP}/conveyor/fu1/command/control_word", 0x047E)
        assert answer == {"ok": False, "code": "not_allowed", "message": "the drive is controlled by modbus"}
        assert (await r.peer.command(f"{FU3}/command/control_word", 0x047E, "first"))["ok"]
        second = await r.peer.command(f"{FU3}/command/control_word", 0x047E, "second")
        assert second["code"] == "not_allowed" and "zenoh:first" in second["message"]
        await until(lambda: r.peer.latest(f"{TOP}/@/event/refused"), "the refusal as an event")
        event = r.peer.latest(f"{TOP}/@/event/refused") or {}
        assert event["source"] in ("conveyor/fu1", "conveyor/fu3")
        assert abs(event["t"] - time.time()) < 20


@pytest.mark.landing(3)
@pytest.mark.parametrize(
    ("key", "payload", "code"),
    [
        (f"{FU3}/command/control_word", "on", "malformed"),
        (f"{FU3}/command/control_word", '{"v": [', "malformed"),
        (f"{FU3}/command/control_word", "{}", "malformed"),
        (f"{FU3}/command", '{"nothing": 1}', "unknown_point"),
        (f"{FU3}/actual/frequency", "1", "read_only"),
        (f"{TOP}/conveyor/fu7/command/start", "{}", "unknown_target"),
        (f"{FU3}/command/*", "1", "malformed"),
        (f"**/{'a' * len(TOP)}/conveyor/fu3/command/start", "{}", "malformed"),
        ("drives/**", "1", "malformed"),
    ],
)
async def test_what_is_no_command_is_answered_with_a_sentence(key: str, payload: str, code: str) -> None:
    async with rig() as r:
        answer = await r.peer.command(key, payload)
        assert answer["code"] == code
        assert len(answer["message"]) > 10
        assert r.fu3.channel.owner is None


async def test_what_is_no_command_is_told_as_an_event_of_the_drive_it_was_for() -> None:
    async with rig() as r:
        await r.peer.subscribe(f"{TOP}/@/event/**")
        await r.peer.command(f"{FU3}/command/control_word", "on")
        await until(lambda: r.peer.latest(f"{TOP}/@/event/refused"), "the refusal as an event")
        event = r.peer.latest(f"{TOP}/@/event/refused") or {}
        assert event["source"] == "conveyor/fu3"
        assert "write by zenoh:" in event["message"]


async def test_a_command_with_a_wildcard_is_told_as_an_event() -> None:
    async with rig() as r:
        await r.peer.subscribe(f"{TOP}/@/event/**")
        await r.peer.command(f"{FU3}/command/*", "1")
        await until(lambda: r.peer.latest(f"{TOP}/@/event/refused"), "the refusal as an event")
        assert "without wildcards" in (r.peer.latest(f"{TOP}/@/event/refused") or {})["message"]


async def test_a_wrong_attachment_is_answered_with_a_sentence() -> None:
    async with rig() as r:
        said = await r.peer.do("get", f"{FU3}/command/stop", attachment="me")
        assert json.loads(said["errors"][0])["code"] == "malformed"


async def test_a_get_brings_present_values() -> None:
    async with rig() as r:
        node_is(r.plant, NodeState.OPERATIONAL)
        drive_says(r.fu3, ENABLED, 0x2000)
        before = time.time()
        value = await r.peer.value(f"{FU3}/actual/frequency")
        assert value["v"] == 25.0 and value["q"] == "good" and abs(value["t"] - before) < 5
        waiting = await r.peer.value(f"{TOP}/conveyor/fu1/actual/frequency")
        assert waiting["v"] is None and waiting["q"] == "waiting"

        everything = await r.peer.do("get", f"{TOP}/**")
        assert sorted(value["key"] for value in everything["values"]) == sorted(
            f"{TOP}/{point.name}" for point in r.plant.image.points
        )
        some = await r.peer.do("get", f"{TOP}/*/*/supervision/trips")
        assert len(some["values"]) == 3
        part = await r.peer.do("get", f"{TOP}/conveyor/fu3/actual/*")
        assert all(value["encoding"] == "application/json" for value in part["values"])
        nothing = await r.peer.do("get", f"{TOP}/*/x/y/z")
        assert nothing["values"] == [] and nothing["errors"] == []
        unknown = await r.peer.do("get", f"{FU3}/actual/nothing")
        assert json.loads(unknown["errors"][0])["code"] == "unknown_point"
        for leaf in ("start", "reset_fault", "take_control", "keep_alive"):
            said = await r.peer.do("get", f"{FU3}/command/{leaf}")
            assert json.loads(said["errors"][0])["code"] == "malformed"
        assert r.fu3.channel.owner is None, "reading commands nothing"


async def test_only_what_somebody_subscribes_to_is_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[str] = []
    put = Publishers.put

    def noted(publishers: Publishers, session: Any, value: Value) -> None:
        sent.append(value[0])
        put(publishers, session, value)

    monkeypatch.setattr(Publishers, "put", noted)
    async with rig() as r:
        await r.peer.subscribe(f"{FU3}/actual/value_1")
        node_is(r.plant, NodeState.OPERATIONAL)
        for value in range(1, 50):
            drive_says(r.fu3, READY, value, value)
            drive_says(r.plant.drives["conveyor/fu1"], READY, value)
            await asyncio.sleep(0.001)
        await r.sees(f"{FU3}/actual/value_1", v=49)
        assert {key.rsplit("/", 2)[0] for key in sent} == {FU3}
        for group in ("status", "actual"):
            assert any(key.startswith(f"{FU3}/{group}/") for key in sent)


async def test_who_comes_first_gets_what_has_changed_before() -> None:
    async with rig() as r:
        node_is(r.plant, NodeState.OPERATIONAL)
        drive_says(r.fu3, READY, 7)
        await asyncio.sleep(0.1)
        await r.peer.do("subscribe", f"{TOP}/**")
        await r.sees(f"{FU3}/actual/value_1", v=7, q="good")
        await r.sees(f"{TOP}/conveyor/node/state", s="operational")
        async with zenoh_peer(r.endpoint) as second:
            await second.subscribe(f"{TOP}/**")
            drive_says(r.fu3, READY, 8)
            await until(lambda: second.latest(f"{FU3}/actual/value_1"), "the new value")
            assert second.latest(f"{TOP}/conveyor/node/state") is None, "it did not change"


async def test_bare_values_have_the_rest_in_the_attachment() -> None:
    async with rig(encoding="bare") as r:
        await r.peer.subscribe(f"{FU3}/actual/*")
        node_is(r.plant, NodeState.OPERATIONAL)
        drive_says(r.fu3, ENABLED, 0x2000)
        key = f"{FU3}/actual/frequency"
        await until(lambda: any(s["key"] == key and s["payload"] == "25.0" for s in r.peer.samples), "25.0")
        sample = [s for s in r.peer.samples if s["key"] == key][-1]
        assert sample["encoding"] == "text/plain" and sample["stamped"]
        assert json.loads(sample["attachment"])["q"] == "good"


async def test_plain_puts_are_commands_only_where_the_site_says_so() -> None:
    for accept_put in (False, True):
        async with rig(accept_put=accept_put) as r:
            node_is(r.plant, NodeState.OPERATIONAL)
            drive_says(r.fu3, READY)
            for key, payload in (
                ("control_word", "on"),
                ("control_word", "1150"),
                ("setpoint_1", '{"v": 4096}'),
            ):
                await r.peer.do("put", f"{FU3}/command/{key}", payload=payload)
            if accept_put:
                await until(lambda r=r: r.on_the_bus == (0x047E, 0x1000, 0, 0, 0), "the put words")
                await asyncio.sleep(0.1)  # what we publish ourselves on these keys is no command
                assert r.fu3.channel.refused_writes == 0
            else:
                await r.peer.value(f"{FU3}/command/control_word")
                assert r.fu3.channel.owner is None


async def test_liveliness_follows_the_bridge_and_its_nodes() -> None:
    async with rig() as r:
        await r.peer.do("liveliness", f"{TOP}/@/**")
        await until(lambda: r.peer.tokens == [(f"{TOP}/@/bridge", True)], "the bridge's token alone")
        node_is(r.plant, NodeState.OPERATIONAL)
        await until(lambda: (f"{TOP}/@/conveyor", True) in r.peer.tokens, "the node's token")
        node_is(r.plant, NodeState.LOST)
        await until(lambda: (f"{TOP}/@/conveyor", False) in r.peer.tokens, "its end")


async def test_a_trip_is_seen_and_has_to_be_acknowledged() -> None:
    async with rig() as r:
        await r.peer.subscribe(f"{TOP}/**")
        await r.peer.subscribe(f"{TOP}/@/event/*")
        node_is(r.plant, NodeState.OPERATIONAL)
        drive_says(r.fu3, READY)
        assert (await r.peer.command(f"{FU3}/command/control_word", 0x047E))["ok"]
        assert (await r.peer.command(f"{FU3}/command/control_word", 0x047F))["ok"]
        drive_says(r.fu3, ENABLED)
        run_timers(r.plant, time.monotonic() + 1.1)
        await r.sees(f"{FU3}/status/state", s="fault")
        await r.sees(f"{FU3}/supervision/current_fault", v=10.3)
        await r.sees(f"{TOP}/@/event/watchdog", source="conveyor/fu3")
        answer = await r.peer.command(f"{FU3}/command/control_word", 0x047F)
        assert answer["ok"] and not answer["forwarded"] and "acknowledge" in answer["message"]
        start = await r.peer.command(f"{FU3}/command/start", {})
        assert start["code"] == "acknowledge_first"
        assert (await r.peer.command(f"{FU3}/command/reset_fault", {}))["ok"]


async def test_a_client_that_stalls_costs_the_loop_nothing() -> None:
    async with rig() as r:
        await r.peer.subscribe(f"{TOP}/**")
        asking = [asyncio.create_task(r.peer.do("get", f"{TOP}/**")) for _ in range(4)]
        await asyncio.sleep(0.02)
        r.peer.stop()
        worst = 0.0
        node_is(r.plant, NodeState.OPERATIONAL)
        for value in range(300):
            begin = time.monotonic()
            drive_says(r.fu3, ENABLED, value, value, value)
            await asyncio.sleep(0.005)
            worst = max(worst, time.monotonic() - begin)
        assert worst < 0.25
        r.peer.go_on()
        await asyncio.gather(*asking)
        # It may have been disconnected meanwhile; then it comes back and sees what changes from now on.
        values = itertools.count(1000)

        def is_served_again() -> bool:
            drive_says(r.fu3, ENABLED, next(values))
            return ((r.peer.latest(f"{FU3}/actual/value_1") or {}).get("v") or 0) > 1000

        await until(is_served_again, "values after the stall", 20)


async def test_connections_that_have_ended_are_counted() -> None:
    plant, endpoint = make_plant(), f"tcp/127.0.0.1:{free_port()}"
    table = ZenohTable.model_validate({"listen": [endpoint]})
    server = ZenohServer(view_of(plant, epoch_ns=epoch), table, "demo", time.monotonic)
    await server.start()
    try:
        for number in (1, 2):
            async with zenoh_peer(endpoint):
                assert plant.image.read("bridge/zenoh_broken_connections").value == number - 1
            await until(
                lambda number=number: plant.image.read("bridge/zenoh_broken_connections").value == number,
                "the end of a connection",
            )
    finally:
        await server.close()
