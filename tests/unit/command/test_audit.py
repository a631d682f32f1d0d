"""The audit trail: who asked what of the plant, and that a busy controller does not fill a disk."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import (
    Action,
    Code,
    Event,
    EventKind,
    Identity,
    Outcome,
    Rejection,
    Reply,
    Request,
    Source,
    Start,
    Write,
    command_of,
)
from bridge.command.audit import SUMMARY_S, AuditEntry
from bridge.command.drive_link import NodeState
from bridge.image import Value
from tests.support import sites
from tests.support.node_states import node_goes
from tests.support.rig import ENABLE, ENGINEER, OBSERVER, OPERATOR, OTHER_PLC, PLC, SHUT_DOWN

FU1 = "conveyor/fu1"
SITE = sites.site(
    sites.bus(
        sites.node(
            sites.drive("fu1", "modbus", 200, f"fieldbus_timeout_writable = true\n{sites.SCALED}"),
            sites.drive("fu2", "lease", 0),
        )
    ),
    sites.modbus(),
)


class Hall:
    """A plant with its trail, on a virtual clock."""

    def __init__(self, text: str = SITE, *, every_telegram: bool = False) -> None:
        self.plant = sites.plant_of(text)
        self.entries: list[AuditEntry] = []
        self.events: list[Event] = []
        self.plant.on_event(self.events.append)
        self.plant.audit.tell_to(self.entries.append, every_telegram=every_telegram)
        self.now = 100.0
        node_goes(self.plant, self.plant.nodes["conveyor"], NodeState.OPERATIONAL, self.now)
        self.plant.audit.on_time(self.now)

    def ask(self, action: Action, identity: Identity = PLC, target: str = FU1, **more: int) -> Outcome:
        outcomes: list[Outcome] = []
        self.plant.submit(Request(identity, target, command_of(action, **more)), self.now, outcomes.append)
        (outcome,) = outcomes
        return outcome

    def write(self, identity: Identity = PLC, **values: Value) -> None:
        request = Request(identity, FU1, Write(values))
        self.plant.submit(request, self.now, lambda outcome: None)

    def cycle(self, seconds: float, period_s: float = 0.01, **values: Value) -> None:
        """Telegrams as a controller sends them, the trail's clock beside them."""
        for _ in range(round(seconds / period_s)):
            self.now += period_s
            self.write(**values)
            self.plant.audit.on_time(self.now)

    def told(self) -> list[tuple[str, str, int]]:
        """Action, outcome and count of the entries since the last call."""
        told = [(entry.action, entry.ending.code, entry.count) for entry in self.entries]
        self.entries.clear()
        return told


@pytest.fixture
def hall() -> Hall:
    return Hall()


def test_a_write_has_who_what_old_and_new(hall: Hall) -> None:
    hall.write(control_word=SHUT_DOWN)
    hall.write(control_word=ENABLE, frequency=25.0)
    first, second = hall.entries
    assert (first.time, first.identity, first.target, first.action) == (100.0, PLC, FU1, "write")
    assert (first.old, first.new) == ({"control_word": 0x0400}, {"control_word": SHUT_DOWN})
    assert second.old == {"control_word": SHUT_DOWN, "frequency": 0.0}
    assert second.new == {"control_word": ENABLE, "frequency": 25.0}
    assert second.ending == (Code.OK, "", True)


def test_what_was_taken_and_not_forwarded_says_so(hall: Hall) -> None:
    hall.write(control_word=ENABLE)
    (entry,) = hall.entries
    assert entry.ending.code == Code.OK
    assert not entry.ending.forwarded
    assert "interlock" in entry.ending.message


@pytest.mark.parametrize("stranger", [OTHER_PLC, OPERATOR, OBSERVER, ENGINEER])
def test_a_refusal_is_told_with_its_reason(hall: Hall, stranger: Identity) -> None:
    hall.write(control_word=SHUT_DOWN)
    hall.write(stranger, control_word=ENABLE)
    entry = hall.entries[-1]
    assert entry.identity == stranger
    assert entry.ending.code == Code.NOT_ALLOWED
    assert entry.ending.message
    assert (entry.old, entry.new) == ({"control_word": SHUT_DOWN}, {"control_word": ENABLE})


