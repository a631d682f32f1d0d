"""Who is in nobody's way: idle sockets, half a handshake, wrong passwords, one that wants everything."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest
from asyncua import Client, ua

from bridge.config import OpcUaTable, UserTable
from bridge.northbound.opcua.server import OpcUaServer
from bridge.northbound.passwords import hash_password
from bridge.uaserver import connection_limits
from bridge.uaserver.connection_limits import DEADLINE_S, ConnectionStage
from bridge.uaserver.subscriptions import monitoring, quotas
from tests.support.opcua_site import OPEN, break_off, connected, serving
from tests.support.passwords import cheap_hash
from tests.support.quiet import quiet_log

Streams = list[tuple[asyncio.StreamReader, asyncio.StreamWriter]]
HELLO = b"HELF\x20\0\0\0" + bytes(4) + (65535).to_bytes(4, "little") * 2 + bytes(12)


@asynccontextmanager
async def idle(server: OpcUaServer, count: int, says: bytes = b"") -> AsyncIterator[Streams]:
    streams: Streams = []
    try:
        for _ in range(count):
            reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
            writer.write(says)
            streams.append((reader, writer))
        yield streams
    finally:
        for _, writer in streams:
            writer.close()


async def is_closed(reader: asyncio.StreamReader, within_s: float) -> bool:
    """An error message may come before the end."""
    with suppress(TimeoutError, ConnectionError):
        async with asyncio.timeout(within_s):
            await reader.read(-1)
            return True
    return reader.at_eof() or reader.exception() is not None


async def reads(server: OpcUaServer) -> float:
    """Seconds that a good client takes to be in and read a value."""
    began = time.monotonic()
    async with connected(server) as client:
        await client.nodes.server_state.read_value()
    return time.monotonic() - began


@pytest.mark.landing
@pytest.mark.parametrize("says", [b"", HELLO], ids=["nothing", "hello"])
async def test_idle_sockets_keep_nobody_out(tmp_path: Path, says: bytes) -> None:
    async with serving(OPEN, tmp_path) as (server, _):
        with quiet_log() as log:
            async with connected(server) as present, idle(server, 300, says):
                assert await reads(server) < 5
                await present.nodes.server_state.read_value()
    told = [line for line in log.lines if "127.0.0.1" in line]
    assert len(told) == 1, told
    assert "made room" in told[0]


@pytest.mark.landing
@pytest.mark.parametrize(
    ("says", "stage"), [(b"", ConnectionStage.CONNECTED), (HELLO, ConnectionStage.GREETED)]
)
async def test_who_comes_no_further_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, says: bytes, stage: ConnectionStage
) -> None:
    monkeypatch.setitem(DEADLINE_S, stage, 0.2)
    async with serving(OPEN, tmp_path) as (server, _), idle(server, 3, says) as streams:
        for reader, _ in streams:
            assert await is_closed(reader, 3)


async def test_a_channel_without_a_session_is_closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(DEADLINE_S, ConnectionStage.CHANNEL, 0.2)
    async with serving(OPEN, tmp_path) as (server, _):
        client = Client(server.endpoint_url, timeout=2)
        await client.connect_socket()
        await client.send_hello()
        await client.open_secure_channel(renew=False)
        async with connected(server) as other:
            await asyncio.sleep(1.5)
            with pytest.raises((ConnectionError, ua.UaError, TimeoutError)):
                await client.create_session()
            await other.nodes.server_state.read_value()
        break_off(client)


@pytest.mark.landing
async def test_a_connection_whose_session_has_ended_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(DEADLINE_S, ConnectionStage.CHANNEL, 0.5)
    async with serving(OPEN, tmp_path) as (server, _), connected(server) as client:
        await asyncio.sleep(1.5)
        await client.nodes.server_state.read_value()
        await client.close_session()
        await asyncio.sleep(2.5)
        with pytest.raises((ConnectionError, ua.UaError, TimeoutError)):
            await client.create_session()


async def test_one_address_has_its_share_of_sessions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection_limits, "MOST_OF_ADDRESS", 4)
    async with serving(OPEN, tmp_path) as (server, _):
        clients = [Client(server.endpoint_url, timeout=2) for _ in range(4)]
        for client in clients:
            await client.connect()
        with pytest.raises((ConnectionError, ua.UaError, TimeoutError)):
            await Client(server.endpoint_url, timeout=2).connect()
        for client in clients:
            await client.nodes.server_state.read_value()
        await clients[0].disconnect()
        assert await reads(server) < 5
        for client in clients[1:]:
            await client.disconnect()


@pytest.mark.landing
async def test_wrong_passwords_hold_up_no_right_one(tmp_path: Path) -> None:
    line = hash_password("swordfish")
    user = UserTable(name="anna", role="operator", password_hash=line)
    settings = OpcUaTable(listen="127.0.0.1:0", no_security=True, anonymous="observer", user=[user])

    async def log_in(password: str) -> float:
        client = Client(server.endpoint_url, timeout=60)
        client.set_user("anna")
        client.set_password(password)
        began = time.monotonic()
        try:
            await client.connect()
            await client.disconnect()
        except ua.UaError:
            break_off(client)
        return time.monotonic() - began

    async with serving(settings, tmp_path) as (server, _):
        alone = await log_in("wrong")
        wrong = [asyncio.create_task(log_in(f"wrong {n}")) for n in range(20)]
        await asyncio.sleep(alone)
        for _ in range(2):  # the first time by its turn, then as one that is known
            right = await log_in("swordfish")
        assert not all(task.done() for task in wrong), "the wrong ones still wait"
        assert right < max(3 * alone, 0.5)
        await asyncio.gather(*wrong)


async def test_wrong_logins_are_answered_later_and_later_and_right_ones_at_once(tmp_path: Path) -> None:
    """Part 4 §5.7.3.1."""
    user = UserTable(name="anna", role="operator", password_hash=cheap_hash("swordfish"))
    settings = OpcUaTable(listen="127.0.0.1:0", no_security=True, user=[user])

    async def log_in(password: str) -> float:
        client = Client(server.endpoint_url, timeout=10)
        client.set_user("anna")
        client.set_password(password)
        await client.connect_socket()
        await client.send_hello()
        await client.open_secure_channel()
        await client.create_session()
        began = time.monotonic()
        with suppress(ua.uaerrors.BadUserAccessDenied):
            await client.activate_session(username="anna", password=password)
        took = time.monotonic() - began
        break_off(client)
        return took

    async with serving(settings, tmp_path) as (server, _):
        wrong = [await log_in("wrong") for _ in range(5)]
        assert wrong[3] > 0.25
        assert wrong[4] > 0.5
        assert await log_in("swordfish") < 1.0, "a sixth wrong one waits for 1 s"


class TestSubscriptions:
    @pytest.mark.landing
    async def test_one_session_and_one_address_have_their_share(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(quotas, "MOST_OF_SESSION", 3)
        monkeypatch.setattr(quotas, "MOST_OF_ADDRESS", 5)
        async with serving(OPEN, tmp_path) as (server, _), connected(server) as greedy:
            for _ in range(3):
                await greedy.create_subscription(1000, None)
            with pytest.raises(ua.uaerrors.BadTooManySubscriptions):
                await greedy.create_subscription(1000, None)
            async with connected(server) as second:
                for _ in range(2):
                    await second.create_subscription(1000, None)
                with pytest.raises(ua.uaerrors.BadTooManySubscriptions):
                    await second.create_subscription(1000, None)

    @pytest.mark.landing
    async def test_what_a_client_left_behind_makes_room(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """A client that is started anew again and again has its old sessions still there."""
        monkeypatch.setattr(quotas, "MOST_OF_ADDRESS", 3)
        async with serving(OPEN, tmp_path) as (server, _):
            for _ in range(3):
                crashed = Client(server.endpoint_url, timeout=2)
                await crashed.connect()
                for _ in range(2):
                    await crashed.create_subscription(1000, None)
                break_off(crashed)
                await asyncio.sleep(0.1)

    @pytest.mark.landing
    async def test_monitored_items_are_shared_out(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(quotas, "MOST_ITEMS_OF_ADDRESS", 10)
        async with serving(OPEN, tmp_path) as (server, _), connected(server) as client:
            subscription = await client.create_subscription(1000, None)
            nodes = [client.nodes.server_state] * 10
            assert all(isinstance(one, int) for one in await subscription.subscribe_data_change(nodes))
            refused = await subscription.subscribe_data_change(nodes)
            assert {getattr(one, "value", None) for one in refused} == {
                ua.StatusCodes.BadTooManyMonitoredItems
            }

    @pytest.mark.landing
    async def test_requests_that_come_at_once_share_what_there_is(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(quotas, "MOST_ITEMS_OF_ADDRESS", 150)
        async with serving(OPEN, tmp_path) as (server, _), connected(server) as one, connected(server) as two:

            async def watch(client: Client) -> int:
                subscription = await client.create_subscription(1000, None)
                made = await subscription.subscribe_data_change([client.nodes.server_state] * 150)
                return sum(isinstance(result, int) for result in made)

            assert sum(await asyncio.gather(watch(one), watch(two))) == 150

    @pytest.mark.landing
    async def test_one_address_watches_one_value_so_often(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(monitoring, "MOST_ON_ONE", 10)
        async with serving(OPEN, tmp_path) as (server, _), connected(server) as client:
            subscription = await client.create_subscription(1000, None)
            for _ in range(2):  # what is deleted makes room
                made = await subscription.subscribe_data_change([client.nodes.server_state] * 11)
                assert [isinstance(one, int) for one in made] == [True] * 10 + [False]
                assert made[10].value == ua.StatusCodes.BadTooManyMonitoredItems
                other = await subscription.subscribe_data_change(client.nodes.namespace_array)
                await subscription.unsubscribe([*made[:10], other])

    @pytest.mark.landing
    async def test_one_address_does_not_take_all_items_for_events(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(quotas, "MOST_LISTENERS_OF_ADDRESS", 5)

        def watch(number: int, fields: int) -> ua.MonitoringParameters:
            message = ua.SimpleAttributeOperand(
                TypeDefinitionId=ua.NodeId(ua.ObjectIds.BaseEventType),
                BrowsePath=[ua.QualifiedName("Message", 0)],
                AttributeId=ua.AttributeIds.Value,
            )
            filter_ = ua.EventFilter(SelectClauses=[message] * fields)
            return ua.MonitoringParameters(ClientHandle=number, QueueSize=10, Filter=filter_)

        server_events = ua.ReadValueId(
            NodeId=ua.NodeId(ua.ObjectIds.Server), AttributeId=ua.AttributeIds.EventNotifier
        )
        wanted = [
            ua.MonitoredItemCreateRequest(
                ItemToMonitor=server_events,
                MonitoringMode=ua.MonitoringMode.Reporting,
                RequestedParameters=watch(number, 1),
            )
            for number in range(1000, 1007)
        ]
        async with serving(OPEN, tmp_path) as (server, _), connected(server) as client:
            subscription = await client.create_subscription(1000, None)

            async def change(item: int, fields: int) -> int:
                asked = ua.MonitoredItemModifyRequest(item, watch(1000, fields))
                params = ua.ModifyMonitoredItemsParameters(
                    SubscriptionId=subscription.subscription_id, ItemsToModify=[asked]
                )
                (result,) = await client.uaclient.modify_monitored_items(params)
                return result.StatusCode.value

            made = await subscription.create_monitored_items(wanted)
            assert sum(isinstance(one, int) for one in made) == 5
            values = await subscription.subscribe_data_change([client.nodes.server_state] * 10)
            assert all(isinstance(one, int) for one in values), "but values may be watched"
            # A filter that takes its time counts as several, also when it comes later.
            assert await change(made[0], 100) == ua.StatusCodes.BadTooManyMonitoredItems
            await subscription.unsubscribe(made[4])
            assert await change(made[0], 100) == ua.StatusCodes.Good
            (refused,) = await subscription.create_monitored_items(wanted[:1])
            assert refused.value == ua.StatusCodes.BadTooManyMonitoredItems
            assert await change(made[0], 1) == ua.StatusCodes.Good
            (again,) = await subscription.create_monitored_items(wanted[:1])
            assert isinstance(again, int)
