"""Each frame of somebody else, case by case: whose it is, whom it affects, and how often it is answered.

The nodes are played: what the whole bridge does is in ``test_intruders.py`` and ``test_intruding_master.py``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from types import SimpleNamespace
from typing import Any, Final, cast

import pytest

from bridge.canopen.frame import Frame
from bridge.command import EventQueue
from bridge.config import BusTable
from bridge.drive import DriveState
from bridge.master import intruders
from bridge.master.intruders import Intruders, NmtStop
from bridge.master.mastership import BusMastership
from bridge.node.node_core import NodeCore
from bridge.text import render

RUN, STOP = b"\x01", b"\x00"
"""What a played command says."""
START, NMT_STOP, PRE_OPERATIONAL, RESET = 0x01, 0x02, 0x80, 0x81
READ, WRITE = bytes.fromhex("4000100000000000"), bytes.fromhex("2b17100064000000")
SEVERE, HARMLESS = 900, 500
PATIENCE_S: Final = 1.0


class Command:
    def __init__(self, label: str) -> None:
        self.label = label

    def enables(self, data: bytes) -> bool:
        return data == RUN

    def said(self, data: bytes) -> str:
        return "run" if data == RUN else "stop"


class Node:
    """``commands`` are its RPDOs; ``given`` those by the site's files, ``speaks`` the TPDOs of its drive."""

    def __init__(
        self,
        node_id: int,
        commands: Sequence[int] = (),
        *,
        given: Sequence[int] = (),
        speaks: Sequence[int] = (),
        servers: Sequence[int] = (),
        synchronous: bool = False,
    ) -> None:
        tpdos = [SimpleNamespace(cob_id=one) for one in speaks]
        self.table = SimpleNamespace(id=node_id, drive=[SimpleNamespace(tpdo=tpdos)])
        pdo = SimpleNamespace(is_synchronous=synchronous)
        self.commands = {one: Command(f"RPDO {one:X}") for one in commands}
        self.wire = SimpleNamespace(
            drives={},
            output_pdos={},
            stop_words=SimpleNamespace(given_ids=given),
            sdo=[SimpleNamespace(request_id=0x600 + node_id)],
            pdos=[SimpleNamespace(rpdos=[], tpdos=[pdo])],
        )
        self.link = SimpleNamespace(last_pdo=None)
        channel = SimpleNamespace(link=self.link, state=DriveState.NOT_READY)
        self.drive = SimpleNamespace(channel=channel)
        family = SimpleNamespace(sdo=[SimpleNamespace(request=one) for one in servers])
        self.node = SimpleNamespace(name=f"n{node_id}", family=family, drives=[self.drive])
        self.leaving = SimpleNamespace(is_stopped_by_nmt=False)
        self.is_held = self.is_out_of_service = False
        self.started_at = 0.0
        self.again: list[float] = []
        self.resets: list[float] = []

    def hold_again(self, now: float) -> None:
        self.again.append(now)

    def hold_by_reset(self, now: float) -> None:
        self.resets.append(now)

    def says_enabled(self, at: float) -> None:
        self.link.last_pdo = at
        self.drive.channel.state = DriveState.OPERATION_ENABLED


