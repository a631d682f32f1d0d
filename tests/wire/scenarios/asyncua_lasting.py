"""Second part of asyncua's scenario: subscriptions, what the server says of itself, and its end."""

from __future__ import annotations

import asyncio
from typing import Any

from asyncua import Client, ua

from tests.support.certificates import CLIENT_URI
from tests.support.opcua_raw import ask, item, monitored, published, subscribed, told, values
from tests.support.opcua_site import break_off
from tests.support.scenario_plant import PASSWORD
from tests.wire.scenarios.asyncua_client import (
    POLICY,
    Ids,
    Session,
    code_of,
    logged_in,
    outcome,
    prepared,
    until,
)
from tests.wire.scenarios.steps import Steps


def _deadband(kind: ua.DeadbandType, value: float) -> ua.DataChangeFilter:
    return ua.DataChangeFilter(
        Trigger=ua.DataChangeTrigger.StatusValue, DeadbandType=kind, DeadbandValue=value
    )


async def subscriptions(steps: Steps) -> None:
    async with logged_in(steps, "anna") as client:
        anna = await Session.of(client)
        await _items(steps, anna)
        await _triggering(steps, anna)
    await _lost_connection(steps)
    await _transfer(steps)


async def _items(steps: Steps, anna: Session) -> None:
    client, drive = anna.client, f"{steps.first}/fu3"
    made = await subscribed(client, 1, RequestedLifetimeCount=1, RequestedMaxKeepAliveCount=7)
    revised = (made.RevisedPublishingInterval, made.RevisedLifetimeCount, made.RevisedMaxKeepAliveCount)
    steps.step("revised subscription", revised, (50, 21, 7))
    frequency, state = anna.id(f"{drive}/actual/frequency"), anna.id(f"{drive}/status/state")
    setpoint = anna.id(f"{drive}/command/setpoint_1")
    percent, beyond = (_deadband(ua.DeadbandType.Percent, value) for value in (5.0, 101.0))
    absolute = _deadband(ua.DeadbandType.Absolute, 500.0)
    wanted = [item(state, Filter=percent), item(frequency, Filter=beyond), item(setpoint, Filter=absolute)]
    codes = [code_of(one.StatusCode) for one in await monitored(client, made.SubscriptionId, wanted)]
    steps.step("deadbands", codes, ["BadDeadbandFilterInvalid", "BadDeadbandFilterInvalid", "Good"])
    seen = [(await told(client, 1))[0].Value.Value]
    for word in (1000, 1200, 2000):
        await anna.write(f"{drive}/command/setpoint_1", word)
        await asyncio.sleep(0.2)
    seen += [one.Value.Value for one in await told(client, 2)]
    steps.step("within a deadband of 500", seen, [0, 1000, 2000])
    await ask(client, "DeleteSubscriptions", SubscriptionIds=[made.SubscriptionId])


async def _triggering(steps: Steps, anna: Session) -> None:
    client, drive = anna.client, f"{steps.first}/fu3"
    number = (await subscribed(client)).SubscriptionId
    sampling = ua.MonitoringMode.Sampling
    both = [anna.id(f"{drive}/command/setpoint_1"), ua.NodeId(Ids.Server_NamespaceArray)]
    first, linked = await monitored(client, number, [item(both[0]), item(both[1], mode=sampling)])
    steps.step("first value of who triggers", len(await told(client, 1)), 1)
    links = await ask(
        client,
        "SetTriggering",
        SubscriptionId=number,
        TriggeringItemId=first.MonitoredItemId,
        LinksToAdd=[linked.MonitoredItemId, 4711],
    )
    codes = [code_of(one) for one in links.Parameters.AddResults]
    steps.step("links", codes, ["Good", "BadMonitoredItemIdInvalid"])
    await anna.write(f"{drive}/command/setpoint_1", 3000)
    found = [one.Value.Value for one in await told(client, 2)]
    steps.step(
        "triggered", [one[0] for one in found if isinstance(one, list)], ["http://opcfoundation.org/UA/"]
    )
    await ask(client, "DeleteSubscriptions", SubscriptionIds=[number])


