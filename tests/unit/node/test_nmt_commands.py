"""Commands on nodes: who may give them, what is answered and sent, and what each does."""

from __future__ import annotations

from typing import Any, cast

import pytest

from bridge.canopen.nmt import NmtCommand
from bridge.command import Action, Code, Event, Identity, Outcome, Request, Role, Source
from bridge.command.drive_link import NodeState
from bridge.command.messages.request import Do
from bridge.node.nmt_commands import NMT, CommandedNode, answer, carry_out, refusal
from bridge.text import Text, render
from tests.support import sites

OPERATOR = Identity(Source.OPCUA, "ann", Role.OPERATOR)
OBSERVER = Identity(Source.OPCUA, "bob", Role.OBSERVER)
ENGINEER = Identity(Source.OPCUA, "eve", Role.ENGINEER)
PLC = Identity(Source.MODBUS, "192.168.1.10")


class Channel:
    owner: Identity | None = None


class One:
    """A node with one drive, and what it is told."""

    def __init__(self, owner: Identity | None = None, takeover_s: float = 0.0) -> None:
        self.name = "conveyor/fu1"
        self.channel = Channel()
        self.channel.owner = owner
        self.node: Any = self
        self.commanded = [self]
        self.leaving: Any = self
        self.takeover_s = takeover_s
        self.told: list[tuple[Action, bool]] = []

    def carry_out_command(self, action: Action, who: str, now: float, *, send: bool = True) -> None:
        self.told.append((action, send))


class Asked:
    def __init__(self, action: Action, target: str, *nodes: One, who: Identity = OPERATOR) -> None:
        plant = sites.plant_of(sites.site(sites.bus(sites.node(sites.drive("fu1", "none", 0)))))
        self.events: list[Event] = []
        plant.on_event(self.events.append)
        outcomes: list[Outcome] = []
        request = Request(who, target, Do(action))
        them = cast("list[CommandedNode]", list(nodes))
        self.is_one_frame = answer(request, "the log", them, plant, 10.0, outcomes.append)
        (self.outcome,) = outcomes


def test_a_command_to_a_node_is_carried_out_and_told() -> None:
    node = One()
    asked = Asked(Action.STOP_NODE, "conveyor", node)
    assert asked.outcome.code is Code.OK
    assert not asked.is_one_frame
    assert node.told == [(Action.STOP_NODE, True)]
    assert [event.message for event in asked.events] == [f"stop_node by {OPERATOR}"]


def test_one_frame_tells_a_bus_but_for_a_start() -> None:
    """An unchecked node is not started."""
    for action in NMT:
        nodes = One(), One()
        asked = Asked(action, "bus/can0", *nodes)
        assert asked.is_one_frame is (action is not Action.START_NODE)
        assert [node.told for node in nodes] == [[(action, action is Action.START_NODE)]] * 2


def test_where_a_node_has_to_take_over_its_stopped_words_each_gets_its_own() -> None:
    nodes = One(), One(takeover_s=0.01)
    assert not Asked(Action.STOP_NODE, "bus/can0", *nodes).is_one_frame
    assert all(node.told == [(Action.STOP_NODE, True)] for node in nodes)


def test_a_bus_knows_nmt_alone() -> None:
    node = One()
    asked = Asked(Action.DISABLE, "bus/can0", node)
    assert (asked.outcome.code, asked.outcome.message) == (Code.UNKNOWN_TARGET, "a bus has no disable")
    assert node.told == []
    assert asked.events == []


@pytest.mark.parametrize(
    ("who", "owner", "why"),
    [
        (OBSERVER, None, f"{OBSERVER} may only read"),
        (OPERATOR, None, None),
        (OPERATOR, OPERATOR, None),
        (OPERATOR, PLC, f"conveyor/fu1 is controlled by {PLC.named_beside(OPERATOR)}"),
        (ENGINEER, PLC, None),
    ],
)
def test_who_may_command_a_node(who: Identity, owner: Identity | None, why: str | None) -> None:
    request = Request(who, "conveyor", Do(Action.RESET))
    found = refusal(request, cast("Any", [One(), One(owner)]))
    assert (None if found is None else render(found)) == why
    node = One(owner)
    asked = Asked(Action.RESET, "conveyor", node, who=who)
    assert (asked.outcome.code is Code.OK) is (why is None)
    assert bool(node.told) is (why is None)