class Bus:
    """Its intruders, with what they have said and whom they have stopped."""

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, *nodes: Node, taken: Sequence[int] = (), **keys: Any
    ) -> None:
        self.made = 0

        def commands_of(node: Any, *_: object) -> dict[int, Command]:
            self.made += 1
            return next(one.commands for one in nodes if one.node is node)

        monkeypatch.setattr(intruders, "commands_of", commands_of)
        table = BusTable.model_validate({"name": "can0", "interface": "virtual", **keys})
        self.nodes = nodes
        self.acts = True
        queue = EventQueue()
        self.events = queue.waiting
        self.stopped: list[tuple[list[str], str]] = []
        cores = [cast(NodeCore, node) for node in nodes]
        mastership = cast(BusMastership, SimpleNamespace(acts=lambda: self.acts))
        self.core = Intruders(table, cores, queue, mastership)
        self.taken = {one: lambda frame: None for one in taken}
        self.watched = self.core.watched(cast(Any, self.taken))
        self.passed: list[Frame] = []

    def carry_out(self, stops: Iterator[NmtStop]) -> None:
        for nodes, why, _ in stops:
            self.stopped.append(([node.node.name for node in nodes], why))
            for node in nodes:
                cast(Any, node).is_held = True

    def routes(self, *others: int) -> dict[int, Any]:
        return self.core.routes(dict.fromkeys(others, self.passed.append))

    def sees(self, can_id: int, data: bytes = b"", at: float = 10.0) -> None:
        self.carry_out(self.core.on_frame(Frame(can_id, data, time=at)))

    def hears(self, can_id: int, data: bytes = b"", at: float = 10.0) -> None:
        """A single frame, such as NMT or an SDO request."""
        self.carry_out(self.routes(0)[can_id](Frame(can_id, data, time=at)))

    @property
    def whom(self) -> list[list[str]]:
        return [names for names, _ in self.stopped]

    @property
    def said(self) -> str:
        return self.events[-1].message

    @property
    def severities(self) -> list[int]:
        return [event.severity for event in self.events]


@pytest.fixture
def make(monkeypatch: pytest.MonkeyPatch) -> Any:
    return lambda *nodes, **keys: Bus(monkeypatch, *nodes, **keys)


# whose identifiers


@pytest.mark.parametrize(
    ("keys", "watched"),
    [
        ({}, {0x080, 0x77F, 0x205}),
        ({"sync_period_ms": 0}, {0x77F, 0x205}),
        ({"heartbeat_ms": 0}, {0x080, 0x205}),
    ],
)
def test_what_the_bridge_sends_is_watched(make: Any, keys: dict[str, int], watched: set[int]) -> None:
    assert make(Node(5, [0x205]), **keys).watched == watched


@pytest.mark.parametrize(
    "nodes", [(Node(5, [0x205]), Node(6, given=[0x205])), (Node(5, [0x205], speaks=[0x205]),)]
)
def test_what_is_somebody_elses_by_the_site_file_is_not(make: Any, nodes: tuple[Node, ...]) -> None:
    assert 0x205 not in make(*nodes).watched


def test_what_a_node_has_taken_for_itself_is_not(make: Any) -> None:
    assert 0x205 not in make(Node(5, [0x205]), taken=[0x205]).watched
    assert 0x205 in make(Node(5, [0x205], given=[0x205])).watched


def test_what_a_node_is_commanded_by_is_looked_up_when_its_pdos_have_changed(make: Any) -> None:
    node = Node(5, [0x205])
    bus = make(node)
    bus.core.watched({})
    assert bus.made == 1
    node.wire.drives, node.commands = {"fu1": None}, {0x305: Command("other")}
    assert 0x305 in bus.core.watched({})
    assert bus.made == 2


@pytest.mark.parametrize("period_s", [0, 60])
def test_a_time_that_is_ours_is_looked_at(make: Any, period_s: int) -> None:
    bus = make(Node(5), time_period_s=period_s)
    assert (0x100 in bus.routes()) is bool(period_s)
    if period_s:
        bus.hears(0x100)
        assert (bus.severities, bus.stopped) == ([SEVERE], [])


@pytest.mark.parametrize(
    ("others", "commands", "looked_at"), [((), (), True), ((0x645,), (), False), ((), (0x645,), False)]
)
def test_a_further_sdo_server_is_looked_at_where_nobody_else_has_its_identifier(
    make: Any, others: tuple[int, ...], commands: tuple[int, ...], looked_at: bool
) -> None:
    """Those of CiA 301 §7.5.2.33, wherever the device has them."""
    bus = make(Node(5, commands, servers=[0x640]))
    routes = bus.routes(*others)
    assert (0x645 in routes) is looked_at
    assert 0x605 in routes


def test_a_server_that_is_used_keeps_who_hears_it(make: Any) -> None:
    bus = make(Node(5, servers=[0x600]))
    bus.carry_out(bus.routes(0x605)[0x605](Frame(0x605, READ)))
    assert len(bus.passed) == 1


