"""Methods of the Server object that the server carries out itself (OPC 10000-5 §9.1 and §9.2)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final

from bridge.uaserver.library import (
    ObjectIds,
    ServiceError,
    StatusCodes,
    get,
    make,
    node_id,
    status,
    ua,
    variant,
)
from bridge.uaserver.subscriptions.subscription import Subscription, SubscriptionOwner
from bridge.uaserver.subscriptions.subscriptions import Subscriptions

_SERVER: Final = node_id(ObjectIds.Server)
_HANDLE: Final = ua.VariantType.UInt32


_MOST_TOLD: Final = 100_000
"""Limit for the items that the answer to one request names."""


def _monitored_items(found: Subscription) -> list[ua.Variant]:
    """Numbers of the items, and what the client calls them."""
    items = found.items.values()
    return [
        variant([one.number for one in items], _HANDLE),
        variant([one.settings.client_handle for one in items], _HANDLE),
    ]


def _resend_data(found: Subscription) -> list[ua.Variant]:
    found.repeat_values()
    return []


SERVER_METHODS: Final[Mapping[ua.NodeId, Callable[[Subscription], list[ua.Variant]]]] = {
    node_id(ObjectIds.Server_GetMonitoredItems): _monitored_items,
    node_id(ObjectIds.Server_ResendData): _resend_data,
}
"""Methods by their NodeIds; each takes the number of a subscription."""


class ServerCalls:
    """Calls of ``SERVER_METHODS`` in one request of ``owner``."""

    def __init__(self, subscriptions: Subscriptions, owner: SubscriptionOwner) -> None:
        self._subscriptions = subscriptions
        self._owner = owner
        self._left = _MOST_TOLD

    def call(self, call: ua.CallMethodRequest) -> ua.CallMethodResult:
        given: Sequence[ua.Variant] = get(call, "InputArguments") or []
        if get(call, "ObjectId") != _SERVER:
            return _failed(StatusCodes.BadMethodInvalid)
        if len(given) != 1:
            return _failed(StatusCodes.BadTooManyArguments if given else StatusCodes.BadArgumentsMissing)
        if given[0].VariantType != _HANDLE or given[0].is_array:
            return _failed(StatusCodes.BadInvalidArgument, StatusCodes.BadTypeMismatch)
        try:
            found = self._subscriptions.own(self._owner, given[0].Value)
        except ServiceError as error:
            return _failed(_code_of(self._subscriptions, given[0].Value, error))
        self._left -= len(found.items)
        if self._left < 0:
            return _failed(StatusCodes.BadResponseTooLarge)
        results = SERVER_METHODS[get(call, "MethodId")](found)
        good = [status(StatusCodes.Good)]
        return make(ua.CallMethodResult, InputArgumentResults=good, OutputArguments=results)


def _code_of(subscriptions: Subscriptions, number: int, error: ServiceError) -> int:
    """Status code for a subscription that is not the caller's (§9.1)."""
    return StatusCodes.BadUserAccessDenied if number in subscriptions.subscriptions else int(error.code)


def _failed(code: int, *arguments: int) -> ua.CallMethodResult:
    faults = [status(one) for one in arguments]
    return make(ua.CallMethodResult, StatusCode=status(code), InputArgumentResults=faults)
