"""Shares of tabs and connections, where there are more than there is room for."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import Role
from bridge.northbound.page.shares import (
    MOST_CONNECTIONS,
    MOST_OF_USER,
    MOST_TABS,
    MOST_WAITING_OF_ADDRESS,
    UNPROVED_S,
    Connections,
    Doing,
    Seat,
    admit,
)

HERE = "10.0.0.1"
ENGINEER = Seat("eva", HERE, Role.ENGINEER)


def seat(user: str, role: Role = Role.OBSERVER, *, commands: bool = False, since: float = 0.0) -> Seat:
    return Seat(user, HERE, role, commands, since)


def crowd(role: Role, users: int = 8, tabs: int = 8, *, commands: bool = False) -> list[Seat]:
    """Tabs of these users, by default as many as there are places for users that are no engineers."""
    seats = [
        seat(f"{role.name} {user}", role, commands=commands) for user in range(users) for _ in range(tabs)
    ]
    return seats[: MOST_TABS - 1]


def test_one_user_has_a_share_however_often_it_logs_in() -> None:
    taken: list[Seat] = []
    for _ in range(4 * MOST_OF_USER):
        if admit(taken, seat("olga")).is_in:
            taken.append(seat("olga"))
    assert len(taken) == MOST_OF_USER
    assert admit(taken, ENGINEER).is_in and admit(taken, seat("otto")).is_in


def test_visitors_of_one_address_are_one_user() -> None:
    taken = [seat("")] * MOST_OF_USER
    assert not admit(taken, seat("")).is_in
    assert admit(taken, Seat("", "10.0.0.2", Role.OBSERVER)).is_in


def test_one_place_is_kept_for_engineers() -> None:
    full = crowd(Role.OPERATOR, commands=True)
    assert not admit(full, seat("otto", Role.OPERATOR)).is_in
    assert admit(full, ENGINEER) == admit([], ENGINEER)


def test_the_least_role_yields_first() -> None:
    taken = [*crowd(Role.OPERATOR)[:-2], seat("olga"), seat("olga", since=1.0)]
    found = admit(taken, seat("otto", Role.OPERATOR))
    assert found.gives_way is not None and taken[found.gives_way] == seat("olga", since=1.0), "the latest"


def test_within_a_role_whoever_has_most_yields_to_whoever_has_less() -> None:
    taken = crowd(Role.OBSERVER, users=5, tabs=13)
    found = admit(taken, seat("otto"))
    assert found.is_in and found.gives_way is not None
    taken[found.gives_way] = seat("otto")
    assert admit(taken, seat("OBSERVER 1")).gives_way is None, "nobody is displaced in turns"


def test_who_commands_a_drive_yields_to_nobody() -> None:
    full = [*crowd(Role.OPERATOR, commands=True), ENGINEER]
    assert not admit(full, seat("emil", Role.ENGINEER)).is_in


@given(
    st.lists(
        st.tuples(st.sampled_from("abcdef"), st.sampled_from(list(Role)[:3]), st.booleans()), max_size=150
    )
)
def test_an_engineer_always_gets_in_unless_engineers_or_commanders_have_all(
    wishes: list[tuple[str, Role, bool]],
) -> None:
    taken: list[Seat] = []
    for user, role, commands in wishes:
        new = seat(f"{user} {role}", role, commands=commands)
        found = admit(taken, new)
        if found.gives_way is not None:
            gone = taken.pop(found.gives_way)
            assert not gone.commands and gone.role <= new.role
        if found.is_in:
            taken.append(new)
        assert len(taken) <= MOST_TABS
    if not admit(taken, ENGINEER).is_in:
        assert all(one.commands or one.role >= Role.ENGINEER for one in taken)


# connections


class Front:
    """The connections of a page, numbered, on a clock of its own."""

    def __init__(self) -> None:
        self.now = 0.0
        self.closed: list[int] = []
        self.told: list[str] = []
        self.connections = Connections[int](
            self.closed.append, lambda kind, source, detail: self.told.append(source), lambda: self.now
        )

    def opens(self, one: int, address: str = HERE, doing: Doing = Doing.SILENT) -> bool:
        is_in = self.connections.opened(one, address)
        self.connections.does(one, doing)
        return is_in


def test_idle_connections_of_one_address_end_the_oldest_of_its_own() -> None:
    front = Front()
    front.opens(-1, "10.0.0.2")
    for number in range(400):
        front.now = number / 100
        assert front.opens(number)
    assert front.closed == list(range(400 - MOST_WAITING_OF_ADDRESS)), "the oldest, and nobody else's"
    assert len(front.connections) == MOST_WAITING_OF_ADDRESS + 1
    assert set(front.told) == {HERE}


def test_beside_idle_connections_of_its_own_address_a_browser_is_served() -> None:
    """Each that opens and asks at once is among the youngest."""
    front = Front()
    for number in range(400):
        front.opens(number)
    for number in range(1000, 1060):
        front.now += 0.001
        assert front.opens(number)
        front.connections.does(number, Doing.BUSY)
        assert number not in front.closed
        front.connections.does(number, Doing.KEPT)
        front.connections.closed(number)


@pytest.mark.landing
def test_a_crowd_of_addresses_takes_no_connection_on_which_something_is_asked() -> None:
    front = Front()
    front.opens(-1, doing=Doing.BUSY)
    front.opens(-2, doing=Doing.UNPROVED)
    front.now = 2 * UNPROVED_S
    for number in range(2000):
        front.opens(number, f"10.1.{number % 250}.{number // 250}")
    assert len(front.connections) == MOST_CONNECTIONS
    assert not {-1, -2} & set(front.closed)


def test_tabs_that_prove_nothing_end_before_anybody_is_refused() -> None:
    front = Front()
    for number in range(MOST_CONNECTIONS):
        front.opens(number, f"10.0.1.{number % 8}", Doing.UNPROVED)
    front.now = 1.0
    assert front.opens(1000, "10.0.0.2", Doing.BUSY)
    assert front.closed == [0]
    assert front.opens(1001, "10.0.1.3")
    assert front.closed[1:] == [3]


def test_where_all_are_busy_a_newcomer_is_refused_with_a_line() -> None:
    front = Front()
    for number in range(MOST_CONNECTIONS):
        front.opens(number, f"10.0.1.{number % 8}", Doing.BUSY)
    assert not front.opens(1000, "10.0.0.2")
    assert front.told == ["10.0.0.2"]
    front.connections.closed(0)
    front.connections.closed(0)
    assert front.opens(1001, "10.0.0.2")