def test_a_server_of_one_node_that_is_used_by_another_is_the_others(make: Any) -> None:
    bus = make(Node(5, servers=[0x601]), Node(6))
    bus.carry_out(bus.routes()[0x606](Frame(0x606, WRITE, time=10.0)))
    assert bus.whom == [["n6"]]


@pytest.mark.parametrize(
    ("can_id", "acts", "is_sign"),
    [
        (0x77F, True, True),
        (0x77F, False, True),
        (0x205, True, False),
        (0x205, False, True),
        (0x080, False, False),
    ],
)
def test_what_shows_that_another_bridge_is_in_charge(
    make: Any, can_id: int, acts: bool, is_sign: bool
) -> None:
    assert make(Node(5, [0x205])).core.is_sign(Frame(can_id, b""), acts=acts) is is_sign


@pytest.mark.parametrize(
    ("can_id", "name"),
    [
        (0x77F, "the heartbeat of node 127, the bridge's own (77Fh)"),
        (0x205, "RPDO 205 (205h)"),
        (0x080, "SYNC (080h)"),
    ],
)
def test_each_is_called_by_its_name(make: Any, can_id: int, name: str) -> None:
    assert str(make(Node(5, [0x205])).core.name(Frame(can_id, b""))) == name


# what comes


def test_an_rpdo_stops_its_node(make: Any) -> None:
    bus = make(Node(5, [0x205]), Node(6, [0x206]))
    bus.sees(0x206, STOP)
    [(nodes, why)] = bus.stopped
    assert nodes == ["n6"]
    assert render(why) == "the bridge, because of an intruder: RPDO 206 (206h): stop"
    assert bus.said == "intruder: RPDO 206 (206h): stop, from somebody else; NMT stop of n6"
    assert (bus.core.count, render(bus.core.last)) == (1, bus.said.removeprefix("intruder: "))


def test_sync_stops_those_that_follow_it(make: Any) -> None:
    bus = make(Node(5), Node(6, synchronous=True))
    bus.sees(0x080)
    assert bus.whom == [["n6"]]


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"\x05", "another device said operational"),
        (b"\x00", "another device said that it starts"),
        (b"", "another device said nonsense"),
        (b"\x05\x05", "another device said nonsense"),
    ],
)
def test_our_heartbeat_stops_them_all(make: Any, data: bytes, said: str) -> None:
    bus = make(Node(5), Node(6))
    bus.sees(0x77F, data)
    assert bus.whom == [["n5", "n6"]]
    assert said in bus.said
    assert bus.said.endswith("; all nodes get an NMT stop")


def test_one_node_is_called_by_its_name_where_it_is_the_only_one(make: Any) -> None:
    bus = make(Node(5))
    bus.sees(0x77F, b"\x05")
    assert bus.said.endswith("; NMT stop of n5")


def test_a_bridge_that_is_not_in_charge_has_no_intruders(make: Any) -> None:
    bus = make(Node(5, [0x205]))
    bus.acts = False
    bus.sees(0x205, RUN)
    assert (bus.core.count, bus.events, bus.stopped) == (0, [], [])


@pytest.mark.parametrize(
    ("on_intruder", "whom"), [("stop_node", [["n5"]]), ("stop_all", [["n5", "n6"]]), ("report", [])]
)
def test_whom_the_site_file_has_stopped(make: Any, on_intruder: str, whom: list[list[str]]) -> None:
    bus = make(Node(5, [0x205]), Node(6), on_intruder=on_intruder)
    bus.sees(0x205, RUN)
    assert bus.whom == whom
    assert bus.severities == [SEVERE]
    assert ("NMT stop" in bus.said) is bool(whom)


def test_frames_in_between_are_counted_and_told_every_ten_seconds(make: Any) -> None:
    bus = make(Node(5, [0x205]), on_intruder="report")
    for n in range(120):
        bus.sees(0x205, STOP, 10.0 + n / 10)
    assert bus.core.count == 120
    assert len(bus.events) == 2
    assert "from somebody else (100 frames since the last message)" in bus.said


