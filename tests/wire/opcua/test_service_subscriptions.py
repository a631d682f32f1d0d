"""Subscriptions as the services have them: made, transferred, and theirs who comes back."""

from __future__ import annotations

import asyncio
import time

import pytest
from asyncua import Client, ua

from bridge.northbound.opcua.server import OpcUaServer
from tests.support.opcua_raw import ask, cut, item, monitored, published, sessions, subscribed, told, values
from tests.support.opcua_services import (
    LOAD,
    PASSWORD,
    client,
    load,
    logged_in,
    point,
    served,
    server,
    subscription,
    view,
)
from tests.support.opcua_site import LocalView, break_off, connected

__all__ = ["client", "served", "server", "view"]

pytestmark = pytest.mark.asyncio(loop_scope="module")
Codes, Errors = ua.StatusCodes, ua.uaerrors


class TestSubscriptions:
    @pytest.mark.landing
    async def test_what_is_revised_is_what_is_used(self, client: Client) -> None:
        made = await subscribed(client, 1, RequestedLifetimeCount=1, RequestedMaxKeepAliveCount=2)
        agreed = (made.RevisedPublishingInterval, made.RevisedLifetimeCount, made.RevisedMaxKeepAliveCount)
        assert agreed == (50, 6, 2)
        began = time.monotonic()
        for _ in range(4):
            assert (await published(client)).NotificationMessage.NotificationData == []
        # One after the first cycle, then one after every second: 50 + 3 * 100 ms.
        assert 0.3 <= time.monotonic() - began < 0.9
        changed = (
            await ask(
                client,
                "ModifySubscription",
                SubscriptionId=made.SubscriptionId,
                RequestedPublishingInterval=200,
                RequestedMaxKeepAliveCount=1,
            )
        ).Parameters
        agreed = (
            changed.RevisedPublishingInterval,
            changed.RevisedLifetimeCount,
            changed.RevisedMaxKeepAliveCount,
        )
        assert agreed == (200, 3, 1)
        began = time.monotonic()
        for _ in range(3):
            await published(client)
        assert 0.5 <= time.monotonic() - began < 1.2

    async def test_a_message_holds_no_more_than_is_asked_for(self, client: Client, view: LocalView) -> None:
        number = await subscription(client, MaxNotificationsPerPublish=2)
        nodes = [await point(client, f"bus/can0/{leaf}") for leaf in ("load", "tx_errors", "rx_errors")]
        await monitored(client, number, [item(node) for node in nodes])
        first, second = await published(client), await published(client)
        assert [len(values(one.NotificationMessage)) for one in (first, second)] == [2, 1]
        assert [one.MoreNotifications for one in (first, second)] == [True, False]
        await ask(client, "ModifySubscription", SubscriptionId=number, MaxNotificationsPerPublish=1)
        for one in ("tx_errors", "rx_errors"):
            view.plant.set(f"bus/can0/{one}", 1234, time.monotonic())
        assert len(values((await published(client)).NotificationMessage)) == 1

    async def test_a_message_is_sent_again_until_it_is_acknowledged(
        self, client: Client, view: LocalView
    ) -> None:
        number = await subscription(client)
        load(view, 1.0)
        await monitored(client, number, [item(await point(client, LOAD))])
        first = await published(client)
        load(view, 2.0)
        second = await published(client)
        sequences = [one.NotificationMessage.SequenceNumber for one in (first, second)]
        assert sequences == [1, 2]
        assert second.AvailableSequenceNumbers == [1, 2]
        for _ in range(2):
            again = await ask(client, "Republish", SubscriptionId=number, RetransmitSequenceNumber=1)
            assert values(again.NotificationMessage) == values(first.NotificationMessage)
            assert again.NotificationMessage.PublishTime == first.NotificationMessage.PublishTime
        for unknown in (0, 3, 999_999):
            with pytest.raises(Errors.BadMessageNotAvailable):
                await ask(client, "Republish", SubscriptionId=number, RetransmitSequenceNumber=unknown)
        load(view, 3.0)
        third = await published(client, (number, 1), (number, 1), (number, 77), (number + 100, 1))
        assert [code.value for code in third.Results] == [
            Codes.Good,
            Codes.BadSequenceNumberUnknown,
            Codes.BadSequenceNumberUnknown,
            Codes.BadSubscriptionIdInvalid,
        ]
        assert third.AvailableSequenceNumbers == [2, 3]
        with pytest.raises(Errors.BadMessageNotAvailable):
            await ask(client, "Republish", SubscriptionId=number, RetransmitSequenceNumber=1)
        with pytest.raises(Errors.BadSubscriptionIdInvalid):
            await ask(client, "Republish", SubscriptionId=number + 100, RetransmitSequenceNumber=2)

    async def test_who_waits_for_nothing_is_told(self, client: Client) -> None:
        with pytest.raises(Errors.BadNoSubscription):
            await published(client)
        numbers = [await subscription(client, 5000) for _ in range(2)]
        waiting = asyncio.create_task(published(client))
        await asyncio.sleep(0.05)
        codes = (await ask(client, "DeleteSubscriptions", SubscriptionIds=[*numbers, 4711])).Results
        assert [code.value for code in codes] == [0, 0, Codes.BadSubscriptionIdInvalid]
        with pytest.raises(Errors.BadNoSubscription):
            await waiting

    async def test_what_waits_can_be_cancelled_by_its_handle(self, client: Client) -> None:
        await subscription(client, 5000)
        waiting = [asyncio.create_task(published(client)) for _ in range(2)]
        await asyncio.sleep(0.05)
        handle: int = client.uaclient.protocol._request_handle  # that of the second
        for count in (1, 0):
            answer = await ask(client, "Cancel", RequestHandle=handle)
            assert answer.Parameters.CancelCount == count
        with pytest.raises(Errors.BadRequestCancelledByClient):
            await waiting[1]
        assert not waiting[0].done()
        await ask(client, "Cancel", RequestHandle=handle - 1)
        await asyncio.gather(*waiting, return_exceptions=True)

    async def test_the_mode_is_set_where_it_can_be(self, client: Client, view: LocalView) -> None:
        number = await subscription(client, PublishingEnabled=False, RequestedMaxKeepAliveCount=1)
        await monitored(client, number, [item(await point(client, LOAD))])
        assert (await published(client)).NotificationMessage.NotificationData == []
        codes = await ask(client, "SetPublishingMode", PublishingEnabled=True, SubscriptionIds=[4711, number])
        assert [code.value for code in codes.Parameters.Results] == [
            Codes.BadSubscriptionIdInvalid,
            Codes.Good,
        ]
        assert await told(client, 1)

    async def test_what_nobody_asks_about_ends_with_its_lifetime(self, client: Client) -> None:
        number = await subscription(client, RequestedLifetimeCount=3, RequestedMaxKeepAliveCount=1)
        await asyncio.sleep(0.4)
        result = await published(client)
        (last,) = result.NotificationMessage.NotificationData
        assert (result.SubscriptionId, last.Status.value) == (number, Codes.BadTimeout)
        with pytest.raises(Errors.BadSubscriptionIdInvalid):
            await ask(client, "Republish", SubscriptionId=number, RetransmitSequenceNumber=1)


