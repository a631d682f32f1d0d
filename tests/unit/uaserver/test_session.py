"""Sessions and what their users may see, with an application of the test; no socket."""

from __future__ import annotations

import pytest
from asyncua import ua

from bridge.uaserver.application import NOBODY
from bridge.uaserver.inner_server import InnerServer
from bridge.uaserver.library import ServiceError
from bridge.uaserver.session import Session
from tests.support.opcua_application import Served, User, add_variable

Ids, Codes = ua.AttributeIds, ua.StatusCodes
WORD, HIDDEN = ua.NodeId("word", 1), ua.NodeId("hidden", 1)


class Rig:
    def __init__(self) -> None:
        self.server = InnerServer(no_security=True)
        self.application = self.server.application = Served()
        self.space = self.server.aspace
        add_variable(self.space, WORD, 7, access=3)
        add_variable(self.space, HIDDEN, 7, access=2)

    def session(self, user: User | None = None, host: str = "10.0.0.1") -> Session:
        made = self.server.create_session((host, 50_000))
        assert isinstance(made, Session)
        if user:
            made.admitted = user
            made.activate_session(ua.ActivateSessionParameters(), None)
            made.holder = object()
        return made


@pytest.fixture
async def rig() -> Rig:
    return Rig()


async def test_tokens_cannot_be_guessed_and_names_tell_sessions_apart(rig: Rig) -> None:
    first, second = rig.session(), rig.session()
    assert len(first.auth_token.Identifier) == 32
    assert first.auth_token != second.auth_token
    assert first.label != second.label
    assert first.identity is NOBODY
    assert first.address == "10.0.0.1"
    assert rig.server.sessions == [first, second]


async def test_nobody_is_let_in_whom_the_application_has_not_admitted(rig: Rig) -> None:
    session = rig.session()
    with pytest.raises(ServiceError):
        session.activate_session(ua.ActivateSessionParameters(), None)
    await session.close_session()
    assert rig.application.told == []


async def test_the_application_is_told_who_comes_and_goes_and_who_else_is_there(rig: Rig) -> None:
    anna = User("anna")
    first, second = rig.session(anna), rig.session(anna)
    second.leave(5.0)
    assert (second.holder, second.left_at) == (None, 5.0)
    await first.close_session()
    await first.close_session()
    assert rig.application.told == [
        ("anna", True, False),
        ("anna", True, True),
        ("anna", False, True),
        ("anna", False, False),
    ]
    assert first.is_gone and not second.is_gone


async def test_what_ends_for_an_error_is_counted_and_no_other_end(rig: Rig) -> None:
    sessions = [rig.session() for _ in range(4)]
    await sessions[0].close_session()
    await sessions[1].evict()
    await sessions[2].abort()
    for session in sessions[:3]:
        await session.abort()  # as its connection does when it ends
    assert rig.server.sessions == sessions[3:]
    assert rig.server.counts.sessions_aborted == 1


async def test_another_user_on_the_same_session_ends_the_one_before(rig: Rig) -> None:
    session = rig.session(User("anna"))
    session.admitted = User("eva")
    session.activate_session(ua.ActivateSessionParameters(), None)
    assert [(name, there) for name, there, _ in rig.application.told] == [
        ("anna", True),
        ("anna", False),
        ("eva", True),
    ]


async def test_who_may_not_write_sees_that(rig: Rig) -> None:
    def read(session: Session, where: ua.NodeId, attribute: ua.AttributeIds) -> ua.DataValue:
        return session.seen(where, attribute, rig.space.read_attribute_value(where, attribute))

    may, may_not = rig.session(User("eva")), rig.session(User("guest", has_rights=False))
    assert read(may, WORD, Ids.UserAccessLevel).Value.Value == 3
    assert read(may_not, WORD, Ids.UserAccessLevel).Value.Value == 1
    assert read(may_not, WORD, Ids.Value).Value.Value == 7
    assert read(may, HIDDEN, Ids.Value).StatusCode.value == Codes.BadNotReadable


@pytest.mark.parametrize("age", [-1.0, float("nan")])
async def test_an_age_that_is_none_is_refused(rig: Rig, age: float) -> None:
    params = ua.ReadParameters(MaxAge=age, NodesToRead=[ua.ReadValueId(WORD, Ids.Value)])
    with pytest.raises(ServiceError) as refused:
        await rig.session(User("eva")).read_attributes(params, {}, lambda place, why: None)
    assert refused.value.code == Codes.BadMaxAgeInvalid