def test_that_it_enables_is_told_at_once(make: Any) -> None:
    bus = make(Node(5, [0x205]), on_intruder="report")
    bus.sees(0x205, STOP)
    bus.sees(0x205, RUN, 10.01)
    assert [": run" in event.message for event in bus.events] == [False, True]


@pytest.mark.parametrize(("at", "is_stopped"), [(9.9, False), (10.0, False), (10.001, True)])
def test_a_frame_from_before_the_node_has_started_stops_nothing(
    make: Any, at: float, is_stopped: bool
) -> None:
    """Nor one that is taken in together with its boot-up message: both count as of the round's begin."""
    bus = make(Node(5, [0x205]))
    bus.nodes[0].started_at = 10.0
    bus.sees(0x205, RUN, at)
    assert bool(bus.stopped) is is_stopped
    assert ("NMT stop" in bus.said) is is_stopped


@pytest.mark.parametrize(
    ("state", "told"),
    [({}, [True, True]), ({"is_held": True}, [True]), ({"is_out_of_service": True}, [True])],
)
def test_a_stop_is_told_at_once(make: Any, state: dict[str, bool], told: list[bool]) -> None:
    """Also within the pause of what was told before; not to a node that takes no part."""
    bus = make(Node(5, [0x205]))
    bus.sees(0x205, RUN)
    for name, value in ({"is_held": False} | state).items():
        setattr(bus.nodes[0], name, value)
    bus.sees(0x205, RUN, 10.1)
    bus.sees(0x205, RUN, 10.2)
    assert ["NMT stop of n5" in event.message for event in bus.events] == told


# NMT and SDO


def test_who_else_hears_nmt_hears_it(make: Any) -> None:
    bus = make(Node(5))
    bus.hears(0, bytes((START, 5)))
    assert len(bus.passed) == 1


@pytest.mark.parametrize("data", [b"", b"\x02", b"\x01"])
def test_half_a_command_is_for_nobody(make: Any, data: bytes) -> None:
    bus = make(Node(5))
    bus.nodes[0].is_held = True
    bus.hears(0, data)
    assert bus.severities == [SEVERE]
    assert not bus.nodes[0].again


@pytest.mark.parametrize(
    ("command", "held", "severity"),
    [
        (NMT_STOP, (5, 6), HARMLESS),
        (NMT_STOP, (5,), SEVERE),
        (NMT_STOP, (), SEVERE),
        (RESET, (5, 6), SEVERE),
        (START, (5, 6), SEVERE),
    ],
)
def test_a_stop_of_what_is_stopped_is_harmless(
    make: Any, command: int, held: tuple[int, ...], severity: int
) -> None:
    bus = make(Node(5), Node(6))
    for node in bus.nodes:
        node.is_held = node.table.id in held
    bus.hears(0, bytes((command, 0)))
    assert bus.severities == [severity]


@pytest.mark.parametrize("addressed", [0, 5])
@pytest.mark.parametrize(
    ("command", "is_answered"), [(START, True), (PRE_OPERATIONAL, True), (NMT_STOP, False), (RESET, False)]
)
def test_who_may_come_back_is_told_again_at_once(
    make: Any, command: int, is_answered: bool, addressed: int
) -> None:
    bus = make(Node(5), Node(6))
    bus.nodes[0].is_held = True
    for n in range(3):
        bus.hears(0, bytes((command, addressed)), 10.0 + n / 10)
    assert len(bus.nodes[0].again) == 3 * is_answered
    assert not bus.nodes[1].again
    assert not bus.stopped


def test_a_start_of_another_node_brings_nobody_back(make: Any) -> None:
    bus = make(Node(5), Node(6))
    bus.nodes[0].is_held = True
    bus.hears(0, bytes((START, 6)))
    assert not bus.nodes[0].again


def test_that_nmt_brings_back_is_told_at_once(make: Any) -> None:
    bus = make(Node(5))
    bus.hears(0, bytes((RESET, 5)))
    bus.nodes[0].is_held = True
    bus.hears(0, bytes((START, 5)), 10.01)
    assert len(bus.events) == 2


