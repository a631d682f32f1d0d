"""Answers to a request in each state of the session that it is for (OPC 10000-4 §5.6 and §7.38).

Clients go by these codes: on BadSessionIdInvalid they make a new session, on BadSessionNotActivated they
activate the one that they have. ``docs/reference/opcua.md`` shows the table.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Final

from bridge.uaserver.library import StatusCodes, ua
from bridge.uaserver.services import request_type


class RequestSession(Enum):
    """Session of a connection, seen from one of its requests."""

    NONE = "no session on this connection"
    CREATED = "created"
    ACTIVATED = "activated"
    OTHER = "its token is that of another session"
    ENDED = "closed, or its time-out has expired"
    MOVED = "activated on another connection since"


class Need(Enum):
    """Services by what they need of a session; ``USE`` is every service that is not named."""

    DISCOVER = ("GetEndpoints", "FindServers", "CloseSecureChannel")
    CREATE = ("CreateSession",)
    ACTIVATE = ("ActivateSession",)
    CLOSE = ("CloseSession",)
    USE = ()


_NOT_THIS_ONE: Final = StatusCodes.BadSessionIdInvalid

REFUSALS: Final[Mapping[Need, Mapping[RequestSession, int]]] = {
    Need.DISCOVER: {},
    Need.CREATE: dict.fromkeys(
        (RequestSession.CREATED, RequestSession.ACTIVATED, RequestSession.OTHER),
        StatusCodes.BadTooManySessions,
    ),
    # One that is not this connection's is looked up by its token, and has its own conditions.
    Need.ACTIVATE: {RequestSession.OTHER: _NOT_THIS_ONE},
    Need.CLOSE: dict.fromkeys(
        (RequestSession.NONE, RequestSession.OTHER, RequestSession.ENDED, RequestSession.MOVED), _NOT_THIS_ONE
    ),
    Need.USE: {
        **dict.fromkeys(
            (RequestSession.NONE, RequestSession.OTHER, RequestSession.ENDED, RequestSession.MOVED),
            _NOT_THIS_ONE,
        ),
        RequestSession.CREATED: StatusCodes.BadSessionNotActivated,
    },
}
"""Status codes by what a service needs; it is carried out in the states that are not named."""

_NEEDS: Final = {request_type(service): need for need in Need for service in need.value}


def need_of(typeid: ua.NodeId) -> Need:
    """``typeid`` is that of the request on the wire."""
    return _NEEDS.get(typeid, Need.USE)