@pytest.mark.parametrize(
    ("action", "more", "old", "new"),
    [
        (Action.TAKE_CONTROL, {}, {"owner": ""}, {"owner": str(PLC), "ttl_ms": 0}),
        (Action.RELEASE_CONTROL, {}, {"owner": ""}, {"owner": ""}),
        (Action.RESET_FAULT, {}, {}, {}),
        (Action.QUICK_STOP, {}, {}, {}),
    ],
)
def test_every_command_is_told(
    hall: Hall, action: Action, more: dict[str, int], old: dict[str, Value], new: dict[str, Value]
) -> None:
    assert hall.ask(action, **more).ok
    (entry,) = hall.entries
    assert (entry.action, entry.old, entry.new) == (action, old, new)


def test_another_time_out_is_told(hall: Hall) -> None:
    hall.write(control_word=SHUT_DOWN)
    assert hall.ask(Action.SET_TIMEOUT, timeout_ms=300).ok
    entry = hall.entries[-1]
    assert entry.action == Action.SET_TIMEOUT
    assert (entry.old, entry.new) == ({"fieldbus_timeout_ms": 200}, {"fieldbus_timeout_ms": 300})


def test_a_start_is_told_when_it_has_ended(hall: Hall) -> None:
    request = Request(PLC, FU1, Start(direction=1))
    hall.plant.submit(request, hall.now, lambda outcome: None)
    assert not hall.entries
    assert hall.ask(Action.DISABLE_VOLTAGE).ok
    assert hall.told() == [("start", "cancelled", 1), ("disable_voltage", "ok", 1)]


def test_commands_of_nodes_and_to_nobody_are_told(hall: Hall) -> None:
    assert not hall.ask(Action.RESET, target="conveyor").ok  # no bus, nobody to carry it out
    assert not hall.ask(Action.STOP, target="attic/fu9").ok
    assert [entry.target for entry in hall.entries] == ["conveyor", "attic/fu9"]
    assert {entry.ending.code for entry in hall.entries} == {Code.UNKNOWN_TARGET}


def test_a_refused_command_of_a_node_is_an_event_and_counts(hall: Hall) -> None:
    def refuse(request: Request, now: float, reply: Reply) -> bool:
        reply(Outcome(Code.NOT_ALLOWED, "may only read", forwarded=False))
        return True

    request = Request(OBSERVER, "conveyor", command_of(Action.RESET))
    outcomes: list[Outcome] = []
    hall.plant.submit(request, hall.now, outcomes.append, refuse)
    assert not outcomes[0].ok
    (event,) = [event for event in hall.events if event.kind is EventKind.REFUSED]
    assert (event.source, event.message) == ("conveyor", "reset by opcua:guest refused: may only read")
    hall.plant.refresh(hall.now)
    assert hall.plant.image.read("bridge/refused_writes").value == 1


def test_what_a_protocol_refuses_by_itself_is_told_as_an_event_and_counts(hall: Hall) -> None:
    hall.plant.rejected(Rejection(OBSERVER, FU1, Action.WRITE, Code.READ_ONLY, "BadNotWritable"), hall.now, 3)
    hall.plant.rejected(Rejection(OBSERVER, "attic/fu9", "call", Code.UNKNOWN_POINT, "no such"), hall.now)
    assert hall.told() == [("write", "read_only", 3), ("call", "unknown_point", 1)]
    events = [(event.source, event.message) for event in hall.events if event.kind is EventKind.REFUSED]
    assert events == [
        (FU1, "write by opcua:guest refused: BadNotWritable"),
        ("bridge", "call on 'attic/fu9' by opcua:guest refused: no such"),
    ]
    hall.plant.refresh(hall.now)
    assert hall.plant.image.read("bridge/refused_writes").value == 4


def test_several_requests_that_are_told_as_one_name_nobody(hall: Hall) -> None:
    nobody = Identity(Source.OPCUA, "", address="10.0.0.9")
    hall.plant.rejected(Rejection(nobody, "", "", Code.UNKNOWN_POINT, ""), hall.now, 7)
    (event,) = [event for event in hall.events if event.kind is EventKind.REFUSED]
    assert (event.source, event.message) == ("bridge", "requests by opcua refused")


