"""The services of a session: what each is given, how much of it at once, and who carries it out.

To asyncua's processor channels, sessions and discovery are left: of the other services it does some too
freely, or says Good and does less (``tests/wire/opcua/test_security.py`` and ``test_services.py``).
"""

# asyncua's decoder has no types:
# pyright: reportUnknownVariableType=false

from __future__ import annotations

import inspect
import logging
from collections.abc import Awaitable, Callable, Coroutine, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from asyncua.common.utils import Buffer
from asyncua.ua.ua_binary import struct_from_binary

from bridge.uaserver.browsing import Browser
from bridge.uaserver.decoding import decoded, first_length
from bridge.uaserver.encoding import UNSENDABLE, Results
from bridge.uaserver.explanations import Explain, Explanation, add_explanations, fault
from bridge.uaserver.history.historyread import MOST_NODES
from bridge.uaserver.library import ExplainedFault, ServiceError, StatusCodes, change, get, make, ua
from bridge.uaserver.loop import loop_time
from bridge.uaserver.services import request_type
from bridge.uaserver.session import Session
from bridge.uaserver.subscriptions.monitoring import MonitoredItems
from bridge.uaserver.subscriptions.publishing import MOST_BYTES, PublishRequest
from bridge.uaserver.subscriptions.subscription import Subscription
from bridge.uaserver.subscriptions.subscriptions import Subscriptions

MOST_OPERATIONS: Final = 10_000
MOST_CALLS: Final = 100
MOST_WRITES: Final = 1_000
"""Limit for one request: writes are begun at once, so that none is overtaken, and others wait meanwhile."""

_log = logging.getLogger(__name__)

_Act = Callable[[Session, Any], Any]
"""Given the session and the parameters of the request."""
_ExplainingAct = Callable[[Session, Any, Explain], Any]


@dataclass(frozen=True, slots=True)
class ServiceRequest:
    """Request on a connection. ``send`` takes the response, ``is_open`` says whether it still can. ``defer``
    has the rest of it done while others are answered."""

    header: Any
    body: Buffer
    send: Callable[[Any], None]
    is_open: Callable[[], bool]
    defer: Callable[[Coroutine[Any, Any, None]], Awaitable[None]]


_Begin = Callable[[Session, Any, ServiceRequest], Awaitable[None] | None]
"""Given the session and the parameters of the request, which it answers itself, at once or later."""


@dataclass(frozen=True, slots=True)
class Route:
    """``operations`` are the fields of the parameters that have them, ``most`` how many there may be. What
    ``act`` returns is the field ``answer`` of the response; ``explain`` is an ``act`` that can explain what
    it refuses, and ``begin`` answers itself. A route has one of the three."""

    name: str
    act: _Act | None
    operations: str = ""
    answer: str = "Results"
    most: int = MOST_OPERATIONS
    explain: _ExplainingAct | None = None
    begin: _Begin | None = None

    async def carry_out(self, session: Session, request: ServiceRequest) -> None:
        """Raises ServiceError for what is to be answered as a fault."""
        kind, fields = get(ua, f"{self.name}Parameters"), self.operations.split()
        if self.explain is not None:
            # What commands is decoded at once, so that no later request comes before it: it is short.
            _limit(first_length(request.body), self.most)
            params = struct_from_binary(kind, request.body)
        else:
            params = await decoded(kind, fields, request.body)
        operations = sum(len(get(params, field) or ()) for field in fields)
        if self.operations:
            _limit(operations, self.most)
        if self.begin is not None:
            begun = self.begin(session, params, request)
            if begun is not None:
                await begun
            return
        explained: dict[int, Explanation] = {}
        if self.explain is not None:
            result = self.explain(session, params, explained.__setitem__)
        else:
            assert self.act, "a route has one of the three"
            result = self.act(session, params)
        if inspect.isawaitable(result):
            result = await result
        response = get(ua, f"{self.name}Response")()
        if self.answer:
            *above, field = self.answer.split(".")
            if field == "Results" and self.explain is None and not isinstance(result, Results):
                result = await _encoded(session, result)
            change(get(response, above[0]) if above else response, **{field: result})
        if explained:
            add_explanations(request.header, response, explained, operations)
        request.send(response)


