"""How a node is taken out of operation: its drives have had their stopped words before, or are told of."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.command import Action, Drive
from bridge.command.drive_link import NodeState
from bridge.command.stop_check.state import LastStop
from bridge.node.boot import BootMemory
from bridge.node.leaving import Leaving
from bridge.node.put_off import PutOff
from bridge.node.wire import NodeWire
from tests.support.judged_plant import JudgedPlant
from tests.support.leg_words import NORD_TU4, VELOCITY, LegWords

STOP = NmtCommand.STOP
TAKEOVER_S = 0.03
"""A synchronous RPDO: SYNC after 10 ms, and the bridge's own 20 ms."""


class Wire:
    """What the bridge sends to the node."""

    def __init__(self, line: JudgedPlant) -> None:
        self.put_off = PutOff()
        self.drives = {drive.name: object() for drive in line.plant.nodes["conveyor"].drives}
        self.sent: list[NmtCommand | str] = []
        self.error_control = SimpleNamespace(state=NmtState.UNKNOWN)

    def carries(self, one: Drive) -> bool:
        return one.name in self.drives

    def send_nmt(self, command: NmtCommand) -> None:
        self.sent.append(command)

    def send_stopped(self) -> None:
        self.sent.append("stopped words")


class Node:
    def __init__(
        self, words: LegWords = NORD_TU4, *slots: str, kind: int = 1, takes_words: bool = True
    ) -> None:
        self.line = JudgedPlant(words, *slots, rpdo_type=kind)
        self.wire = Wire(self.line)
        self.memory = BootMemory()
        node, wire = self.line.plant.nodes["conveyor"], cast(NodeWire, self.wire)
        self.leaving = Leaving(node, wire, self.memory)
        self.leaving.on_node(NodeState.OPERATIONAL if takes_words else NodeState.STOPPED)

    @property
    def now(self) -> float:
        return self.line.now


def test_a_command_waits_until_synchronous_words_have_been_taken_over() -> None:
    """CiA 301 §7.3.2.2.1: they take effect with SYNC, and in Operational alone."""
    node = Node()
    node.leaving.send(STOP, node.now)
    assert (node.wire.sent, node.leaving.is_due) == ([], True)
    assert node.leaving.takeover_s == pytest.approx(TAKEOVER_S)
    assert node.wire.put_off.next_deadline() == pytest.approx(node.now + TAKEOVER_S)


def test_where_words_take_effect_on_arrival_it_goes_out_at_once() -> None:
    node = Node(kind=255)
    node.leaving.send(STOP, node.now)
    assert (node.wire.sent, node.leaving.is_due) == ([STOP], False)


def test_a_node_that_takes_no_words_is_not_waited_for() -> None:
    node = Node(takes_words=False)
    node.leaving.send(STOP, node.now)
    assert node.wire.sent == [STOP]


def test_a_stopped_node_that_says_that_it_is_operational_is_waited_for() -> None:
    node = Node(takes_words=False)
    node.wire.error_control.state = NmtState.OPERATIONAL
    node.leaving.send(STOP, node.now)
    assert (node.wire.sent, node.leaving.is_due) == ([], True)


def test_who_has_had_the_words_for_long_is_not_waited_for() -> None:
    node = Node()
    node.leaving.send(STOP, node.now, at_once=True)
    assert node.wire.sent == [STOP]


@pytest.mark.parametrize("at_once", [False, True])
def test_what_is_sent_next_does_not_pass_a_command_that_waits(at_once: bool) -> None:
    node = Node()
    node.leaving.send(STOP, node.now)
    node.leaving.send(NmtCommand.RESET_COMMUNICATION, node.now, at_once=at_once)
    assert node.wire.sent == []
    assert node.wire.put_off.command is NmtCommand.RESET_COMMUNICATION


def test_the_slowest_drive_of_the_node_decides() -> None:
    node = Node(NORD_TU4, "fu1", "fu2", kind=255)
    other = node.line.plant.nodes["conveyor"].drives[1]
    other.on_pdos({}, [], node.now, deadline_s=None, rpdo_type=5)
    assert node.leaving.takeover_s == pytest.approx(TAKEOVER_S + 0.04)


@pytest.mark.parametrize(("for_s", "has_told"), [(TAKEOVER_S - 0.001, False), (TAKEOVER_S + 0.001, True)])
def test_the_node_has_been_told_when_every_drive_has_had_its_stop_for_long_enough(
    for_s: float, has_told: bool
) -> None:
    node = Node()
    node.line.enables()
    assert not node.leaving.has_told(node.now + 10.0), "it gets a word that enables"
    node.line.asks(Action.STOP)
    assert node.leaving.has_told(node.now + for_s) is has_told


def test_a_drive_that_gets_no_process_data_need_not_be_told() -> None:
    node = Node()
    node.line.enables()
    node.wire.drives.clear()
    assert node.leaving.has_told(node.now)