@pytest.mark.parametrize(("data", "severity", "whom"), [(READ, HARMLESS, []), (WRITE, SEVERE, [["n5"]])])
def test_who_reads_is_told_and_who_writes_is_answered(
    make: Any, data: bytes, severity: int, whom: list[list[str]]
) -> None:
    bus = make(Node(5), Node(6), on_intruder="stop_node")
    bus.hears(0x605, data)
    assert (bus.severities, bus.whom) == ([severity], whom)
    assert bus.said.startswith("intruder: SDO request to n5 (605h): ")


def test_who_reads_is_answered_by_nothing_where_all_are_stopped(make: Any) -> None:
    bus = make(Node(5), on_intruder="stop_all")
    bus.hears(0x605, READ)
    assert not bus.stopped


def test_that_somebody_writes_is_told_at_once(make: Any) -> None:
    """Also where nobody is stopped for it, which would be told anyway."""
    bus = make(Node(5), on_intruder="report")
    bus.hears(0x605, READ)
    bus.hears(0x605, WRITE, 10.01)
    assert len(bus.events) == 2


# answered again


def test_who_is_held_is_told_again_for_each_enabling_rpdo_and_else_once_a_second(make: Any) -> None:
    bus = make(Node(5, [0x205]))
    bus.sees(0x205, STOP)
    node = bus.nodes[0]
    assert (bus.whom, node.again) == ([["n5"]], [])
    bus.sees(0x205, RUN, 10.1)
    bus.sees(0x205, RUN, 10.2)
    assert node.again == [10.1, 10.2]
    for n in range(20):
        bus.sees(0x205, STOP, 10.3 + n / 10)
    assert node.again[2:] == pytest.approx([11.2, 12.2])
    assert len(bus.stopped) == 1


def test_who_was_never_stopped_for_it_is_told_at_once(make: Any) -> None:
    bus = make(Node(5, [0x205]))
    bus.nodes[0].is_held = True
    bus.sees(0x205, STOP)
    assert bus.nodes[0].again == [10.0]


def test_who_runs_again_is_stopped_at_once(make: Any) -> None:
    bus = make(Node(5, [0x205]))
    for n in range(3):
        bus.sees(0x205, STOP, 10.0 + n / 10)
        bus.nodes[0].is_held = False
    assert bus.whom == [["n5"]] * 3


def test_an_answer_costs_what_is_sent_to_its_node(make: Any) -> None:
    """Three RPDOs of this node, one of the other."""
    few, many = (
        make(Node(5, [0x205, 0x305, 0x405][:count]), Node(6, [0x206, 0x306, 0x406]), bitrate=10_000)
        for count in (1, 3)
    )
    for bus in (few, many):
        bus.nodes[0].is_held = True
        for n in range(100):
            bus.sees(0x205, RUN, 10.0 + n / 10)
    assert len(many.nodes[0].again) * 1.7 < len(few.nodes[0].again) < 100


def test_who_waits_is_told_in_a_later_round(make: Any) -> None:
    bus = make(Node(5, [0x205]), bitrate=10_000)
    node = bus.nodes[0]
    node.is_held = True
    assert bus.core.next_deadline() is None
    for _ in range(5):
        bus.sees(0x205, RUN)
    told = len(node.again)
    due = bus.core.next_deadline()
    assert told < 5 and due is not None and due < 10.0 + PATIENCE_S
    bus.core.on_time(due)
    assert len(node.again) == told + 1


def test_a_bus_that_is_gone_takes_what_waits_along(make: Any) -> None:
    bus = make(Node(5, [0x205]), bitrate=10_000)
    bus.nodes[0].is_held = True
    for _ in range(5):
        bus.sees(0x205, RUN)
    told = len(bus.nodes[0].again)
    bus.core.bus_is_gone()
    assert bus.core.next_deadline() is None
    bus.nodes[0].says_enabled(20.0)
    bus.core.on_time(20.0)
    assert (len(bus.nodes[0].again), bus.nodes[0].resets) == (told, [])


# a drive that answers do not stop


