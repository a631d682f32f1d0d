"""The services of a session: what each is given, how much of it at once, and who carries it out.

To asyncua's processor channels, sessions and discovery are left: of the other services it does some too
freely, or says Good and does less (``tests/wire/opcua/test_security.py`` and ``test_services.py``).
"""

# asyncua's decoder has no types:
# pyright: reportUnknownVariableType=false

from __future__ import annotations

import inspect
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from asyncua.common.utils import Buffer
from asyncua.ua.ua_binary import struct_from_binary

from bridge.uaserver.browsing import Browser
from bridge.uaserver.encoding import UNSENDABLE, Results
from bridge.uaserver.library import ServiceError, StatusCodes, change, get, make, status, ua
from bridge.uaserver.monitoring import MonitoredItems, loop_time
from bridge.uaserver.publishing import MOST_BYTES, PublishRequest
from bridge.uaserver.services import request_type
from bridge.uaserver.session import Session
from bridge.uaserver.subscription import Subscription
from bridge.uaserver.subscriptions import Subscriptions

MOST_OPERATIONS: Final = 10_000
MOST_CALLS: Final = 100

_log = logging.getLogger(__name__)

_Act = Callable[[Session, Any], Any]
"""Given the session and the parameters of the request."""


@dataclass(frozen=True, slots=True)
class ServiceRequest:
    """Request on a connection. ``send`` takes the response, ``is_open`` says whether it still can."""

    header: Any
    body: Buffer
    send: Callable[[Any], None]
    is_open: Callable[[], bool]


@dataclass(frozen=True, slots=True)
class Route:
    """``operations`` are the fields of the parameters that have them, ``most`` how many there may be. What
    ``act`` returns is the field ``answer`` of the response. Without it a Publish request waits until there is
    something to tell."""

    name: str
    act: _Act | None
    operations: str = ""
    answer: str = "Results"
    most: int = MOST_OPERATIONS

    async def carry_out(self, session: Session, request: ServiceRequest) -> None:
        """Raises ServiceError for what is to be answered as a fault."""
        params = struct_from_binary(get(ua, f"{self.name}Parameters"), request.body)
        if self.operations:
            _limit(sum(len(get(params, field) or ()) for field in self.operations.split()), self.most)
        if self.act is None:
            _publish(session, params, request)
            return
        result = self.act(session, params)
        if inspect.isawaitable(result):
            result = await result
        response = get(ua, f"{self.name}Response")()
        if self.answer:
            *above, field = self.answer.split(".")
            change(get(response, above[0]) if above else response, **{field: result})
        request.send(response)


async def _browse(session: Session, params: Any) -> Results:
    results = session.answer = Results(session.most_bytes)
    await session.browser.browse(params, results)
    return results


def _write(session: Session, params: Any) -> Any:
    return session.application.write(session.identity, get(params, "NodesToWrite"))


def _call(session: Session, params: Any) -> Any:
    return session.application.call(session.identity, get(params, "MethodsToCall"))


def _cancel(session: Session, params: Any) -> ua.CancelResult:
    return make(ua.CancelResult, CancelCount=session.publishing.cancel(get(params, "RequestHandle")))


def _view(act: Callable[[Browser, Any], Any]) -> _Act:
    return lambda session, params: act(session.browser, params)


def _subscription(act: Callable[[Subscriptions, Session, Any], Any]) -> _Act:
    return lambda session, params: act(session.subscriptions, session, params)


def _items(act: Callable[[MonitoredItems, Subscription, Any], Any]) -> _Act:
    def act_on(session: Session, params: Any) -> Any:
        subscriptions = session.subscriptions
        return act(subscriptions.items, subscriptions.own(session, get(params, "SubscriptionId")), params)

    return act_on


_RESULTS: Final = "Parameters.Results"

ROUTES: Final[Mapping[ua.NodeId, Route]] = {
    request_type(route.name): route
    for route in (
        Route("Cancel", _cancel, answer="Parameters"),
        Route("Browse", _browse, "NodesToBrowse"),
        Route("BrowseNext", _view(Browser.browse_next), "ContinuationPoints", _RESULTS),
        Route("TranslateBrowsePathsToNodeIds", _view(Browser.translate), "BrowsePaths"),
        Route(
            "RegisterNodes",
            lambda session, params: get(params, "NodesToRegister"),
            "NodesToRegister",
            "Parameters.RegisteredNodeIds",
        ),
        Route("UnregisterNodes", lambda session, params: None, "NodesToUnregister", ""),
        Route("Read", Session.read_attributes, "NodesToRead"),
        Route("Write", _write, "NodesToWrite"),
        Route("Call", _call, "MethodsToCall", most=MOST_CALLS),
        Route("CreateSubscription", Session.subscribe, answer="Parameters"),
        Route("ModifySubscription", _subscription(Subscriptions.modify), answer="Parameters"),
        Route(
            "SetPublishingMode", _subscription(Subscriptions.set_publishing_mode), "SubscriptionIds", _RESULTS
        ),
        Route("Publish", None),
        Route("Republish", _subscription(Subscriptions.republish), answer="NotificationMessage"),
        Route("TransferSubscriptions", _subscription(Subscriptions.transfer), "SubscriptionIds", _RESULTS),
        Route("DeleteSubscriptions", _subscription(Subscriptions.delete), "SubscriptionIds"),
        Route("CreateMonitoredItems", _subscription(Subscriptions.create_items), "ItemsToCreate"),
        Route("ModifyMonitoredItems", _items(MonitoredItems.modify), "ItemsToModify"),
        Route("SetMonitoringMode", _items(MonitoredItems.set_mode), "MonitoredItemIds", _RESULTS),
        Route(
            "SetTriggering",
            _items(MonitoredItems.set_triggering),
            "LinksToRemove LinksToAdd",
            "Parameters",
        ),
        Route("DeleteMonitoredItems", _items(MonitoredItems.delete), "MonitoredItemIds"),
    )
}
"""Routes by the type of the requests."""


def _limit(operations: int, most: int) -> None:
    if not operations:
        raise ServiceError(StatusCodes.BadNothingToDo)
    if operations > most:
        raise ServiceError(StatusCodes.BadTooManyOperations)


def _publish(session: Session, params: ua.PublishParameters, request: ServiceRequest) -> None:
    acknowledged: list[ua.SubscriptionAcknowledgement] = get(params, "SubscriptionAcknowledgements") or []
    if len(acknowledged) > MOST_OPERATIONS:
        raise ServiceError(StatusCodes.BadTooManyOperations)

    def answer(result: ua.PublishResult) -> None:
        try:
            request.send(make(ua.PublishResponse, Parameters=result))
        except ServiceError as error:
            refuse(int(error.code))
        except UNSENDABLE as error:
            _log.warning("a message of a subscription cannot be sent: %r", error)
            refuse(StatusCodes.BadEncodingError)

    def refuse(code: int) -> None:
        fault = ua.ServiceFault()
        change(get(fault, "ResponseHeader"), ServiceResult=status(code))
        request.send(fault)

    hint_ms: int = request.header.TimeoutHint
    expires_at = loop_time() + hint_ms / 1000 if hint_ms else float("inf")
    # Half of what the client accepts: the last notification may go beyond the limit.
    most_bytes = min(MOST_BYTES, session.most_bytes // 2)
    handle: int = request.header.RequestHandle
    waiting = PublishRequest(expires_at, request.is_open, answer, refuse, most_bytes, handle)
    session.subscriptions.publish(session, acknowledged, waiting)
