"""Connections let in, closed and made room for; no server."""

from __future__ import annotations

import pytest

from bridge.base.admission import Admission, ConnectionStage, Limits, Visitor
from bridge.base.sources import source_of
from bridge.uaserver.connection_limits import (
    DEADLINE_S,
    KEPT,
    MOST_CONNECTIONS,
    MOST_HELD,
    MOST_OF_ADDRESS,
    MOST_WAITING,
    limits,
)


class Rig:
    """A server with the limits of OPC UA, unless others are given."""

    def __init__(self, of: Limits | None = None) -> None:
        self.told: list[tuple[str, str, str]] = []
        self.counted: list[str] = []
        self.admission = Admission(
            of or limits(),
            lambda *what: self.told.append(what),
            lambda: self.counted.append("refused"),
            lambda: self.counted.append("broken"),
        )
        self.closed: list[Client] = []
        self.now = 0.0

    def client(self, source: str = "10.0.0.1", stage: ConnectionStage = ConnectionStage.CONNECTED) -> Client:
        return Client(self, source, stage)

    def crowd(
        self, count: int, source: str = "10.0.0.1", stage: ConnectionStage = ConnectionStage.CONNECTED
    ) -> list[Client]:
        return [self.client(source, stage) for _ in range(count)]


class Client:
    def __init__(self, rig: Rig, source: str, stage: ConnectionStage) -> None:
        self.stage = stage
        self.held = 0
        self.rank = 0
        self.user = ""
        self.visitor = Visitor(
            source,
            rig.now,
            lambda: self.stage,
            lambda: rig.closed.append(self),
            lambda: self.held,
            lambda: self.rank,
            lambda: self.user,
        )
        self.is_in = rig.admission.admit(self.visitor, rig.now)


@pytest.fixture
def rig() -> Rig:
    return Rig()


@pytest.mark.parametrize(
    "stage", [ConnectionStage.CONNECTED, ConnectionStage.GREETED, ConnectionStage.CHANNEL]
)
def test_each_step_has_its_time(rig: Rig, stage: ConnectionStage) -> None:
    client = rig.client(stage=stage)
    rig.admission.look(DEADLINE_S[stage] - 0.1)
    assert rig.closed == []
    rig.admission.look(DEADLINE_S[stage])
    assert rig.closed == [client]
    assert len(rig.admission) == 0


def test_a_session_may_stay_and_the_time_counts_anew_when_it_is_gone(rig: Rig) -> None:
    client = rig.client(stage=ConnectionStage.SESSION)
    rig.admission.look(1000.0)
    client.stage = ConnectionStage.CHANNEL
    rig.admission.look(1000.0 + DEADLINE_S[ConnectionStage.CHANNEL] - 0.1)
    assert rig.closed == []
    rig.admission.look(1000.0 + DEADLINE_S[ConnectionStage.CHANNEL])
    assert rig.closed == [client]


def test_the_oldest_without_a_session_makes_room(rig: Rig) -> None:
    old = rig.crowd(MOST_WAITING)
    rig.now = 0.5
    assert rig.client().is_in
    assert rig.closed == old[:1]


def test_a_flood_of_idle_sockets_pushes_out_no_handshake(rig: Rig) -> None:
    client = rig.client(stage=ConnectionStage.CHANNEL)
    rig.now = 0.01
    assert all(one.is_in for one in rig.crowd(1000))
    assert client not in rig.closed
    client.stage = ConnectionStage.SESSION
    rig.admission.look(100.0)
    assert client not in rig.closed


def test_channels_that_wait_push_out_no_newcomer(rig: Rig) -> None:
    """A client that sits on an open channel gives way before one that has only just connected."""
    sitting = rig.crowd(MOST_WAITING, stage=ConnectionStage.CHANNEL)
    rig.now = 6.0
    newcomers = rig.crowd(5)
    assert rig.closed == sitting[:5]
    assert all(one.is_in and one not in rig.closed for one in newcomers)


