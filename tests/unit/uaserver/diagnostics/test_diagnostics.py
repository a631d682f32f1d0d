"""What the diagnostics say; no server."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

from asyncua import ua

from bridge.uaserver.counts import RequestCounts, ServerCounts
from bridge.uaserver.diagnostics.diagnostics import (
    SecurityDiagnostics,
    SessionFacts,
    security_diagnostics,
    session_diagnostics,
    subscription_diagnostics,
    summary,
)
from bridge.uaserver.subscriptions.subscription import Subscription, Terms
from tests.support.opcua_sessions import Session


@dataclass
class Diagnosed(Session):
    counts: RequestCounts = field(default_factory=RequestCounts)
    facts: SessionFacts = field(default_factory=SessionFacts)
    session_timeout: float | None = 30.0
    locales: tuple[str, ...] = ("de",)
    label: str = "session 1"


def subscription(interval_ms: float, owner: Session) -> Subscription:
    return Subscription(3, owner, Terms(interval_ms, 30, 10, 1000, 5), enabled=True)


def test_the_summary_counts_what_is_there_and_what_was() -> None:
    found = [subscription(ms, Session()) for ms in (100, 100, 500)]
    told = summary(ServerCounts(sessions=7, sessions_timed_out=2), 3, dict(enumerate(found)))
    assert (told.CurrentSessionCount, told.CumulatedSessionCount, told.SessionTimeoutCount) == (3, 7, 2)
    assert (told.CurrentSubscriptionCount, told.PublishingIntervalCount) == (3, 2)


def test_each_service_of_a_session_has_its_counter() -> None:
    session = Diagnosed()
    session.counts.note("Browse", ua.StatusCodes.Good)
    session.counts.note("GetEndpoints", ua.StatusCodes.BadNothingToDo)
    told = session_diagnostics(session, [subscription(100, session)])
    assert (told.BrowseCount.TotalCount, told.BrowseCount.ErrorCount) == (1, 0)
    # Also what has no counter of its own.
    assert (told.TotalRequestCount.TotalCount, told.TotalRequestCount.ErrorCount) == (2, 1)
    assert (told.ActualSessionTimeout, told.LocaleIds) == (30_000.0, ["de"])
    assert told.CurrentSubscriptionsCount == 1


def test_the_structures_have_the_fields_of_the_standard() -> None:
    names = [one.name.replace("EncodingName", "Encoding") for one in fields(SecurityDiagnostics)]
    assert names == [one.name for one in fields(ua.SessionSecurityDiagnosticsDataType)]
    assert security_diagnostics(Diagnosed()).ClientCertificate == b""


def test_the_names_of_its_users_are_kept_as_far_back_as_there_is_room() -> None:
    facts = SessionFacts()
    for number in range(25):
        facts.note_user(f"user {number // 2}", "UserName")
    assert facts.users == [f"user {number}" for number in range(3, 13)]


def test_a_subscription_tells_its_terms_and_what_it_did() -> None:
    session = Session()
    found = subscription(250, session)
    found.set_enabled(False)
    found.set_enabled(True)
    found.modify(Terms(300, 30, 10, 1000, 5))
    told = subscription_diagnostics(found)
    assert (told.PublishingInterval, told.PublishingEnabled, told.NextSequenceNumber) == (300, True, 1)
    assert (told.ModifyCount, told.EnableCount, told.DisableCount) == (1, 1, 1)