def test_without_a_listener_nothing_is_followed(hall: Hall) -> None:
    hall.plant.audit.tell_to(None)
    hall.write(control_word=SHUT_DOWN)
    assert not hall.entries


class TestBusyControllers:
    @pytest.mark.landing
    def test_telegrams_that_change_nothing_are_counted(self, hall: Hall) -> None:
        hall.write(control_word=SHUT_DOWN, setpoint_1=0)
        hall.cycle(SUMMARY_S + 1, control_word=SHUT_DOWN, setpoint_1=0)
        told = hall.told()
        assert told[0] == ("write", "ok", 1)
        assert [(action, code) for action, code, _ in told[1:]] == [("telegrams", "ok")]
        assert told[1][2] == pytest.approx(SUMMARY_S * 100, abs=2)

    def test_a_changed_control_word_is_told_at_once(self, hall: Hall) -> None:
        hall.write(control_word=SHUT_DOWN)
        hall.cycle(0.5, control_word=SHUT_DOWN)
        hall.told()
        hall.write(control_word=ENABLE)
        assert hall.told() == [("telegrams", "ok", 50), ("write", "ok", 1)]

    def test_a_changed_bit_of_it_is_told_at_once(self, hall: Hall) -> None:
        hall.write(**{"control_word.11": True})
        hall.cycle(0.5, **{"control_word.11": True})
        hall.told()
        hall.write(**{"control_word.11": False})
        assert hall.told() == [("telegrams", "ok", 50), ("write", "ok", 1)]

    def test_a_ramp_of_setpoints_is_told_once_a_second_and_at_its_end(self, hall: Hall) -> None:
        hall.write(control_word=ENABLE, setpoint_1=0)
        hall.told()
        for value in range(500):
            hall.cycle(0.01, control_word=ENABLE, setpoint_1=value)
        hall.cycle(2, control_word=ENABLE, setpoint_1=499)
        writes = [entry for entry in hall.entries if entry.action == "write"]
        assert 5 <= len(writes) <= 7
        assert writes[-1].new["setpoint_1"] == 499, "the last one is known"

    def test_a_word_that_flutters_is_bounded(self, hall: Hall) -> None:
        for _ in range(50):
            hall.cycle(0.01, control_word=SHUT_DOWN)
            hall.cycle(0.01, control_word=ENABLE)
        assert len(hall.entries) <= 2 * 20 + 4
        hall.plant.audit.sum_up(hall.now)
        assert sum(entry.count for entry in hall.entries) == 100, "none is forgotten"

    def test_what_ends_otherwise_than_before_is_told(self, hall: Hall) -> None:
        hall.write(control_word=SHUT_DOWN)
        hall.write(control_word=ENABLE)
        hall.told()
        hall.now += 1  # the watchdog has tripped
        hall.write(control_word=ENABLE)
        hall.write(control_word=ENABLE)
        (entry,) = hall.entries
        assert entry.ending.message == "tripped: acknowledge first"

    def test_after_a_release_the_same_words_are_told_again(self, hall: Hall) -> None:
        hall.write(control_word=SHUT_DOWN)
        hall.ask(Action.RELEASE_CONTROL)
        hall.write(control_word=SHUT_DOWN)
        assert [action for action, _, _ in hall.told()] == ["write", "release_control", "write"]

    def test_another_owner_begins_anew(self, hall: Hall) -> None:
        hall.write(control_word=SHUT_DOWN)
        hall.now += 1
        hall.write(OTHER_PLC, control_word=SHUT_DOWN)
        assert [entry.identity for entry in hall.entries] == [PLC, OTHER_PLC]

    def test_keep_alives_are_telegrams(self, hall: Hall) -> None:
        for _ in range(100):
            hall.ask(Action.KEEP_ALIVE)
        assert hall.told() == [("keep_alive", "ok", 1)]
        hall.plant.audit.sum_up(hall.now)
        assert hall.told() == [("telegrams", "ok", 99)]

    def test_refusals_are_bounded_for_each_who_is_refused_and_counted(self, hall: Hall) -> None:
        hall.write(control_word=SHUT_DOWN)
        hall.told()
        for _ in range(1000):
            hall.write(OTHER_PLC, control_word=ENABLE)
        hall.write(OPERATOR, control_word=ENABLE)
        assert len(hall.entries) == 21
        hall.told()
        hall.plant.audit.sum_up(hall.now)
        assert hall.told() == [("write", "not_allowed", 980)]

    @pytest.mark.landing
    def test_somebody_who_invents_names_fills_no_memory(self, hall: Hall) -> None:
        for number in range(5000):
            stranger = Identity(Source.ZENOH, f"nobody{number}")
            hall.write(stranger, control_word=ENABLE)
        assert len(hall.entries) <= 1000 + 20
        hall.plant.audit.sum_up(hall.now)
        assert sum(entry.count for entry in hall.entries) == 5000

    def test_a_summary_names_each_who_was_refused_and_each_target(self, hall: Hall) -> None:
        """Users behind one address: none is told for what another one did."""
        clerks = [Identity(Source.OPCUA, name, address="10.0.0.9:1") for name in ("ann", "bob", "demo")]
        targets = [f"attic/fu{number}" for number in range(3)]
        for _ in range(100):
            for who, target in zip(clerks, targets, strict=True):
                assert not hall.ask(Action.STOP, who, target).ok
        hall.told()
        hall.plant.audit.sum_up(hall.now)
        sums = {(entry.identity.user, entry.target): entry.count for entry in hall.entries}
        assert sums.keys() == {("ann", "attic/fu0"), ("bob", "attic/fu1"), ("demo", "attic/fu2")}
        assert sum(sums.values()) == 300 - 20
        assert max(sums.values()) - min(sums.values()) <= 1

    def test_a_summary_of_many_leaves_out_what_differs(self, hall: Hall) -> None:
        for number in range(500):
            who = Identity(Source.OPCUA, f"user{number}", address=f"10.0.0.9:{1000 + number}")
            hall.ask(Action.STOP, who, f"attic/fu{number}")
        hall.told()
        hall.plant.audit.sum_up(hall.now)
        *named, rest = hall.entries
        assert len(named) == 4
        assert {entry.count for entry in named} == {1}
        assert (rest.identity.user, rest.identity.address, rest.target) == ("", "10.0.0.9", "")
        assert (rest.action, rest.ending.code, rest.count) == ("stop", Code.UNKNOWN_TARGET, 500 - 20 - 4)

    @given(
        st.lists(
            st.tuples(
                st.integers(0, 3),
                st.integers(0, 30),
                st.integers(0, 30),
                st.sampled_from(("stop", "reset", "x")),
            ),
            max_size=300,
        )
    )
    def test_no_line_says_of_anybody_what_others_did(self, asked: list[tuple[int, int, int, str]]) -> None:
        """Every field that a line has is true of as many requests as it counts."""
        hall = Hall()
        made: list[tuple[str, str, str, str]] = []
        for host, user, target, action in asked:
            name, place = f"user{user}", f"attic/{target}"
            who = Identity(Source.OPCUA, name, address=f"10.0.0.{host}:{user}")
            made.append((f"10.0.0.{host}", name, place, action))
            hall.plant.rejected(Rejection(who, place, action, Code.UNKNOWN_TARGET, "no such"), hall.now)
        hall.plant.audit.sum_up(hall.now)
        told: Counter[tuple[str, str, str, str]] = Counter()
        for entry in hall.entries:
            address = entry.identity.address.partition(":")[0]
            told[address, entry.identity.user, entry.target, entry.action] += entry.count
        assert sum(told.values()) == len(made)
        for fields, count in told.items():
            fitting = sum(all(a in ("", b) for a, b in zip(fields, one, strict=True)) for one in made)
            assert count <= fitting, fields

    def test_every_telegram_is_told_where_the_site_wants_it(self) -> None:
        hall = Hall(every_telegram=True)
        hall.cycle(1, control_word=SHUT_DOWN)
        assert hall.told() == [("write", "ok", 1)] * 100