class TestTransfer:
    @pytest.mark.parametrize("initial", [True, False])
    async def test_a_subscription_goes_on_in_another_session(
        self, server: OpcUaServer, view: LocalView, initial: bool
    ) -> None:
        async with logged_in(server, "anna") as before, logged_in(server, "anna") as after:
            number = await subscription(before)
            load(view, 1.0)
            await monitored(before, number, [item(await point(before, LOAD))])
            (first,) = await told(before, 1)
            waiting = [asyncio.create_task(published(before)) for _ in range(2)]
            await asyncio.sleep(0.02)
            transferred = await ask(
                after, "TransferSubscriptions", SubscriptionIds=[number, 4711], SendInitialValues=initial
            )
            results = transferred.Parameters.Results
            assert [one.StatusCode.value for one in results] == [Codes.Good, Codes.BadSubscriptionIdInvalid]
            assert results[0].AvailableSequenceNumbers == [1]
            # The old session is told, and then that there is nothing more to wait for.
            (last,) = (await waiting[0]).NotificationMessage.NotificationData
            assert last.Status.value == Codes.GoodSubscriptionTransferred
            with pytest.raises(Errors.BadNoSubscription):
                await waiting[1]
            again = await ask(after, "Republish", SubscriptionId=number, RetransmitSequenceNumber=1)
            assert values(again.NotificationMessage) == [first]
            if initial:
                assert [one.Value.Value for one in await told(after, 1)] == [1.0]
            load(view, 2.0)
            assert [one.Value.Value for one in await told(after, 1)] == [2.0]
            with pytest.raises(Errors.BadSubscriptionIdInvalid):
                await ask(before, "Republish", SubscriptionId=number, RetransmitSequenceNumber=1)

    async def test_it_is_not_given_to_anybody_else(self, server: OpcUaServer) -> None:
        async def code(client: Client, number: int) -> int:
            answer = await ask(client, "TransferSubscriptions", SubscriptionIds=[number])
            return answer.Parameters.Results[0].StatusCode.value

        async with logged_in(server, "anna") as anna, logged_in(server, "otto") as otto:
            number = await subscription(anna)
            assert await code(anna, number) == Codes.BadNothingToDo
            assert await code(otto, number) == Codes.BadUserAccessDenied
            # Without a name and without a certificate anyone could be the one who made it.
            async with connected(server) as first, connected(server) as second:
                assert await code(first, number) == Codes.BadUserAccessDenied
                assert await code(first, await subscription(second)) == Codes.BadUserAccessDenied
            assert (await published(anna)).SubscriptionId == number

    async def test_it_outlives_a_session_that_leaves_it(self, server: OpcUaServer, view: LocalView) -> None:
        async with logged_in(server, "anna") as before:
            number = await subscription(before)
            await monitored(before, number, [item(await point(before, LOAD))])
            await before.uaclient.close_session(False)
        async with logged_in(server, "anna") as after:
            load(view, 5.0)
            await asyncio.sleep(0.1)
            await ask(after, "TransferSubscriptions", SubscriptionIds=[number])
            assert (await told(after, 1))[-1].Value.Value == 5.0