def test_crowds_of_several_addresses_push_out_no_newcomer_of_another(rig: Rig) -> None:
    """They have said more than it, and come again before it can say anything."""
    hosts = [f"10.0.1.{number}" for number in range(MOST_CONNECTIONS // MOST_WAITING)]
    for host in hosts:
        rig.crowd(MOST_WAITING, host, ConnectionStage.CHANNEL)
    newcomer = rig.client("10.0.2.1")
    assert newcomer.is_in
    for number in range(100):
        rig.now += 0.01
        rig.client(hosts[number % len(hosts)], ConnectionStage.CHANNEL)
    assert newcomer not in rig.closed


def test_who_holds_the_most_of_the_address_that_does_is_closed(rig: Rig) -> None:
    reader = rig.client("10.0.0.2", ConnectionStage.SESSION)
    reader.held = MOST_HELD // 3
    crowd = rig.crowd(40, stage=ConnectionStage.SESSION)
    for one in crowd:
        one.held = MOST_HELD // 50
    crowd[7].held += 1
    rig.admission.look(0.0)
    assert rig.closed[0] is crowd[7]
    assert reader not in rig.closed
    left = sum(one.held for one in [reader, *crowd] if one not in rig.closed)
    assert MOST_HELD * 0.9 < left <= MOST_HELD
    assert rig.counted == ["broken"] * len(rig.closed)
    before = len(rig.closed)
    rig.admission.weigh()
    assert len(rig.closed) == before


def test_one_address_costs_no_other_anything(rig: Rig) -> None:
    other = rig.client("10.0.0.2")
    rig.now = 0.1
    rig.crowd(1000)
    assert other not in rig.closed
    rig.crowd(100, stage=ConnectionStage.SESSION)
    assert len(rig.admission) == MOST_OF_ADDRESS + 1


def test_sessions_make_no_room_but_leave_some(rig: Rig) -> None:
    sessions = rig.crowd(MOST_OF_ADDRESS, stage=ConnectionStage.SESSION)
    assert not rig.client().is_in
    assert rig.client("10.0.0.2").is_in
    assert rig.closed == []
    rig.admission.leave(sessions[0].visitor)
    assert rig.client().is_in


def test_when_all_are_taken_only_who_waits_makes_room(rig: Rig) -> None:
    waiting = rig.client("10.0.9.9")
    for number in range(MOST_CONNECTIONS - 1):
        rig.client(f"10.0.1.{number}", ConnectionStage.SESSION)
    assert rig.client("10.0.2.1", ConnectionStage.SESSION).is_in
    assert rig.closed == [waiting]
    assert not rig.client("10.0.2.2").is_in
    assert len(rig.admission) == MOST_CONNECTIONS


def test_one_place_is_kept_for_the_highest_role(rig: Rig) -> None:
    readers = [rig.client(f"10.0.1.{number}", ConnectionStage.SESSION) for number in range(MOST_CONNECTIONS)]
    rig.admission.look(0.0)
    assert rig.closed == readers[: -KEPT - 1 : -1], "anybody may try the last place, none of them keeps it"
    operator = rig.client("10.0.2.1", ConnectionStage.CHANNEL)
    assert operator.is_in
    operator.stage, operator.rank = ConnectionStage.SESSION, 1
    rig.admission.look(1.0)
    assert operator not in rig.closed
    assert rig.client("10.0.2.2").is_in, "to come back to a session on"


def test_an_operator_is_locked_out_by_no_crowd_of_observers(rig: Rig) -> None:
    """However many operators are there already."""
    for number in range(MOST_CONNECTIONS - KEPT):
        rig.client(f"10.0.1.{number}", ConnectionStage.SESSION)
    for number in range(10):
        operator = rig.client("10.0.2.1", ConnectionStage.CHANNEL)
        assert operator.is_in
        operator.stage, operator.rank = ConnectionStage.SESSION, 1
        rig.admission.look(number)
    assert len(rig.closed) == 10
    assert {one.rank for one in rig.closed} == {0}


def test_who_has_the_highest_role_keeps_its_place_and_the_lowest_yields_first() -> None:
    rig = Rig(limits(top_rank=2))

    def comes(source: str, rank: int) -> Client:
        one = rig.client(source, ConnectionStage.SESSION)
        one.rank = rank
        return one

    operators = [comes("10.0.1.1", 1) for _ in range(45)]
    engineers = [comes(f"10.0.2.{number}", 2) for number in range(54)]
    observer = comes("10.0.3.1", 0)
    rig.admission.look(0.0)
    assert rig.closed == [observer]
    engineers.append(comes("10.0.2.99", 2))
    rig.admission.look(1.0)
    assert rig.closed == [observer, operators[-1]]
    assert not set(engineers) & set(rig.closed)


@pytest.mark.parametrize("by_name", [False, True])
def test_of_one_role_the_largest_crowd_yields_its_last(rig: Rig, by_name: bool) -> None:
    """A crowd is one user from wherever, or one address without a name."""
    many = [rig.client(f"10.1.{n if by_name else 0}.1", ConnectionStage.SESSION) for n in range(40)]
    for one in many:
        one.user = "panel" if by_name else ""
    others = [rig.client(f"10.2.{number}.1", ConnectionStage.SESSION) for number in range(60)]
    rig.admission.look(0.0)
    assert rig.closed == many[-1:]
    assert not set(others) & set(rig.closed)


def test_of_one_address_too_a_place_is_kept_for_the_highest_role(rig: Rig) -> None:
    readers = rig.crowd(MOST_OF_ADDRESS, "10.0.0.1", ConnectionStage.SESSION)
    rig.admission.look(0.0)
    assert rig.closed == readers[: -KEPT - 1 : -1]
    assert rig.client("10.0.0.1", ConnectionStage.CHANNEL).is_in


def test_where_all_yield_a_newcomer_always_gets_in_at_the_expense_of_the_largest_crowd() -> None:
    rig = Rig(Limits(4, 4, 4, all_yield=True))
    owner = rig.client("10.0.0.2", ConnectionStage.SESSION)
    crowd = rig.crowd(3, "10.0.0.3", ConnectionStage.SESSION)
    assert rig.client("10.0.0.4").is_in
    assert rig.closed == crowd[:1]
    assert rig.client("10.0.0.3").is_in
    assert owner not in rig.closed


def test_a_refusal_and_an_end_have_one_kind_of_line_each(rig: Rig) -> None:
    for _ in range(MOST_OF_ADDRESS):
        rig.client(stage=ConnectionStage.SESSION)
    for _ in range(20):
        rig.client()
    assert {(kind, source) for kind, source, _ in rig.told} == {("refused connections", "10.0.0.1")}
    assert rig.counted == ["refused"] * 20
    assert rig.admission.count_of("10.0.0.1") == MOST_OF_ADDRESS


@pytest.mark.parametrize(
    ("host", "source"),
    [
        ("10.0.0.1", "10.0.0.1"),
        ("::ffff:10.0.0.1", "10.0.0.1"),
        ("::1", "::1"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("fe80::1%eth0", "fe80::/64"),
        ("nonsense", "nonsense"),
    ],
)
def test_one_machine_is_one_source(host: str, source: str) -> None:
    assert source_of(host) == source