def silenced(*, is_heard: bool, only_heard: bool) -> LastStop:
    node = Node()
    node.line.enables()
    node.line.asks(Action.DISABLE_VOLTAGE)
    if not is_heard:
        node.line.now += 1.0
    node.leaving.silence(node.now, only_heard=only_heard)
    node.line.node(node.line.drive.channel.link.node.STOPPED)
    node.line.is_silent(node.now - 1024.0 + 2.0)
    return node.line.last_stop


def test_a_drive_that_was_enabled_when_its_node_left_is_named() -> None:
    assert silenced(is_heard=True, only_heard=False) is LastStop.IGNORED
    assert silenced(is_heard=True, only_heard=True) is LastStop.IGNORED


def test_of_a_node_that_is_silent_only_drives_that_are_heard_are_named() -> None:
    assert silenced(is_heard=False, only_heard=True) is LastStop.FORWARDED
    assert silenced(is_heard=False, only_heard=False) is LastStop.IGNORED


# what the node says


@pytest.mark.parametrize(
    ("words", "state", "is_at_rest"),
    [
        (VELOCITY, NmtState.STOPPED, True),
        (VELOCITY, NmtState.PRE_OPERATIONAL, False),
        # An NMT stop does not stop a NORD drive.
        (NORD_TU4, NmtState.STOPPED, False),
    ],
)
def test_stopped_means_at_rest_where_that_stops_the_family(
    words: LegWords, state: NmtState, is_at_rest: bool
) -> None:
    node = Node(words)
    node.line.enables()
    node.line.asks(Action.DISABLE_VOLTAGE)
    node.line.is_cut_off()
    node.leaving.on_state(state, node.now)
    assert node.memory.is_at_rest is is_at_rest
    assert node.line.last_stop is (LastStop.FOLLOWED if is_at_rest else LastStop.FORWARDED)


def test_a_node_in_operation_is_not_at_rest() -> None:
    node = Node()
    node.memory.is_at_rest = True
    node.leaving.on_state(NmtState.OPERATIONAL, node.now)
    assert not node.memory.is_at_rest


def test_after_a_restart_nothing_waits_and_nobody_is_judged_by_what_was_before() -> None:
    node = Node()
    node.line.enables()
    node.line.asks(Action.DISABLE_VOLTAGE)
    node.leaving.send(STOP, node.now)
    node.line.is_cut_off()
    node.leaving.on_restart()
    node.line.is_silent(10.0)
    assert (node.leaving.is_due, node.line.last_stop) == (False, LastStop.FORWARDED)


# stopped words, and then a command


def test_a_node_is_told_to_stop_before_it_gets_its_command() -> None:
    node = Node(kind=255)
    node.leaving.tell(STOP, node.now)
    assert node.wire.sent == ["stopped words", STOP]


def test_it_waits_for_synchronous_words_of_a_node_that_takes_them() -> None:
    node = Node()
    node.leaving.tell(STOP, node.now)
    assert (node.wire.sent, node.wire.put_off.command) == (["stopped words"], STOP)


@pytest.mark.parametrize(("kind", "waits"), [(1, True), (255, False)])
def test_it_waits_for_a_node_that_somebody_else_has_started(kind: int, waits: bool) -> None:
    """Whatever the bridge takes its state to be."""
    node = Node(kind=kind, takes_words=False)
    node.leaving.tell(STOP, node.now, takes_words=True)
    assert node.wire.sent == (["stopped words"] if waits else ["stopped words", STOP])
    assert node.leaving.is_due is waits


def test_after_a_restart_no_stop_is_owed() -> None:
    node = Node()
    node.line.enables()
    node.leaving.owed.note()
    assert node.leaving.owed.is_open
    node.leaving.on_restart()
    assert not node.leaving.owed.is_open


def test_one_drive_that_has_been_told_does_not_speak_for_the_others() -> None:
    node = Node(NORD_TU4, "fu1", "fu2")
    node.line.enables()
    node.line.asks(Action.STOP)
    assert node.line.drive.stop_check.sent_for_s(node.now + 10.0) > 0
    assert not node.leaving.has_told(node.now + 10.0)


def test_a_stop_is_owed_from_the_enabling_word_until_the_drive_says_that_it_follows() -> None:
    node = Node()
    owed = node.leaving.owed
    owed.note()
    assert not owed.is_open
    node.line.enables()
    owed.note()
    node.line.asks(Action.DISABLE_VOLTAGE)
    owed.note()
    assert owed.is_open
    node.line.says(NORD_TU4.ready)
    owed.note()
    node.line.says(NORD_TU4.enabled)
    node.line.goes_on(node.now - 1024.0 + 2.0)
    assert node.line.last_stop is LastStop.IGNORED
    assert not owed.is_open, "that is another one's word"