async def _lost_connection(steps: Steps) -> None:
    """What was told into nothing is asked for again, in the same session on another connection."""
    client = await prepared(steps, "trusted")
    client.set_user("anna")
    client.set_password(PASSWORD)
    await client.connect()
    anna = await Session.of(client)
    point = f"{steps.first}/fu3/command/setpoint_1"
    number = (await subscribed(client)).SubscriptionId
    await monitored(client, number, [item(anna.id(point))])
    first = await published(client)
    token = client.uaclient.protocol.authentication_token
    break_off(client)
    async with logged_in(steps, "anna") as other:
        await (await Session.of(other)).write(point, 4000)
    back = await prepared(steps, "trusted")
    await back.connect_socket()
    await back.send_hello()
    await back.open_secure_channel()
    session = Session(back, anna.space)
    lost = await outcome(session.ask("Republish", SubscriptionId=number, RetransmitSequenceNumber=1))
    steps.step("without its session", lost, "BadSessionIdInvalid")
    back.uaclient.session.restore_authentication_token(token)
    back._server_nonce = client._server_nonce
    request = ua.ActivateSessionRequest()
    request.Parameters = _signed(back)
    await back.uaclient.protocol.send_request(request)
    again = await ask(back, "Republish", SubscriptionId=number, RetransmitSequenceNumber=1)
    same = values(again.NotificationMessage) == values(first.NotificationMessage)
    steps.step("republished", same, True)
    missing = await outcome(session.ask("Republish", SubscriptionId=number, RetransmitSequenceNumber=99))
    steps.step("nothing more to republish", missing, "BadMessageNotAvailable")
    (value,) = await told(back, 1)
    steps.step("what changed meanwhile", value.Value.Value, 4000)
    acked = await _acknowledged(back, number)
    steps.step("acknowledgements", acked, ["Good", "BadSequenceNumberUnknown", "BadSubscriptionIdInvalid"])
    await back.uaclient.close_session(True)
    break_off(back)


async def _acknowledged(client: Client, number: int) -> list[str]:
    answer = await published(client, (number, 1), (number, 77), (4711, 1))
    return [code_of(one) for one in answer.Results]


def _signed(client: Client) -> ua.ActivateSessionParameters:
    """The channel is encrypted, so that the password need not be."""
    made = ua.ActivateSessionParameters()
    made.UserIdentityToken = ua.UserNameIdentityToken(UserName="anna", Password=PASSWORD.encode())
    challenge = client.security_policy.peer_certificate + client._server_nonce
    made.ClientSignature.Algorithm = POLICY.AsymmetricSignatureURI
    made.ClientSignature.Signature = client.security_policy.asymmetric_cryptography.signature(challenge)
    return made


async def _transfer(steps: Steps) -> None:
    async with (
        logged_in(steps, "anna") as before,
        logged_in(steps, "otto") as stranger,
        logged_in(steps, "anna") as after,
    ):
        session = await Session.of(before)
        number = (await subscribed(before)).SubscriptionId
        await monitored(before, number, [item(session.id(f"{steps.first}/fu3/command/setpoint_1"))])
        await told(before, 1)
        waiting = asyncio.create_task(published(before))
        steps.step("transfer to somebody else", await _moved(stranger, number), "BadUserAccessDenied")
        steps.step("transfer of nothing", await _moved(after, 4711), "BadSubscriptionIdInvalid")
        steps.step("transfer", await _moved(after, number), "Good")
        (last,) = (await waiting).NotificationMessage.NotificationData
        steps.step("the old session is told", code_of(last.Status), "GoodSubscriptionTransferred")
        steps.step("the initial value", (await told(after, 1))[0].Value.Value, 4000)


async def _moved(client: Client, number: int) -> str:
    params: dict[str, Any] = {"SubscriptionIds": [number], "SendInitialValues": True}
    answer = await ask(client, "TransferSubscriptions", **params)
    return code_of(answer.Parameters.Results[0].StatusCode)


