"""Diagnostics of the server, its sessions and its subscriptions, made when somebody looks at them
(OPC 10000-5 §12.9 to §12.15)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from datetime import UTC, datetime
from typing import Any, Final, Protocol, cast

from bridge.uaserver.application import UserIdentity
from bridge.uaserver.counts import RequestCounts, ServerCounts
from bridge.uaserver.library import ObjectIds, get, make, node_id, ua
from bridge.uaserver.subscriptions.items import Monitoring
from bridge.uaserver.subscriptions.publishing import PublishQueue
from bridge.uaserver.subscriptions.subscription import Subscription

_LONGEST: Final = 256
"""Characters of what a client says of itself."""
_MOST_NAMES: Final = 10
_COUNT: Final = "Count"


@dataclass(slots=True)
class SessionFacts:
    """Facts of a session that nothing but its diagnostics needs; what its client says of itself is cut."""

    name: str = ""
    application: ua.ApplicationDescription = field(default_factory=ua.ApplicationDescription)
    server_uri: str = ""
    endpoint_url: str = ""
    most_response_bytes: int = 0
    began: datetime = field(default_factory=lambda: datetime.now(UTC))
    seen_at: datetime = field(default_factory=lambda: datetime.now(UTC))
    users: list[str] = field(default_factory=list[str])
    """Names of its users, the first one first."""
    mechanism: str = "Anonymous"
    mode: ua.MessageSecurityMode = ua.MessageSecurityMode.None_
    policy_uri: str = ""

    @classmethod
    def of(cls, params: ua.CreateSessionParameters) -> SessionFacts:
        client: ua.ApplicationDescription = get(params, "ClientDescription")
        name: ua.LocalizedText = get(client, "ApplicationName")
        application = make(
            ua.ApplicationDescription,
            ApplicationUri=_cut(get(client, "ApplicationUri")),
            ProductUri=_cut(get(client, "ProductUri")),
            ApplicationName=ua.LocalizedText(_cut(name.Text), _cut(name.Locale)),
            ApplicationType=get(client, "ApplicationType"),
        )
        return cls(
            _cut(get(params, "SessionName")),
            application,
            _cut(get(params, "ServerUri")),
            _cut(get(params, "EndpointUrl")),
            get(params, "MaxResponseMessageSize"),
        )

    def note_channel(self, policy: Any) -> None:
        """``policy`` is asyncua's security policy of the channel."""
        self.mode, self.policy_uri = policy.Mode, policy.URI

    def note_user(self, name: str, mechanism: str) -> None:
        if self.users[-1:] != [name]:
            self.users = [*self.users, name][-_MOST_NAMES:]
        self.mechanism = mechanism


class DiagnosedSession(Protocol):
    session_id: ua.NodeId
    session_timeout: float | None
    identity: UserIdentity
    channel_certificate: bytes | None
    publishing: PublishQueue
    counts: RequestCounts
    facts: SessionFacts

    @property
    def locales(self) -> Any: ...


def summary(
    counts: ServerCounts, sessions: int, subscriptions: Mapping[int, Subscription]
) -> ua.ServerDiagnosticsSummaryDataType:
    return make(
        ua.ServerDiagnosticsSummaryDataType,
        CurrentSessionCount=sessions,
        CumulatedSessionCount=counts.sessions,
        SecurityRejectedSessionCount=counts.sessions_refused_for_security,
        RejectedSessionCount=counts.sessions_refused,
        SessionTimeoutCount=counts.sessions_timed_out,
        SessionAbortCount=counts.sessions_aborted,
        CurrentSubscriptionCount=len(subscriptions),
        CumulatedSubscriptionCount=counts.subscriptions,
        PublishingIntervalCount=len({one.terms.interval_ms for one in subscriptions.values()}),
        SecurityRejectedRequestsCount=counts.requests_refused_for_security,
        RejectedRequestsCount=counts.requests_refused,
    )


def session_diagnostics(
    session: DiagnosedSession, subscriptions: Iterable[Subscription]
) -> ua.SessionDiagnosticsDataType:
    facts, own = session.facts, list(subscriptions)
    return make(
        ua.SessionDiagnosticsDataType,
        SessionId=session.session_id,
        SessionName=facts.name,
        ClientDescription=facts.application,
        ServerUri=facts.server_uri,
        EndpointUrl=facts.endpoint_url,
        LocaleIds=list(session.locales),
        ActualSessionTimeout=(session.session_timeout or 0.0) * 1000,
        MaxResponseMessageSize=facts.most_response_bytes,
        ClientConnectionTime=facts.began,
        ClientLastContactTime=facts.seen_at,
        CurrentSubscriptionsCount=len(own),
        CurrentMonitoredItemsCount=sum(len(one.items) for one in own),
        CurrentPublishRequestsInQueue=len(session.publishing),
        UnauthorizedRequestCount=session.counts.unauthorized,
        **_service_counts(session.counts),
    )


