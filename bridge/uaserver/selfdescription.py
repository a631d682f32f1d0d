"""Self-description of the server in namespace 0, where asyncua leaves it empty or wrong.

Nothing is Good and null: what is not known is BadNotSupported as a value, and no other attribute is there
without one (BadAttributeIdInvalid).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Final

from asyncua.server.address_space import AddressSpace, AttributeValue

from bridge.uaserver.address_space import access_level_ex, constant, is_empty
from bridge.uaserver.browsing import MOST_CONTINUATION_POINTS
from bridge.uaserver.conformance import claimed
from bridge.uaserver.filters.eventfilter import MOST_FIELDS
from bridge.uaserver.filters.where import MOST_OPERANDS
from bridge.uaserver.history import historyread
from bridge.uaserver.library import (
    AttributeIds,
    ObjectIds,
    StatusCodes,
    data_value,
    get,
    node_id,
    status,
    ua,
    variant,
)
from bridge.uaserver.routes import MOST_CALLS, MOST_WRITES
from bridge.uaserver.serverstatus import HEALTHY, UNKNOWN_TIME
from bridge.uaserver.subscriptions.items import LEAST_SAMPLING_MS, VALUE_QUEUE
from bridge.uaserver.subscriptions.quotas import (
    MOST_ITEMS,
    MOST_ITEMS_OF_ADDRESS,
    MOST_OF_SESSION,
    MOST_SESSIONS,
    MOST_SUBSCRIPTIONS,
)

_Type = ua.VariantType
_STATUS: Final = "Server_ServerStatus_"
_CAN: Final = "Server_ServerCapabilities_"
_AT_ONCE: Final = f"{_CAN}OperationLimits_"
_HISTORY: Final = "HistoryServerCapabilities_"
_CHANGES_OF_HISTORY: Final = (
    "InsertData",
    "ReplaceData",
    "UpdateData",
    "DeleteRaw",
    "DeleteAtTime",
    "InsertEvent",
    "ReplaceEvent",
    "UpdateEvent",
    "DeleteEvent",
    "InsertAnnotation",
)

LOCALES: Final = f"{_CAN}LocaleIdArray"

VALUES: Final[Mapping[str, ua.Variant]] = {
    f"{_STATUS}SecondsTillShutdown": variant(0, _Type.UInt32),
    f"{_STATUS}ShutdownReason": variant(ua.LocalizedText(), _Type.LocalizedText),
    "Server_ServiceLevel": variant(HEALTHY, _Type.Byte),
    "Server_EstimatedReturnTime": variant(UNKNOWN_TIME, _Type.DateTime),
    "Server_Auditing": variant(False, _Type.Boolean),
    f"{_CAN}ServerProfileArray": variant(claimed(), _Type.String),
    f"{_CAN}MaxBrowseContinuationPoints": variant(MOST_CONTINUATION_POINTS, _Type.UInt16),
    f"{_CAN}MaxQueryContinuationPoints": variant(0, _Type.UInt16),
    f"{_CAN}MaxHistoryContinuationPoints": variant(historyread.MOST_CONTINUATION_POINTS, _Type.UInt16),
    f"{_CAN}MinSupportedSampleRate": variant(LEAST_SAMPLING_MS, _Type.Double),
    f"{_CAN}MaxSessions": variant(MOST_SESSIONS, _Type.UInt32),
    f"{_CAN}MaxSubscriptions": variant(MOST_SUBSCRIPTIONS, _Type.UInt32),
    f"{_CAN}MaxSubscriptionsPerSession": variant(MOST_OF_SESSION, _Type.UInt32),
    f"{_CAN}MaxMonitoredItems": variant(MOST_ITEMS, _Type.UInt32),
    f"{_CAN}MaxMonitoredItemsPerSubscription": variant(MOST_ITEMS_OF_ADDRESS, _Type.UInt32),
    f"{_CAN}MaxMonitoredItemsQueueSize": variant(VALUE_QUEUE, _Type.UInt32),
    f"{_CAN}MaxSelectClauseParameters": variant(MOST_FIELDS, _Type.UInt32),
    f"{_CAN}MaxWhereClauseParameters": variant(MOST_OPERANDS, _Type.UInt32),
    f"{_AT_ONCE}MaxNodesPerWrite": variant(MOST_WRITES, _Type.UInt32),
    f"{_AT_ONCE}MaxNodesPerMethodCall": variant(MOST_CALLS, _Type.UInt32),
    f"{_AT_ONCE}MaxNodesPerHistoryReadData": variant(historyread.MOST_NODES, _Type.UInt32),
    f"{_AT_ONCE}MaxNodesPerHistoryReadEvents": variant(historyread.MOST_NODES, _Type.UInt32),
    f"{_HISTORY}AccessHistoryDataCapability": variant(True, _Type.Boolean),
    f"{_HISTORY}AccessHistoryEventsCapability": variant(True, _Type.Boolean),
    f"{_HISTORY}MaxReturnDataValues": variant(historyread.MOST_VALUES, _Type.UInt32),
    f"{_HISTORY}MaxReturnEventValues": variant(historyread.MOST_VALUES, _Type.UInt32),
    f"{_HISTORY}ServerTimestampSupported": variant(False, _Type.Boolean),
    **{f"{_HISTORY}{name}Capability": variant(False, _Type.Boolean) for name in _CHANGES_OF_HISTORY},
    "Server_ServerDiagnostics_EnabledFlag": variant(True, _Type.Boolean),
    "Server_ServerRedundancy_RedundancySupport": variant(ua.RedundancySupport.None_, _Type.Int32),
}
"""Values by the names of the nodes."""

NOT_DONE: Final = (
    f"{_AT_ONCE}MaxNodesPerHistoryUpdateData",
    f"{_AT_ONCE}MaxNodesPerHistoryUpdateEvents",
    f"{_AT_ONCE}MaxNodesPerNodeManagement",
)
"""Limits that asyncua gives to services which are refused."""

_NOTHING: Final = variant(None, _Type.Null)


def describe(space: AddressSpace, locales: Sequence[str]) -> None:
    """Give the nodes of asyncua's in ``space`` the values that are true, and take away what is empty.
    ``locales`` are those of its texts, the first for who asks for none of them."""
    now = datetime.now(UTC)
    for name, value in {**VALUES, LOCALES: variant(list(locales), _Type.String)}.items():
        attributes = space[node_id(get(ObjectIds, name))].attributes
        attributes[AttributeIds.Value] = AttributeValue(data_value(value, None, now))
    for name in NOT_DONE:
        attributes = space[node_id(get(ObjectIds, name))].attributes
        attributes[AttributeIds.Value].value = data_value(_NOTHING)
    for node in get(space, "_nodes").values():
        _settle(node.attributes)


def _settle(attributes: dict[AttributeIds, AttributeValue]) -> None:
    node_class = attributes[AttributeIds.NodeClass].value
    assert node_class and node_class.Value
    is_variable = node_class.Value.Value == ua.NodeClass.Variable
    for attribute in [one for one, held in attributes.items() if is_empty(held)]:
        if is_variable and attribute == AttributeIds.Value:
            refused = data_value(_NOTHING, status(StatusCodes.BadNotSupported))
            attributes[attribute].value = refused
        else:
            del attributes[attribute]
    access = attributes.get(AttributeIds.AccessLevel)
    if access and access.value and access.value.Value:
        extended = access_level_ex(access.value.Value.Value)
        attributes[AttributeIds.AccessLevelEx] = constant(extended, _Type.UInt32)
