"""The past as clients read it: values, events after a restart, and the black box of a drive as a file."""

from __future__ import annotations

import asyncio
import csv
import json
import sys
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from asyncua import Client, Node, ua
from asyncua.client.ua_file import UaFile

from bridge.command import Event, EventKind
from bridge.config import OpcUaHistoryTable, OpcUaTable
from bridge.text import Text
from tests.support.opcua_alarms import cut_bus, tell
from tests.support.opcua_client import node
from tests.support.opcua_raw import ask
from tests.support.opcua_site import OPEN, LocalView, connected, namespace, serving
from tests.support.process import REPOSITORY

pytestmark = pytest.mark.asyncio(loop_scope="module")
Codes, Attribute = ua.StatusCodes, ua.AttributeIds
LOAD = "bus/can0/load"
PEER = REPOSITORY / "tests" / "wire" / "peers" / "o6_history.py"
BEFORE = datetime(2020, 1, 1, tzinfo=UTC)
POINTS = ["bus/*/load", "*/*/actual/*", "*/*/status/state"]
SETTINGS = OPEN.model_copy(
    update={"history": OpcUaHistoryTable(points=POINTS, before_s=5, after_s=0, black_boxes=2)}
)


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def view(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[LocalView]:
    folder = tmp_path_factory.mktemp("state")
    async with serving(SETTINGS, folder) as (server, view):
        view.server, view.folder = server, folder
        yield view


@pytest_asyncio.fixture(loop_scope="module")
async def client(view: Any) -> AsyncIterator[Client]:
    async with connected(view.server) as found:
        yield found


def just_before() -> datetime:
    """A time before all that is to come, though two clocks differ by some µs."""
    return datetime.now(UTC) - timedelta(milliseconds=10)


async def load(view: LocalView, *percents: float) -> None:
    """Each value is there for two looks."""
    for percent in percents:
        view.plant.set(LOAD, percent, time.monotonic())
        await asyncio.sleep(0.11)


def happen(view: LocalView, *events: Event) -> None:
    for event in events:
        view.plant.events.report(event)
    view.plant.deliver_outcomes()


def trip(source: str = "conveyor/fu1") -> Event:
    return Event(time.monotonic(), EventKind.WATCHDOG, source, 900, Text.of("node.lost"))


def cut(bus: str = "can0") -> Event:
    return Event(time.monotonic(), EventKind.BUS, bus, 900, Text.of("node.lost"))


async def until(ask: Callable[[], Awaitable[Any]], what: str) -> Any:
    """What ``ask`` gives once it is something."""
    for _ in range(200):
        if found := await ask():
            return found
        await asyncio.sleep(0.02)
    raise AssertionError(f"not there: {what}")


def values(found: list[ua.DataValue]) -> list[Any]:
    return [one.Value.Value for one in found]


# values


async def test_raw_values_forwards_backwards_and_in_pieces(client: Client, view: LocalView) -> None:
    start = just_before()
    await load(view, 10.0, 20.0, 30.0, 40.0)
    end = datetime.now(UTC)
    where = await node(client, LOAD)
    whole = await where.read_raw_history(start, end, return_bounds=False)
    assert values(whole) == [10.0, 20.0, 30.0, 40.0]
    back = await where.read_raw_history(end, start, return_bounds=False)
    assert back == whole[::-1]
    newest = await where.read_raw_history(None, end, numvalues=2, return_bounds=False)
    assert values(newest) == [40.0, 30.0]
    details = ua.ReadRawModifiedDetails(False, start, end, 3, False)
    first = await where.history_read(details)
    assert values(first.HistoryData.DataValues) == [10.0, 20.0, 30.0]
    second = await where.history_read(details, first.ContinuationPoint)
    assert values(second.HistoryData.DataValues) == [40.0]
    assert second.ContinuationPoint is None


@pytest.mark.landing
async def test_open62541_reads_the_same(view: Any) -> None:
    await load(view, 1.0, 2.0, 3.0)
    process = await asyncio.create_subprocess_exec(
        sys.executable, str(PEER), view.server.endpoint_url, LOAD, stdout=asyncio.subprocess.PIPE
    )
    out, _ = await process.communicate()
    assert process.returncode == 0
    # It prints a banner before.
    seen = json.loads(out.decode().splitlines()[-1])
    assert seen["forwards"][-3:] == [1.0, 2.0, 3.0]
    assert seen["backwards"] == seen["forwards"][::-1]
    assert seen["first"] == seen["forwards"][:2]


async def test_a_subscription_and_the_history_have_the_same(client: Client, view: LocalView) -> None:
    told: list[ua.DataValue] = []

    class Handler:
        def datachange_notification(self, _: Node, __: object, data: Any) -> None:
            told.append(data.monitored_item.Value)

    start = just_before()
    where = await node(client, LOAD)
    subscription = await client.create_subscription(50, Handler())
    await subscription.subscribe_data_change(where, queuesize=50)
    await load(view, 1.5, 2.5, 3.5)

    async def has_all() -> bool:
        return 3.5 in values(told)

    await until(has_all, "the last value")
    kept = await where.read_raw_history(start, None, 100, return_bounds=False)
    # The point has no source time before its first value.
    told = [one for one in told if one.SourceTimestamp and one.SourceTimestamp >= start]
    assert [(one.Value, one.SourceTimestamp) for one in kept] == [
        (one.Value, one.SourceTimestamp) for one in told
    ]
    await subscription.delete()


async def test_a_value_at_a_time_is_that_of_the_last_change(client: Client, view: LocalView) -> None:
    await load(view, 5.0, 6.0)
    where = await node(client, LOAD)
    now = datetime.now(UTC)
    six, five = await where.read_raw_history(None, now, 2, return_bounds=False)
    between = five.SourceTimestamp + (six.SourceTimestamp - five.SourceTimestamp) / 2
    details = ua.ReadAtTimeDetails([five.SourceTimestamp, between, BEFORE])
    result = await where.history_read(details)  # pyright: ignore[reportArgumentType]
    found = result.HistoryData.DataValues
    assert values(found) == [5.0, 5.0, None]
    assert [one.StatusCode.value for one in found] == [Codes.Good, 0x0402, Codes.BadNoData]


async def test_what_is_kept_says_so_and_all_else_has_no_history(client: Client) -> None:
    kept, other = await node(client, LOAD), await node(client, "bus/can0/state")
    asked = [Attribute.AccessLevel, Attribute.UserAccessLevel, Attribute.Historizing]
    assert values(await kept.read_attributes(asked)) == [5, 5, True]
    assert values(await other.read_attributes(asked)) == [1, 1, False]
    for where in (other, await node(client, "conveyor/fu1"), client.nodes.server):
        with pytest.raises(ua.uaerrors.BadHistoryOperationUnsupported):
            await where.read_raw_history(BEFORE, datetime.now(UTC))
    with pytest.raises(ua.uaerrors.BadNodeIdUnknown):
        await (await node(client, "nobody")).read_raw_history(BEFORE, datetime.now(UTC))
    details = ua.ReadProcessedDetails(BEFORE, datetime.now(UTC))
    refused = await kept.history_read(details)  # pyright: ignore[reportArgumentType]
    assert refused.StatusCode.value == Codes.BadHistoryOperationUnsupported
    with pytest.raises(ua.uaerrors.BadHistoryOperationUnsupported):
        await ask(client, "HistoryUpdate", HistoryUpdateDetails=[ua.DeleteRawModifiedDetails()])


@pytest.mark.landing
async def test_an_observer_may_read_history(tmp_path: Path) -> None:
    settings = SETTINGS.model_copy(update={"anonymous": "observer"})
    async with serving(settings, tmp_path) as (server, view), connected(server) as client:
        await load(view, 7.0)
        where = await node(client, LOAD)
        assert values(await where.read_raw_history(None, datetime.now(UTC), 1, False)) == [7.0]
        assert values(await where.read_attributes([Attribute.UserAccessLevel])) == [5]
        happen(view, trip())
        assert await until(lambda: events(client.nodes.server), "an event")


async def test_the_server_says_what_it_can(client: Client) -> None:
    async def read(name: str) -> object:
        return await client.get_node(ua.NodeId(getattr(ua.ObjectIds, name))).read_value()

    limits = "Server_ServerCapabilities_OperationLimits_MaxNodesPerHistoryRead"
    assert await read(f"{limits}Data") == await read(f"{limits}Events") == 100
    assert await read("Server_ServerCapabilities_MaxHistoryContinuationPoints") == 100
    assert await read("HistoryServerCapabilities_AccessHistoryDataCapability") is True
    assert await read("HistoryServerCapabilities_UpdateDataCapability") is False


# events


async def events(where: Node, start: datetime | None = BEFORE, most: int = 1000) -> list[Any]:
    return await where.read_event_history(start, None, most)


async def test_events_of_the_past_are_those_of_their_objects(client: Client, view: LocalView) -> None:
    start = just_before()
    happen(view, trip(), cut())

    async def both() -> Any:
        found = await events(client.nodes.server, start)
        return found if len(found) == 2 else None

    first, second = await until(both, "both events")
    assert (first.SourceName, first.Severity, first.Message.Text) == ("conveyor/fu1", 900, "node lost")
    assert second.SourceNode == ua.NodeId("bus/can0", await namespace(client))
    for name, count in (("conveyor/fu1", 1), ("conveyor", 1), ("conveyor/fu2", 0), ("bus/can0", 1)):
        assert len(await events(await node(client, name), start)) == count, name
    notifies = await (await node(client, "conveyor/fu1")).read_attribute(Attribute.EventNotifier)
    assert notifies.Value.Value == 5


def kept_events(state_dir: Path) -> list[Path]:
    """Wherever they are."""
    return list(state_dir.rglob("events.jsonl"))


async def test_a_bus_that_was_cut_is_in_the_history_after_a_restart(tmp_path: Path) -> None:
    """In the language of who reads it, though it happened in another run."""
    async with serving(SETTINGS, tmp_path) as (server, view):
        happen(view, cut())
        async with connected(server) as client:
            (before,) = await until(lambda: events(client.nodes.server), "the event")
    assert kept_events(tmp_path) == [tmp_path / "opcua" / "events.jsonl"]
    async with serving(SETTINGS, tmp_path) as (server, view):
        german = Client(server.endpoint_url, timeout=10)
        german.set_locale(["de-AT", "en"])
        async with german as client:
            (kept,) = await events(client.nodes.server)
            assert (kept.EventId, kept.Time) == (before.EventId, before.Time)
            assert before.Message == ua.LocalizedText("node lost", "en")
            assert kept.Message == ua.LocalizedText("Knoten nicht erreichbar", "de")
            happen(view, trip())

            async def more() -> bool:
                return len(await events(client.nodes.server)) == 2

            await until(more, "one more")


async def alarms(client: Client) -> list[Any]:
    """Events of the alarm of the bus."""
    server = client.nodes.server
    kind = ua.NodeId(ua.ObjectIds.AlarmConditionType)
    found = await server.read_event_history(BEFORE, None, 1000, evtypes=kind)
    return [one for one in found if one.SourceName == "can0" and hasattr(one, "ActiveState/Id")]


async def test_what_an_alarm_has_told_is_in_the_history_after_a_restart(tmp_path: Path) -> None:
    async with serving(SETTINGS, tmp_path) as (server, view), connected(server) as client:
        tell(view, cut_bus("conveyor"))
        before = await until(lambda: alarms(client), "the alarm")
    async with serving(SETTINGS, tmp_path) as (server, view), connected(server) as client:
        after = await alarms(client)
        assert [one.EventId for one in after[: len(before)]] == [one.EventId for one in before]
        assert getattr(after[0], "ActiveState/Id") is True
        assert after[0].Message == before[0].Message
        assert after[0].SourceNode == ua.NodeId("bus/can0", await namespace(client))


@pytest.mark.landing
async def test_without_hours_no_events_are_kept(tmp_path: Path) -> None:
    history = OpcUaHistoryTable(event_hours=0, black_boxes=0)
    settings: OpcUaTable = OPEN.model_copy(update={"history": history})
    async with serving(settings, tmp_path) as (server, view), connected(server) as client:
        happen(view, trip())
        with pytest.raises(ua.uaerrors.BadHistoryOperationUnsupported):
            await events(client.nodes.server)
        notifies = await client.nodes.server.read_attribute(Attribute.EventNotifier)
        assert notifies.Value.Value == 1
    assert not kept_events(tmp_path)


# black box


def black_boxes(state_dir: Path, drive: str) -> list[Path]:
    return list((state_dir / "opcua" / "black_box" / drive).iterdir())


async def test_a_trip_is_a_file_that_clients_and_spreadsheets_read(client: Client, view: Any) -> None:
    file = await node(client, "conveyor/fu2/BlackBox/1")
    size = await file.get_child("Size")
    assert await size.read_value() == 0
    current = view.image.index["conveyor/fu2/actual/current"]
    view.answers = False
    for amperes in (1.5, 9.5):
        view.image.set(current, amperes, time.monotonic())
        await asyncio.sleep(0.11)
    view.answers = True
    happen(view, trip("conveyor/fu2"))
    length = await until(size.read_value, "the file")
    async with UaFile(file, "r") as opened:
        content = await opened.read()
    assert len(content) == length
    assert [one.read_bytes() for one in black_boxes(view.folder, "conveyor/fu2")] == [content]
    rows = list(csv.DictReader(content.decode("utf-8-sig").splitlines()))
    told = dict.fromkeys(row["conveyor/fu2/actual/current [A]"] for row in rows)
    assert [one for one in told if one in ("1.5", "9.5")] == ["1.5", "9.5"]
    trip_time = await file.get_child(f"{await namespace(client)}:TripTime")
    assert abs(await trip_time.read_value() - datetime.now(UTC)) < timedelta(seconds=10)
    assert await (await node(client, "conveyor/fu3/BlackBox/1/Size")).read_value() == 0
    with pytest.raises(ua.uaerrors.BadNotReadable):
        await UaFile(await node(client, "conveyor/fu3/BlackBox/1"), "r").open(1)
    with pytest.raises(ua.uaerrors.BadNotWritable):
        await UaFile(file, "w").open(2)


async def test_what_a_session_has_open_is_closed_with_it(client: Client, view: Any) -> None:
    file = await node(client, "conveyor/fu4/BlackBox/1")
    size, count = await file.get_child("Size"), await file.get_child("OpenCount")
    happen(view, trip("conveyor/fu4"))
    await until(size.read_value, "the file")
    async with connected(view.server) as other:
        await UaFile(other.get_node(file.nodeid), "r").open(1)
        assert await count.read_value() == 1

    async def closed() -> bool:
        return await count.read_value() == 0

    await until(closed, "the file to be closed")