def _service_counts(counts: RequestCounts) -> dict[str, ua.ServiceCounterDataType]:
    found = {"TotalRequestCount": _counter(counts.all.total(), counts.refused.total())}
    for one in fields(ua.SessionDiagnosticsDataType):
        service = one.name.removesuffix(_COUNT)
        if "ServiceCounter" in str(one.type) and one.name not in found:
            found[one.name] = _counter(counts.all[service], counts.refused[service])
    return found


def _counter(total: int, errors: int) -> ua.ServiceCounterDataType:
    return make(ua.ServiceCounterDataType, TotalCount=total, ErrorCount=errors)


@dataclass
class SecurityDiagnostics:
    """SessionSecurityDiagnosticsDataType (Part 5 §12.12). asyncua's own class has a bit mask where the name
    of the encoding is."""

    SessionId: ua.NodeId
    ClientUserIdOfSession: ua.String
    ClientUserIdHistory: list[ua.String]
    AuthenticationMechanism: ua.String
    EncodingName: ua.String
    TransportProtocol: ua.String
    SecurityMode: ua.MessageSecurityMode
    SecurityPolicyUri: ua.String
    ClientCertificate: ua.ByteString

    @property
    def Encoding(self) -> ua.String:
        return self.EncodingName


get(ua, "typeid_by_extension_objects")[SecurityDiagnostics] = node_id(
    ObjectIds.SessionSecurityDiagnosticsDataType_Encoding_DefaultBinary
)


def security_diagnostics(session: DiagnosedSession) -> SecurityDiagnostics:
    facts = session.facts
    # asyncua's String is none of Python's.
    made = cast("Callable[..., SecurityDiagnostics]", SecurityDiagnostics)
    return made(
        SessionId=session.session_id,
        ClientUserIdOfSession=facts.users[-1] if facts.users else "",
        ClientUserIdHistory=list(facts.users),
        AuthenticationMechanism=facts.mechanism,
        EncodingName="UA Binary",
        TransportProtocol="opc.tcp",
        SecurityMode=facts.mode,
        SecurityPolicyUri=facts.policy_uri,
        ClientCertificate=session.channel_certificate or b"",
    )


def subscription_diagnostics(found: Subscription) -> ua.SubscriptionDiagnosticsDataType:
    agreed, counts = found.terms, found.counts
    disabled = sum(one.mode == Monitoring.Disabled for one in found.items.values())
    return make(
        ua.SubscriptionDiagnosticsDataType,
        SessionId=found.session_id,
        SubscriptionId=found.number,
        Priority=agreed.priority,
        PublishingInterval=agreed.interval_ms,
        MaxKeepAliveCount=agreed.keep_alive,
        MaxLifetimeCount=agreed.lifetime,
        MaxNotificationsPerPublish=agreed.most_per_message,
        PublishingEnabled=found.is_enabled,
        ModifyCount=counts.modified,
        EnableCount=counts.enabled,
        DisableCount=counts.disabled,
        RepublishRequestCount=counts.republish_requests,
        RepublishMessageRequestCount=counts.republish_requests,
        RepublishMessageCount=counts.republished,
        TransferRequestCount=counts.transfer_requests,
        TransferredToSameClientCount=counts.transferred_to_same_client,
        PublishRequestCount=counts.publish_requests,
        DataChangeNotificationsCount=counts.data_changes,
        EventNotificationsCount=counts.events,
        NotificationsCount=counts.data_changes + counts.events,
        LatePublishRequestCount=counts.late_publish_requests,
        CurrentKeepAliveCount=found.quiet_cycles,
        CurrentLifetimeCount=found.silent_cycles,
        UnacknowledgedMessageCount=len(found.available),
        DiscardedMessageCount=counts.discarded_messages,
        MonitoredItemCount=len(found.items),
        DisabledMonitoredItemCount=disabled,
        MonitoringQueueOverflowCount=counts.value_overflows,
        NextSequenceNumber=found.next_sequence,
        EventQueueOverflowCount=counts.event_overflows,
    )


def _cut(words: str | None) -> str:
    return (words or "")[:_LONGEST]
