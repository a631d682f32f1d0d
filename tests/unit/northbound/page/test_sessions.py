"""Sessions of the page and their ends; on a virtual clock."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import Role
from bridge.northbound.page.sessions import IDLE_S, LONGEST_S, MOST, MOST_OF_ONE, MOST_VISITORS, PageSessions


def test_each_login_has_secrets_of_its_own() -> None:
    sessions = PageSessions()
    made = [sessions.begin("ann", Role.OPERATOR, 0.0) for _ in range(10)]
    assert len({one.id for one in made} | {one.token for one in made}) == 20
    assert all(len(one.id) >= 40 for one in made)


def test_a_session_is_over_when_nobody_uses_it_and_in_any_case_in_the_end() -> None:
    sessions = PageSessions()
    idle = sessions.begin("ann", Role.OPERATOR, 0.0)
    assert sessions.find(idle.id, IDLE_S - 1) is idle
    assert sessions.find(idle.id, 2 * IDLE_S - 2) is idle, "each use counts"
    assert sessions.find(idle.id, 4 * IDLE_S) is None
    assert sessions.find(idle.id, 0.0) is None, "it does not come back"
    used = sessions.begin("ann", Role.OPERATOR, 0.0)
    now = 0.0
    while sessions.find(used.id, now) is not None:
        now += IDLE_S / 2
    assert LONGEST_S <= now <= LONGEST_S + IDLE_S


def test_an_id_that_nobody_has_made_is_nobodys() -> None:
    sessions = PageSessions()
    assert sessions.find("brought along", 0.0) is None
    assert len(sessions) == 0


@given(st.text())
def test_only_its_own_token_is_its_token(token: str) -> None:
    session = PageSessions().begin("ann", Role.OPERATOR, 0.0)
    assert not session.has(token)
    assert session.has(session.token)


def test_one_user_pushes_out_its_own_sessions_first() -> None:
    sessions = PageSessions()
    other = sessions.begin("bob", Role.OPERATOR, 0.0)
    made = [sessions.begin("ann", Role.OPERATOR, 1.0 + number) for number in range(3 * MOST_OF_ONE)]
    assert sessions.find(other.id, 100.0) is other
    assert [one for one in made if sessions.find(one.id, 100.0)] == made[-MOST_OF_ONE:]


def test_visitors_push_out_those_from_their_own_address() -> None:
    sessions = PageSessions()
    other = sessions.begin("", Role.OBSERVER, 0.0, "1.2.3.5")
    made = [sessions.begin("", Role.OBSERVER, 1.0 + n, "1.2.3.4") for n in range(3 * MOST_OF_ONE)]
    assert sessions.find(other.id, 100.0) is other
    assert [one for one in made if sessions.find(one.id, 100.0)] == made[-MOST_OF_ONE:]


def test_a_crowd_of_visitors_pushes_out_nobody_who_has_logged_in() -> None:
    sessions = PageSessions()
    ann = sessions.begin("ann", Role.OPERATOR, 0.0, "1.2.3.4")
    for n in range(1000):
        sessions.begin("", Role.OBSERVER, 1.0 + n / 10, f"10.0.{n % 250}.{n // 250}")
    assert sessions.find(ann.id, 200.0) is ann
    assert len(sessions) == MOST_VISITORS + 1


@pytest.mark.parametrize("user", ["ann", ""])
def test_a_session_with_an_open_tab_is_never_pushed_out(user: str) -> None:
    sessions = PageSessions()
    shown = [sessions.begin(user, Role.OPERATOR, float(n), "1.2.3.4") for n in range(MOST_OF_ONE)]
    for one in shown:
        one.tabs = 1
    for n in range(300):
        sessions.begin(user, Role.OPERATOR, 100.0 + n, "1.2.3.4")
        sessions.begin(f"user {n}", Role.OPERATOR, 100.0 + n, "1.2.3.4")
    assert all(sessions.find(one.id, 500.0) is one for one in shown)
    assert len(sessions) <= MOST


@given(st.lists(st.tuples(st.integers(0, 40), st.floats(0, 100)), max_size=400))
def test_there_are_never_more_than_there_is_room_for(logins: list[tuple[int, float]]) -> None:
    sessions, now = PageSessions(), 0.0
    for user, later in logins:
        now += later
        sessions.begin(str(user), Role.OBSERVER, now)
        assert len(sessions) <= MOST
