"""Counts for the diagnostics: each is made in one place, where it happens (OPC 10000-5 §12.9 to §12.15)."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Final

from bridge.uaserver.library import StatusCodes

SECURITY_CODES: Final = frozenset(
    (
        StatusCodes.BadSecurityChecksFailed,
        StatusCodes.BadSecurityPolicyRejected,
        StatusCodes.BadSecurityModeRejected,
        StatusCodes.BadUserAccessDenied,
        StatusCodes.BadIdentityTokenInvalid,
        StatusCodes.BadIdentityTokenRejected,
        StatusCodes.BadIdentityChangeNotSupported,
        StatusCodes.BadApplicationSignatureInvalid,
        StatusCodes.BadUserSignatureInvalid,
        StatusCodes.BadSessionIdInvalid,
    )
)
"""Status codes of requests that are refused for reasons of security."""


@dataclass(slots=True)
class RequestCounts:
    """Requests of one session by the names of their services."""

    all: Counter[str] = field(default_factory=Counter[str])
    refused: Counter[str] = field(default_factory=Counter[str])
    unauthorized: int = 0

    def note(self, service: str, code: int) -> None:
        """A request was answered with ``code``."""
        self.all[service] += 1
        if code:
            self.refused[service] += 1
            self.unauthorized += code == StatusCodes.BadUserAccessDenied


@dataclass(slots=True)
class ServerCounts:
    """Sessions, subscriptions and requests since the server has started."""

    sessions: int = 0
    sessions_refused: int = 0
    sessions_refused_for_security: int = 0
    sessions_timed_out: int = 0
    sessions_aborted: int = 0
    """Sessions that ended with their connection, for want of it, or because they were used before they were
    activated."""
    subscriptions: int = 0
    requests_refused: int = 0
    requests_refused_for_security: int = 0

    def refuse(self, code: int, *, of_session: bool) -> None:
        """A request was refused; ``of_session``: one that was to make or to activate a session."""
        is_security = code in SECURITY_CODES
        self.requests_refused += 1
        self.requests_refused_for_security += is_security
        if of_session:
            self.sessions_refused += 1
            self.sessions_refused_for_security += is_security


@dataclass(slots=True)
class SubscriptionCounts:
    """Requests, messages and notifications of one subscription since it was made."""

    modified: int = 0
    enabled: int = 0
    disabled: int = 0
    republish_requests: int = 0
    republished: int = 0
    transfer_requests: int = 0
    transferred_to_same_client: int = 0
    publish_requests: int = 0
    data_changes: int = 0
    events: int = 0
    late_publish_requests: int = 0
    discarded_messages: int = 0
    value_overflows: int = 0
    event_overflows: int = 0
