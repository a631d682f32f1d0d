"""Services that asyncua's processor answers by itself, or not at all, and that are carried out here."""

# asyncua's decoder has no types:
# pyright: reportUnknownVariableType=false

from __future__ import annotations

import logging
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from asyncua.common.utils import Buffer
from asyncua.ua.ua_binary import struct_from_binary

from bridge.northbound.opcua.library import (
    ObjectIds,
    ServiceError,
    StatusCodes,
    UaError,
    change,
    get,
    make,
    node_id,
    status,
    ua,
)
from bridge.northbound.opcua.monitoring import loop_time
from bridge.northbound.opcua.publishing import MOST_BYTES, PublishRequest
from bridge.northbound.opcua.session import MOST_OPERATIONS, Session

_log = logging.getLogger(__name__)

_BROWSE_NEXT: Final = node_id(ObjectIds.BrowseNextRequest_Encoding_DefaultBinary)
_REGISTER: Final = node_id(ObjectIds.RegisterNodesRequest_Encoding_DefaultBinary)
_UNREGISTER: Final = node_id(ObjectIds.UnregisterNodesRequest_Encoding_DefaultBinary)
_PUBLISH: Final = node_id(ObjectIds.PublishRequest_Encoding_DefaultBinary)
ROUTES: Final = frozenset((_BROWSE_NEXT, _REGISTER, _UNREGISTER, _PUBLISH))

_UNSENDABLE: Final = (UaError, ValueError, TypeError, AttributeError, struct.error)


@dataclass(frozen=True, slots=True)
class Request:
    """One that came on a connection. ``send`` takes the response, ``is_open`` says whether it still can."""

    header: Any
    body: Buffer
    send: Callable[[Any], None]
    is_open: Callable[[], bool]


async def carry_out(session: Session, typeid: ua.NodeId, request: Request) -> None:
    """Carry out one of ``ROUTES``. Raises ServiceError for what is to be answered as a fault."""
    if typeid == _PUBLISH:
        _publish(session, request)
    elif typeid == _BROWSE_NEXT:
        params = struct_from_binary(ua.BrowseNextParameters, request.body)
        results = await session.browse_next(params)
        request.send(make(ua.BrowseNextResponse, Parameters=make(ua.BrowseNextResult, Results=results)))
    elif typeid == _REGISTER:
        params = struct_from_binary(ua.RegisterNodesParameters, request.body)
        nodes = await session.register_nodes(get(params, "NodesToRegister"))
        told = make(ua.RegisterNodesResult, RegisteredNodeIds=nodes)
        request.send(make(ua.RegisterNodesResponse, Parameters=told))
    else:
        params = struct_from_binary(ua.UnregisterNodesParameters, request.body)
        await session.unregister_nodes(get(params, "NodesToUnregister"))
        request.send(ua.UnregisterNodesResponse())


def _publish(session: Session, request: Request) -> None:
    params = struct_from_binary(ua.PublishParameters, request.body)
    acknowledged: list[ua.SubscriptionAcknowledgement] = get(params, "SubscriptionAcknowledgements") or []
    if len(acknowledged) > MOST_OPERATIONS:
        raise ServiceError(StatusCodes.BadTooManyOperations)

    def answer(result: ua.PublishResult) -> None:
        try:
            request.send(make(ua.PublishResponse, Parameters=result))
        except ServiceError as error:
            refuse(int(error.code))
        except _UNSENDABLE as error:
            _log.warning("a message of a subscription cannot be sent: %r", error)
            refuse(StatusCodes.BadEncodingError)

    def refuse(code: int) -> None:
        fault = ua.ServiceFault()
        change(get(fault, "ResponseHeader"), ServiceResult=status(code))
        request.send(fault)

    hint_ms: int = request.header.TimeoutHint
    expires_at = loop_time() + hint_ms / 1000 if hint_ms else float("inf")
    # Half: one more notification may go beyond it.
    most_bytes = min(MOST_BYTES, session.most_bytes // 2)
    waiting = PublishRequest(expires_at, request.is_open, answer, refuse, most_bytes)
    session.subscriptions.publish(session, acknowledged, waiting)
