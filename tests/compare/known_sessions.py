"""The differences that are known, of discovery and sessions."""

from __future__ import annotations

from typing import Final

from tests.compare.difference import Difference, both, node_opcua, of_step, open62541
from tests.compare.servers import NODE_OPCUA, OPEN62541

OF_SESSIONS: Final = (
    # Discovery
    Difference(
        "GetEndpoints",
        "an EndpointUrl that is null or empty",
        ("some",),
        open62541("none"),
        "Part 4 §5.5.4.2",
        "The URL helps a server to choose among its own; it filters nothing.",
        path="endpoints",
        when=of_step(lambda step: not step.asked["EndpointUrl"]),
    ),
    # Session
    Difference(
        "CreateSession",
        "a second session on one connection",
        ("BadTooManySessions",),
        both("Good"),
        "Part 4 §5.7.2.3",
        "Each connection has one session; a client opens another connection for another one.",
    ),
    Difference(
        "ActivateSession",
        "another session on a connection that has one",
        ("BadSessionIdInvalid",),
        both("Good"),
        "Part 4 §5.7.3.1",
        "Each connection has one session.",
    ),
    Difference(
        "Read, CloseSession",
        "a session that is active on another connection",
        ("BadSessionIdInvalid",),
        both("BadSecureChannelIdInvalid"),
        "Part 4 §5.7.3.1",
        "It has to be refused, with a code that is left open: after this one clients make a new session.",
    ),
    Difference(
        "ActivateSession",
        "for the first time on another connection than it was created on",
        ("BadSecureChannelIdInvalid",),
        {
            OPEN62541: ("BadSessionIdInvalid", "BadIdentityTokenInvalid"),
            NODE_OPCUA: (
                *("BadSessionNotActivated", "BadIdentityTokenInvalid", "BadIdentityChangeNotSupported"),
                "BadSessionClosed",
            ),
        },
        "Part 4 §5.7.3.1",
        "It has to be refused, with a code that is left open.",
    ),
    Difference(
        "ActivateSession",
        "a session that has ended",
        ("BadSessionIdInvalid",),
        node_opcua("BadSessionClosed", "BadSessionNotActivated"),
        "Part 4 §7.38",
        "What has ended is forgotten.",
    ),
    Difference(
        "CloseSession",
        "a session that has ended by being used before it was activated",
        ("BadSessionIdInvalid",),
        node_opcua("Good"),
        "Part 4 §5.7.3.1",
        "It is closed already.",
    ),
    Difference(
        "ActivateSession",
        "a session that was activated before, with an identity token that is null or wrong",
        ("Good", "BadIdentityTokenInvalid", "BadSessionIdInvalid"),
        {NODE_OPCUA: ("BadIdentityChangeNotSupported",), OPEN62541: ("BadIdentityTokenInvalid",)},
        "Part 4 §5.7.3.2",
        "A token that is null is an anonymous one.",
    ),
    Difference(
        "ActivateSession",
        "a user with a name, where only anonymous ones are let in",
        ("BadIdentityTokenRejected",),
        {
            OPEN62541: ("BadIdentityTokenInvalid",),
            NODE_OPCUA: ("BadIdentityTokenInvalid", "BadIdentityChangeNotSupported"),
        },
        "Part 4 §5.7.3.3",
        "The token may be a good one; it is not taken here.",
    ),
)