async def diagnostics(steps: Steps) -> None:
    async with logged_in(steps, "anna") as client, logged_in(steps, "eva") as engineer:
        anna, eva = await Session.of(client), await Session.of(engineer)
        summary = await anna.value(ua.NodeId(Ids.Server_ServerDiagnostics_ServerDiagnosticsSummary))
        steps.step("sessions are counted", summary.CurrentSessionCount >= 2, True)
        # Its own attempts: five of a channel that was never opened are none of them.
        steps.step("refused sessions are counted", summary.SecurityRejectedSessionCount >= 5, True)
        every = "Server_ServerDiagnostics_SessionsDiagnosticsSummary_SessionDiagnosticsArray"
        secret = "Server_ServerDiagnostics_SessionsDiagnosticsSummary_SessionSecurityDiagnosticsArray"
        sessions, secrets = (ua.NodeId(getattr(Ids, one)) for one in (every, secret))
        steps.step("sessions for an operator", await anna.value(sessions), "BadUserAccessDenied")
        steps.step("secrets for an operator", await anna.value(secrets), "BadUserAccessDenied")
        found = {one.ClientDescription.ApplicationUri for one in await eva.value(sessions)}
        steps.step("sessions for an engineer", CLIENT_URI in found, True)


async def read_through(steps: Steps) -> None:
    """What is set at the drive itself is known once somebody asks the drive."""
    async with logged_in(steps, "anna") as client:
        anna = await Session.of(client)
        where = ua.ReadValueId(NodeId=anna.id(f"{steps.first}/fu1/parameter/p102"), AttributeId=13)

        async def read(max_age: float) -> float:
            params = {"MaxAge": max_age, "TimestampsToReturn": ua.TimestampsToReturn.Both}
            (data,) = (await anna.ask("Read", NodesToRead=[where], **params)).Results
            return data.Value.Value

        steps.break_plant("turn_knob", steps.first, "700")
        await asyncio.sleep(0.2)
        steps.step("as it was read last", await read(600_000.0), 2.5)
        steps.step("as the drive has it", await read(0.0), 7.0)
        steps.step("as it was read then", await read(600_000.0), 7.0)


async def end_is_announced(steps: Steps) -> None:
    followed = {
        Ids.Server_ServiceLevel: "level",
        Ids.Server_ServerStatus_State: "state",
        Ids.Server_ServerStatus_SecondsTillShutdown: "seconds",
        Ids.Server_ServerStatus_ShutdownReason: "reason",
    }
    seen: list[tuple[str, Any]] = []

    class Handler:
        def datachange_notification(self, node: Any, value: Any, data: object) -> None:
            seen.append((followed[node.nodeid.Identifier], value))

        def status_change_notification(self, status: ua.StatusChangeNotification) -> None:
            seen.append(("status", code_of(status.Status)))

    client = await prepared(steps, "trusted", "de")
    client.set_user("anna")
    client.set_password(PASSWORD)
    await client.connect()
    anna = await Session.of(client)
    subscription = await client.create_subscription(50, Handler())
    await subscription.subscribe_data_change([client.get_node(ua.NodeId(one)) for one in followed])
    await until(lambda: len(seen) == len(followed), 10)
    steps.step("service level", ("level", 255) in seen, True)
    seen.clear()
    steps.say(waiting="end")
    await until(lambda: ("level", 0) in seen and any(what == "reason" for what, _ in seen), 120)
    first = dict(reversed(seen))
    steps.step("state", first["state"], ua.ServerState.Shutdown)
    steps.step("seconds till shutdown", first["seconds"], 2)
    steps.step("reason", first["reason"], ua.LocalizedText("die Bridge wird angehalten", "de"))
    point = f"{steps.first}/fu1/status/status_word"
    steps.step("served until the end", isinstance(await anna.value(point), int), True)
    reads = [await anna.value(point)]
    while reads[-1] not in ("closed", "Bad"):
        await asyncio.sleep(0.1)
        try:
            reads.append(await anna.value(point))
        except (ConnectionError, TimeoutError, ua.UaError):
            reads.append("closed")
    steps.step("no Bad before the end", {type(one) for one in reads[:-1]}, {int})
    seconds = [value for what, value in seen if what == "seconds"]
    steps.step("counted down", seconds[:2], [2, 1])
    # asyncua's client says so itself, once it has noticed that its connection is gone.
    await until(lambda: seen[-1:] == [("status", "BadShutdown")], 10)
    steps.step("the subscription is told", seen[-1:], [("status", "BadShutdown")])
    break_off(client)