async def _encoded(session: Session, found: Iterable[object]) -> Results:
    results = session.answer = Results(session.most_bytes)
    for one in found:
        await results.add(one)
    return results


async def _browse(session: Session, params: Any) -> Results:
    results = session.answer = Results(session.most_bytes)
    await session.browser.browse(params, results)
    return results


async def _read(session: Session, params: ua.ReadParameters, request: ServiceRequest) -> None:
    stale = session.stale(params)
    if stale:
        await request.defer(_read_through(session, params, request, stale))
    else:
        await _answer_read(session, params, request, {})


async def _read_through(
    session: Session, params: ua.ReadParameters, request: ServiceRequest, stale: Sequence[ua.NodeId]
) -> None:
    async with session.refreshing:
        refused = await session.application.refresh(session.identity, stale)
        await _answer_read(session, params, request, refused)


async def _answer_read(
    session: Session,
    params: ua.ReadParameters,
    request: ServiceRequest,
    refused: Mapping[ua.NodeId, tuple[ua.StatusCode, Explanation]],
) -> None:
    explained: dict[int, Explanation] = {}
    results = await session.read_attributes(params, refused, explained.__setitem__)
    response = make(ua.ReadResponse, Results=results)
    add_explanations(request.header, response, explained, results.count)
    request.send(response)


def _write(session: Session, params: Any, explain: Explain) -> Any:
    return session.application.write(session.identity, get(params, "NodesToWrite"), explain)


def _call(session: Session, params: Any, explain: Explain) -> Any:
    return session.call_methods(get(params, "MethodsToCall"), explain)


def _cancel(session: Session, params: Any) -> ua.CancelResult:
    return make(ua.CancelResult, CancelCount=session.cancel(get(params, "RequestHandle")))


def _publish(session: Session, params: ua.PublishParameters, request: ServiceRequest) -> None:
    acknowledged: list[ua.SubscriptionAcknowledgement] = get(params, "SubscriptionAcknowledgements") or []

    def answer(result: ua.PublishResult) -> None:
        try:
            request.send(make(ua.PublishResponse, Parameters=result))
        except ServiceError as error:
            refuse(int(error.code))
        except UNSENDABLE as error:
            _log.warning("a message of a subscription cannot be sent: %r", error)
            refuse(StatusCodes.BadEncodingError)

    def refuse(code: int) -> None:
        request.send(fault(request.header, code))

    hint_ms: int = request.header.TimeoutHint
    expires_at = loop_time() + hint_ms / 1000 if hint_ms else float("inf")
    # Half of what the client accepts: the last notification may go beyond the limit.
    most_bytes = min(MOST_BYTES, session.most_bytes // 2)
    handle: int = request.header.RequestHandle
    waiting = PublishRequest(expires_at, request.is_open, answer, refuse, most_bytes, handle)
    session.subscriptions.publish(session, acknowledged, waiting)


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
        Route("Read", None, "NodesToRead", begin=_read),
        Route("HistoryRead", Session.read_history, "NodesToRead", most=MOST_NODES),
        Route("Write", None, "NodesToWrite", most=MOST_WRITES, explain=_write),
        Route("Call", None, "MethodsToCall", most=MOST_CALLS, explain=_call),
        Route("CreateSubscription", Session.subscribe, answer="Parameters"),
        Route("ModifySubscription", _subscription(Subscriptions.modify), answer="Parameters"),
        Route(
            "SetPublishingMode", _subscription(Subscriptions.set_publishing_mode), "SubscriptionIds", _RESULTS
        ),
        Route("Publish", None, begin=_publish),
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
        why = f"{operations} operations, where one request may have {most}"
        raise ExplainedFault(StatusCodes.BadTooManyOperations, why)