class TestReconnect:
    async def test_a_session_comes_back_on_another_connection(
        self, server: OpcUaServer, view: LocalView
    ) -> None:
        """What was on its way when the connection was lost can be had again, and what came since comes."""
        before, after = Client(server.endpoint_url, timeout=10), Client(server.endpoint_url, timeout=10)
        await before.connect()
        number = await subscription(before, RequestedMaxKeepAliveCount=1)
        load(view, 1.0)
        await monitored(before, number, [item(await point(before, LOAD))])
        await told(before, 1)
        lost = [asyncio.create_task(published(before)) for _ in range(3)]
        await asyncio.sleep(0.1)
        (session,) = sessions(server)
        token = before.uaclient.protocol.authentication_token
        await after.connect_socket()
        await after.send_hello()
        await after.open_secure_channel()
        after.uaclient.session.restore_authentication_token(token)
        params = ua.ActivateSessionParameters()
        params.UserIdentityToken = ua.AnonymousIdentityToken(PolicyId="anonymous")
        await after.uaclient.activate_session(params)
        assert sessions(server) == [session]
        load(view, 2.0)
        assert [one.Value.Value for one in await told(after, 1)] == [2.0]
        # The old connection has lost the session, and takes nothing with it when it goes.
        with pytest.raises((ua.UaError, ConnectionError)):
            await ask(before, "Republish", SubscriptionId=number, RetransmitSequenceNumber=1)
        break_off(before)
        await asyncio.gather(*lost, return_exceptions=True)
        await asyncio.sleep(0.1)
        load(view, 3.0)
        assert [one.Value.Value for one in await told(after, 1)] == [3.0]
        again = await ask(after, "Republish", SubscriptionId=number, RetransmitSequenceNumber=1)
        assert [one.Value.Value for one in values(again.NotificationMessage)] == [1.0]
        await after.disconnect()

    async def test_asyncuas_own_client_repairs_itself(self, server: OpcUaServer, view: LocalView) -> None:
        came: asyncio.Queue[object] = asyncio.Queue()

        class Handler:
            def datachange_notification(self, node: object, value: object, data: object) -> None:
                came.put_nowait(value)

        async def until(value: float) -> None:
            async with asyncio.timeout(10):
                while await came.get() != value:
                    pass

        client = Client(server.endpoint_url, timeout=5)
        client.set_user("anna")
        client.set_password(PASSWORD)
        await client.connect(auto_reconnect=True)
        try:
            made = await client.create_subscription(50, Handler())
            load(view, 10.0)
            await made.subscribe_data_change(client.get_node(await point(client, LOAD)))
            await until(10.0)
            for number in (11.0, 12.0):
                cut(server)
                load(view, number)
                await until(number)
            load(view, 13.0)
            await until(13.0)
        finally:
            await client.disconnect()
