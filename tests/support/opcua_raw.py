"""OPC UA services as they are on the wire, without what asyncua's client makes of them."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import Any

from asyncua import Client, ua
from asyncua.ua.ua_binary import nodeid_from_binary, struct_from_binary

from bridge.northbound.opcua.server import OpcUaServer
from bridge.uaserver.session import Session


async def ask(client: Client, service: str, **params: object) -> Any:
    """The response of a service. Raises UaStatusCodeError for a service fault."""
    return await _ask(client, service, 0, params)


async def explained(client: Client, service: str, **params: object) -> Any:
    """The response of a service whose operations are to be explained with all that there is."""
    return await _ask(client, service, 0xE0, params)


async def answered(client: Client, request: Any) -> Any:
    """The response to a request, also where it is a fault: as it is on the wire."""
    future = client.uaclient.protocol._send_request(request, 10)  # pyright: ignore[reportPrivateUsage]
    data = await asyncio.wait_for(future, 10)
    kind = nodeid_from_binary(data.copy())
    return struct_from_binary(ua.extension_objects_by_typeid[kind], data)


def asking(service: str, diagnostics: int = 0, **params: object) -> Any:
    """Request of a service; ``diagnostics`` are its ``returnDiagnostics``."""
    request = getattr(ua, f"{service}Request")()
    request.RequestHeader.ReturnDiagnostics = diagnostics
    for name, value in params.items():
        setattr(request.Parameters, name, value)
    return request


async def _ask(client: Client, service: str, diagnostics: int, params: dict[str, object]) -> Any:
    data = await client.uaclient.protocol.send_request(asking(service, diagnostics, **params))
    return struct_from_binary(getattr(ua, f"{service}Response"), data)


async def subscribed(
    client: Client, interval_ms: float = 50, **params: object
) -> ua.CreateSubscriptionResult:
    asked = {
        "RequestedPublishingInterval": interval_ms,
        "RequestedLifetimeCount": 1000,
        "RequestedMaxKeepAliveCount": 100,
        "PublishingEnabled": True,
    } | params
    return (await ask(client, "CreateSubscription", **asked)).Parameters


def item(
    node: ua.NodeId,
    attribute: int = ua.AttributeIds.Value,
    index_range: str | None = None,
    mode: ua.MonitoringMode = ua.MonitoringMode.Reporting,
    **asked: object,
) -> ua.MonitoredItemCreateRequest:
    target = ua.ReadValueId(NodeId=node, AttributeId=attribute, IndexRange=index_range)
    settings = ua.MonitoringParameters(**({"ClientHandle": 7, "QueueSize": 10} | asked))
    return ua.MonitoredItemCreateRequest(target, mode, settings)


async def monitored(
    client: Client, subscription: int, items: Sequence[ua.MonitoredItemCreateRequest], **params: object
) -> list[ua.MonitoredItemCreateResult]:
    asked = {"SubscriptionId": subscription, "ItemsToCreate": list(items)}
    times = {"TimestampsToReturn": ua.TimestampsToReturn.Both}
    return (await ask(client, "CreateMonitoredItems", **(times | asked | params))).Results


async def published(client: Client, *acknowledged: tuple[int, int]) -> ua.PublishResult:
    acks = [ua.SubscriptionAcknowledgement(*one) for one in acknowledged]
    return (await ask(client, "Publish", SubscriptionAcknowledgements=acks)).Parameters


def values(message: ua.NotificationMessage) -> list[ua.DataValue]:
    return [
        one.Value
        for data in message.NotificationData
        if isinstance(data, ua.DataChangeNotification)
        for one in data.MonitoredItems
    ]


async def told(client: Client, count: int) -> list[ua.DataValue]:
    """Publish until so many values have come."""
    found: list[ua.DataValue] = []
    while len(found) < count:
        found += values((await published(client)).NotificationMessage)
    return found


def sessions(server: OpcUaServer) -> list[Session]:
    return list(server._server.iserver._external_sessions.values())  # pyright: ignore


def cut(server: OpcUaServer) -> None:
    """Every connection is gone, as when a switch is."""
    for connection in list(server._server.bserver.clients):  # pyright: ignore
        connection.transport.abort()
