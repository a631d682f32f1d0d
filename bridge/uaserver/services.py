"""Services of OPC 10000-4 that are carried out, and the answers to all others.

The processor asks this table before it looks into a request, and ``docs/reference/opcua.md`` shows it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from bridge.uaserver.library import ObjectIds, StatusCodes, get, node_id, ua


@dataclass(frozen=True, slots=True)
class Service:
    """``refused`` is the status code that every request is answered with, None for what is done."""

    name: str
    how: str
    refused: int | None = None


def request_type(name: str) -> ua.NodeId:
    """The type of a service's requests as it is on the wire."""
    return node_id(get(ObjectIds, f"{name}Request_Encoding_DefaultBinary"))


def _no(name: str, why: str, code: int = StatusCodes.BadServiceUnsupported) -> Service:
    return Service(name, why, code)


SERVICES: Final[Mapping[str, tuple[Service, ...]]] = {
    "Discovery": (
        Service("FindServers", "names this server alone, where `serverUris` has its URI or none"),
        _no("FindServersOnNetwork", "this is no discovery server"),
        Service("GetEndpoints", "those of the transport profiles that are asked for"),
        _no("RegisterServer", "this is no discovery server"),
        _no("RegisterServer2", "this is no discovery server"),
    ),
    "SecureChannel": (
        Service("OpenSecureChannel", "new channels and renewals"),
        Service("CloseSecureChannel", "closes the connection"),
    ),
    "Session": (
        Service("CreateSession", "one for each connection"),
        Service(
            "ActivateSession",
            "also on a new connection, by the same user: the session and its subscriptions move there",
        ),
        Service(
            "CloseSession",
            "without `deleteSubscriptions`, and after a time-out, they live on for their lifetime, for a "
            "transfer",
        ),
        Service(
            "Cancel",
            "Publish requests that wait, and a Read that waits for a drive, are answered with "
            "BadRequestCancelledByClient; a Write or Call is carried out and has its outcome",
        ),
    ),
    "NodeManagement": (
        _no("AddNodes", "the address space follows from the site file"),
        _no("AddReferences", "as above"),
        _no("DeleteNodes", "as above"),
        _no("DeleteReferences", "as above"),
    ),
    "View": (
        Service("Browse", "with continuation points, masks and subtypes; without views (BadViewIdUnknown)"),
        Service("BrowseNext", "goes on where Browse stopped, or releases the continuation point"),
        Service("TranslateBrowsePathsToNodeIds", "each target once"),
        Service("RegisterNodes", "gives back the NodeIds as they are: nothing would make them faster"),
        Service("UnregisterNodes", "see RegisterNodes"),
    ),
    "Query": (
        _no("QueryFirst", "browse instead"),
        _no("QueryNext", "as above"),
    ),
    "Attribute": (
        Service(
            "Read",
            "what the bridge knows now, and with `maxAge` 0 what the drives hold of [parameters](#writing); "
            "`timestampsToReturn` and `indexRange` count; `dataEncoding` is ignored, as Part 4 §7.29 says",
        ),
        Service(
            "HistoryRead",
            "raw, at times and events, see [History](opcua-history.md); anything else "
            "BadHistoryOperationUnsupported",
        ),
        Service("Write", "see [Writing](#writing); with an `indexRange` BadWriteNotSupported"),
        _no("HistoryUpdate", "history is only read", StatusCodes.BadHistoryOperationUnsupported),
    ),
    "Method": (
        Service(
            "Call",
            "the [methods](#methods-of-a-drive) of drives, nodes, buses and [alarms](opcua-alarms.md), "
            "GetMonitoredItems and ResendData; all others are BadMethodInvalid",
        ),
    ),
    "MonitoredItem": (
        Service("CreateMonitoredItems", "every attribute, events; see [Subscriptions](#subscriptions)"),
        Service("ModifyMonitoredItems", "all parameters"),
        Service("SetMonitoringMode", "disabled, sampling, reporting"),
        Service(
            "SetTriggering",
            "what a linked item has queued is told once, at the end of the publishing interval; at most "
            "2000 links of a subscription, else BadResourceUnavailable",
        ),
        Service("DeleteMonitoredItems", "what is queued of them goes, too"),
    ),
    "Subscription": (
        Service("CreateSubscription", "see [Subscriptions](#subscriptions)"),
        Service("ModifySubscription", "all parameters; counts from the next publishing interval on"),
        Service("SetPublishingMode", "what is queued stays queued meanwhile"),
        Service("Publish", "an acknowledgement of what is not there is BadSequenceNumberUnknown"),
        Service("Republish", "the same message again until it is acknowledged, else BadMessageNotAvailable"),
        Service(
            "TransferSubscriptions",
            "to a session of the same user; without a name to the same certificate; else BadUserAccessDenied",
        ),
        Service("DeleteSubscriptions", "Publish requests that wait are answered with the last one"),
    ),
}
"""Services by service set, in the order of Part 4 §5."""

NAMES: Final[Mapping[ua.NodeId, str]] = {
    request_type(service.name): service.name for services in SERVICES.values() for service in services
}

REFUSED: Final[Mapping[ua.NodeId, int]] = {
    request_type(service.name): service.refused
    for services in SERVICES.values()
    for service in services
    if service.refused is not None
}
