"""Nodes of the diagnostics and who may see them, in the standard's own address space."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from asyncua import ua

from bridge.uaserver.counts import RequestCounts, ServerCounts
from bridge.uaserver.diagnostics.diagnosticnodes import DiagnosticNodes
from bridge.uaserver.diagnostics.diagnostics import SessionFacts
from bridge.uaserver.diagnostics.shapes import ALL_SECURITY, ALL_SESSIONS, ALL_SUBSCRIPTIONS
from bridge.uaserver.subscriptions.subscription import Subscription, Terms
from tests.support.standard_space import standard_space

Value = ua.AttributeIds.Value


def session(number: int) -> Any:
    return SimpleNamespace(
        label=f"session {number}",
        session_id=ua.NodeId(number),
        channel_certificate=None,
        counts=RequestCounts(),
        facts=SessionFacts(name=f"client {number}"),
        session_timeout=1.0,
        publishing=[],
        locales=(),
    )


class Rig:
    def __init__(self) -> None:
        self.space = standard_space()
        self.sessions = [session(1), session(2)]
        terms = Terms(100, 30, 10, 1000, 0)
        subscriptions = {7: Subscription(7, self.sessions[0], terms, enabled=True)}
        sources: Any = SimpleNamespace(
            counts=ServerCounts(), sessions=self.sessions, diagnosed_subscriptions=subscriptions
        )
        self.nodes = DiagnosticNodes(self.space, sources)
        self.nodes.install()

    def value(self, where: ua.NodeId) -> Any:
        found = self.space.read_attribute_value(where, Value)
        code = found.StatusCode
        return code.value if code and code.is_bad() else found.Value.Value


@pytest.fixture(scope="module")
def rig() -> Rig:
    return Rig()


def node(path: str) -> ua.NodeId:
    return ua.NodeId(f"Diagnostics/{path}", 1)


def test_a_node_is_there_as_long_as_what_it_is_about() -> None:
    rig = Rig()
    its_name = node("session 2/SessionDiagnostics/SessionName")
    assert rig.value(its_name) == "client 2"
    assert len(rig.value(ua.NodeId(ALL_SESSIONS))) == 2
    rig.sessions.pop()
    assert rig.value(its_name) == ua.StatusCodes.BadNodeIdUnknown
    assert len(rig.value(ua.NodeId(ALL_SESSIONS))) == 1


@pytest.mark.parametrize(
    "path",
    ["session 3", "session 1/Else", "session 1/SessionDiagnostics/No", "Subscription", "Subscription/٧"],
)
def test_what_is_not_there_is_not_found(rig: Rig, path: str) -> None:
    assert node(path) not in rig.space


@pytest.mark.parametrize(
    ("where", "own", "engineer", "engineer_encrypted"),
    [
        (ua.NodeId(ALL_SESSIONS), False, True, True),
        (ua.NodeId(ALL_SUBSCRIPTIONS), False, True, True),
        (ua.NodeId(ALL_SECURITY), False, False, True),
        (node("session 1/SessionDiagnostics"), True, True, True),
        (node("session 1/SessionSecurityDiagnostics/SecurityMode"), True, False, True),
        (node("Subscription/7/Priority"), True, True, True),
    ],
)
def test_what_is_about_a_session_is_for_few(
    rig: Rig, where: ua.NodeId, own: bool, engineer: bool, engineer_encrypted: bool
) -> None:
    mine, other = rig.sessions
    assert rig.nodes.is_about_someone(where)
    is_hidden = rig.nodes.is_hidden
    assert is_hidden(where, mine, may_see_all=False) != own
    assert is_hidden(where, other, may_see_all=True) != engineer
    if where.NamespaceIndex:
        assert is_hidden(where, other, may_see_all=False)
    other.channel_certificate = b"x"
    assert is_hidden(where, other, may_see_all=True) != engineer_encrypted
    other.channel_certificate = None


def test_the_summary_and_what_is_no_diagnostics_are_for_all(rig: Rig) -> None:
    summary = ua.ObjectIds.Server_ServerDiagnostics_ServerDiagnosticsSummary
    for where in (ua.NodeId(summary), ua.NodeId("Diagnostics/session 1", 2), ua.NodeId(b"x", 1)):
        assert not rig.nodes.is_about_someone(where)