class Told:
    """A node whose commands are carried out, and what is done to it in its order."""

    def __init__(self, state: NodeState = NodeState.OPERATIONAL) -> None:
        self.state = state
        self.did: list[object] = []
        self.wire: Any = self
        self.leaving: Any = self

    def leave_operation(self, now: float) -> None:
        self.did.append("left operation")

    def boot_next(self, at: float | None) -> None:
        self.did.append(("boot", at))

    def say(self, said: Text, now: float) -> None:
        self.did.append(render(said))

    def set_state(self, state: NodeState, now: float) -> None:
        self.did.append(state)

    def stop_drives(self, now: float) -> None:
        self.did.append("stopped its drives")

    def send_stopped(self) -> None:
        self.did.append("stopped words")

    def was_told(self, command: NmtCommand) -> None:
        self.did.append(("was told", command))

    def send(self, command: NmtCommand, now: float, *, at_once: bool) -> None:
        self.did.append(("after its words" if not at_once else "at once", command))

    def silence(self, now: float) -> None:
        self.did.append("silent")

    def send_nmt(self, command: NmtCommand) -> None:
        self.did.append(("nmt", command))


def done(action: Action, state: NodeState = NodeState.OPERATIONAL, **how: bool) -> list[object]:
    node = Told(state)
    carry_out(cast("CommandedNode", node), action, "ann", 10.0, **how)
    return node.did


def test_a_node_is_switched_off_and_on() -> None:
    off = ["left operation", ("boot", None), "switched off by an operator", NodeState.DISABLED]
    assert done(Action.DISABLE) == off
    assert done(Action.ENABLE, NodeState.DISABLED) == ["waiting", NodeState.ABSENT, ("boot", 10.0)]
    assert done(Action.ENABLE) == []


def test_a_node_is_started_only_after_its_boot() -> None:
    assert done(Action.START_NODE) == [("nmt", NmtCommand.START)]
    booted = ["left operation", NodeState.BOOTING, ("boot", 10.0)]
    assert done(Action.START_NODE, NodeState.STOPPED) == booted
    assert done(Action.START_NODE, NodeState.DISABLED) == []


STOPS = ["stopped its drives", "stopped words"]


def sending(command: NmtCommand) -> list[object]:
    """A command that leaves Operational with drives that may go on as they were told follows their words."""
    if command is NmtCommand.RESET_NODE:
        return [("nmt", command)]
    return [("after its words", command), "silent"]


@pytest.mark.parametrize("action", [Action.RESET, Action.RESET_COMMUNICATION])
def test_a_reset_stops_the_drives_first_and_boots_the_node_a_second_later(action: Action) -> None:
    told = ["left operation", ("was told", NMT[action]), NodeState.LOST, ("boot", 11.0)]
    assert done(action) == [*STOPS, *sending(NMT[action]), *told]


@pytest.mark.parametrize(
    ("action", "text"),
    [(Action.STOP_NODE, "stopped by ann"), (Action.ENTER_PRE_OPERATIONAL, "set to pre-operational by ann")],
)
def test_a_node_that_is_stopped_stays_so_and_says_by_whom(action: Action, text: str) -> None:
    told = ["left operation", ("was told", NMT[action]), ("boot", None), text, NodeState.STOPPED]
    assert done(action) == [*STOPS, *sending(NMT[action]), *told]
    assert done(action, send=False) == [*STOPS, "silent", *told]
    assert done(action, at_once=True)[2] == ("at once", NMT[action])


def test_nmt_to_a_node_that_is_switched_off_changes_nothing_here() -> None:
    assert done(Action.RESET, NodeState.DISABLED) == [*STOPS, ("nmt", NmtCommand.RESET_NODE)]
    stopped = [*STOPS, *sending(NmtCommand.STOP)]
    assert done(Action.STOP_NODE, NodeState.DISABLED) == stopped
