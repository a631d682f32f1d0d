"""Counts for the diagnostics; no server."""

from __future__ import annotations

from asyncua import ua

from bridge.uaserver.counts import RequestCounts, ServerCounts

Codes = ua.StatusCodes


def test_a_request_is_counted_with_its_service_and_its_answer() -> None:
    counts = RequestCounts()
    for service, code in (
        ("Read", Codes.Good),
        ("Read", Codes.BadNothingToDo),
        ("Call", Codes.BadUserAccessDenied),
    ):
        counts.note(service, code)
    assert dict(counts.all) == {"Read": 2, "Call": 1}
    assert dict(counts.refused) == {"Read": 1, "Call": 1}
    assert counts.unauthorized == 1


def test_what_is_refused_for_security_is_counted_in_both() -> None:
    counts = ServerCounts()
    counts.refuse(Codes.BadTooManySessions, of_session=True)
    counts.refuse(Codes.BadIdentityTokenRejected, of_session=True)
    counts.refuse(Codes.BadUserAccessDenied, of_session=False)
    assert (counts.sessions_refused, counts.sessions_refused_for_security) == (2, 1)
    assert (counts.requests_refused, counts.requests_refused_for_security) == (3, 2)