def enduring(make: Any) -> Bus:
    """Its node is held and answered every 100 ms from 10.0 to 10.9."""
    bus = make(Node(5, [0x205]))
    bus.nodes[0].is_held = True
    goes_on(bus, 10.0, 0.9)
    return bus


def goes_on(bus: Bus, since: float, seconds: float, *, enabled: bool = True) -> None:
    for n in range(round(seconds * 10) + 1):
        at = round(since + n / 10, 6)
        if enabled:
            bus.nodes[0].says_enabled(at)
        bus.sees(0x205, RUN, at)


def test_a_drive_that_stays_enabled_is_reset_after_a_second_and_then_every_two(make: Any) -> None:
    bus = enduring(make)
    node = bus.nodes[0]
    assert not node.resets
    goes_on(bus, 11.0, 4.0)
    assert node.resets == pytest.approx([11.0, 13.0, 15.0])
    assert bus.said == "reset node: an intruder keeps a drive enabled, which an NMT stop does not stop"
    assert len(node.again) == 51 - 3


def test_a_node_that_nmt_stops_is_not_reset(make: Any) -> None:
    bus = enduring(make)
    bus.nodes[0].leaving.is_stopped_by_nmt = True
    goes_on(bus, 11.0, 4.0)
    assert not bus.nodes[0].resets


def test_a_drive_that_says_something_else_is_not_reset(make: Any) -> None:
    bus = enduring(make)
    bus.nodes[0].drive.channel.state = DriveState.NOT_READY
    for n in range(40):
        bus.nodes[0].link.last_pdo = 11.0 + n / 10
        bus.sees(0x205, RUN, 11.0 + n / 10)
    assert not bus.nodes[0].resets


def test_a_drive_that_was_never_heard_is_not_reset(make: Any) -> None:
    bus = make(Node(5, [0x205]))
    bus.nodes[0].is_held = True
    bus.nodes[0].drive.channel.state = DriveState.OPERATION_ENABLED
    goes_on(bus, 10.0, 4.0, enabled=False)
    assert not bus.nodes[0].resets


def test_a_drive_that_was_enabled_before_is_not_reset(make: Any) -> None:
    bus = make(Node(5, [0x205]))
    bus.nodes[0].is_held = True
    bus.nodes[0].says_enabled(9.9)
    goes_on(bus, 10.0, 4.0, enabled=False)
    assert not bus.nodes[0].resets


@pytest.mark.parametrize(("pause_s", "is_reset"), [(1.5, True), (2.5, False)])
def test_an_intruder_that_was_silent_for_two_seconds_begins_anew(
    make: Any, pause_s: float, is_reset: bool
) -> None:
    bus = enduring(make)
    bus.nodes[0].drive.channel.state = DriveState.NOT_READY
    bus.core.on_time(12.0)
    goes_on(bus, 10.9 + pause_s, 0.0)
    assert bool(bus.nodes[0].resets) is is_reset


def test_a_series_goes_on_with_each_answer(make: Any) -> None:
    bus = make(Node(5, [0x205]))
    bus.nodes[0].is_held = True
    goes_on(bus, 10.0, 2.9, enabled=False)
    goes_on(bus, 13.0, 0.0)
    assert len(bus.nodes[0].resets) == 1


def test_after_its_last_word_a_drive_is_looked_at_once_more(make: Any) -> None:
    bus = enduring(make)
    node = bus.nodes[0]
    assert bus.core.next_deadline() == pytest.approx(10.9 + PATIENCE_S)
    bus.core.on_time(11.5)
    assert not node.resets
    bus.core.on_time(11.9)
    assert node.resets == [11.9]
    assert bus.core.next_deadline() is None
    bus.core.on_time(20.0)
    assert node.resets == [11.9]


def test_after_its_last_word_a_drive_that_has_stopped_is_left_alone(make: Any) -> None:
    bus = enduring(make)
    bus.nodes[0].drive.channel.state = DriveState.NOT_READY
    bus.core.on_time(11.9)
    assert not bus.nodes[0].resets
    bus.nodes[0].says_enabled(15.0)
    bus.core.on_time(15.0)
    assert not bus.nodes[0].resets
