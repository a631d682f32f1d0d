"""The bridge as NMT master: start-up order, commands, reactions to a loss, and who else is on the bus."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtState
from bridge.command import Action, Code, Identity, Source
from bridge.command.drive_link import NodeState
from tests.support.quick import OPERATIONAL, PRE_OPERATIONAL, STOPPED, Quick, quick_site, state_of

START, STOP, ENTER, RESET, RESET_COMMUNICATION = 0x01, 0x02, 0x80, 0x81, 0x82


def started(tmp_path: Path, *nodes: str, bus: str = "", absent: tuple[int, ...] = ()) -> Quick:
    quick = Quick(quick_site(tmp_path, nodes, bus=bus))
    for node_id in absent:
        quick.nodes[node_id].present = False
    quick.run(3.0)
    return quick


# start-up


def test_nodes_are_started_in_their_order(tmp_path: Path) -> None:
    quick = started(tmp_path, "start_order = 2", "start_order = 1", "start_order = 3")
    assert quick.states() == "ooo"
    assert [node for command, node in quick.nmt() if command == START] == [2, 1, 3]


def test_a_missing_node_of_a_lower_order_holds_nobody_for_long(tmp_path: Path) -> None:
    quick = started(tmp_path, "start_order = 1", "start_order = 2", absent=(1,))
    assert quick.nodes[2].state == OPERATIONAL


def test_go_on_starts_who_is_there(tmp_path: Path) -> None:
    quick = started(tmp_path, "mandatory = true", "", absent=(1,))
    assert quick.nodes[2].state == OPERATIONAL
    assert quick.value("bus/can0/held_by") == ""


@pytest.mark.parametrize("policy", ["hold_all", "stop_all"])
def test_all_wait_for_a_mandatory_node_and_start_when_it_is_there(tmp_path: Path, policy: str) -> None:
    bus = f'mandatory_missing = "{policy}"'
    quick = started(tmp_path, "mandatory = true", "", "", bus=bus, absent=(1,))
    assert quick.states()[1:] == "pp"
    assert quick.value("bus/can0/held_by") == "n1"
    assert quick.value("bus/can0/nmt_state") == NmtState.PRE_OPERATIONAL
    quick.nodes[1].present = True
    quick.nodes[1].start(quick.now)
    quick.run(1.0)
    assert quick.states() == "ooo"
    assert quick.value("bus/can0/nmt_state") == NmtState.OPERATIONAL


def test_a_node_that_falls_silent_while_it_waits_is_lost_and_booted_again(tmp_path: Path) -> None:
    bus = 'mandatory_missing = "hold_all"'
    quick = started(tmp_path, "mandatory = true", "", bus=bus, absent=(1,))
    assert quick.core(2).booting.is_held
    quick.nodes[2].present = False
    quick.run(0.5)
    assert quick.core(2).state is NodeState.LOST
    assert quick.status(2).startswith("E: lost: no heartbeat for 300 ms")
    for node in quick.nodes.values():
        node.present = True
        node.start(quick.now)
    quick.run(2.0)
    assert quick.states() == "oo"


def test_a_mandatory_node_that_is_lost_stops_all_and_all_come_back_with_it(tmp_path: Path) -> None:
    quick = started(tmp_path, "mandatory = true", "", "", bus='mandatory_missing = "stop_all"')
    assert quick.states() == "ooo"
    lost_at = quick.now
    quick.nodes[1].present = False
    quick.run(0.5)
    assert (STOP, 0) in quick.nmt(lost_at)
    stopped = [frame.can_id for frame in quick.log if frame.time > lost_at and frame.can_id in (0x202, 0x203)]
    assert stopped, "the drives got a stopped word before"
    assert quick.told("all nodes are stopped: n1 is lost")
    quick.run(3.0)
    assert quick.states()[1:] == "pp"
    quick.nodes[1].present = True
    quick.nodes[1].start(quick.now)
    quick.run(2.0)
    assert quick.states() == "ooo"


def test_a_mandatory_node_that_an_operator_switches_off_holds_nobody(tmp_path: Path) -> None:
    bus = 'mandatory_missing = "hold_all"'
    quick = started(tmp_path, "mandatory = true", "", bus=bus, absent=(1,))
    assert quick.nodes[2].state == PRE_OPERATIONAL
    assert quick.ask(Action.DISABLE, "n1").ok
    quick.run(0.5)
    assert quick.nodes[2].state == OPERATIONAL


@pytest.mark.parametrize(("key", "command"), [("communication", RESET_COMMUNICATION), ("node", RESET)])
def test_nodes_are_reset_at_the_start_where_the_site_file_asks_for_it(
    tmp_path: Path, key: str, command: int
) -> None:
    bus = f'reset_at_start = "{key}"'
    quick = started(tmp_path, "start_order = 2", "start_order = 1", bus=bus)
    assert quick.nmt()[:2] == [(command, 2), (command, 1)]
    assert quick.states() == "oo"


def test_the_bridge_says_that_it_has_started_and_in_which_state_it_is(tmp_path: Path) -> None:
    bus = 'mandatory_missing = "hold_all"'
    quick = Quick(quick_site(tmp_path, ["mandatory = true"], bus=bus))
    quick.nodes[1].present = False
    quick.run(1.0)
    assert [frame.data for frame in quick.log if frame.can_id == 0x77F] == [b"\0"]
    frames = quick.repeated.repetitions()[0x77F].frames
    assert frames == (Frame(0x77F, b"\x7f"),)
    quick.nodes[1].present = True
    quick.run(3.0)
    frames = quick.repeated.repetitions()[0x77F].frames
    assert frames == (Frame(0x77F, b"\x05"),)


# commands


def test_a_stopped_node_stays_stopped_until_it_is_started(tmp_path: Path) -> None:
    quick = started(tmp_path, "", "")
    assert quick.ask(Action.STOP_NODE, "n1").ok
    quick.run(3.0)
    assert quick.states() == "so"
    assert state_of(quick, 1) is NmtState.STOPPED, "as its heartbeat says"
    assert quick.status(1) == "stopped by local:test"
    assert quick.ask(Action.START_NODE, "n1").ok
    quick.run(3.0)
    assert quick.states() == "oo"


def test_pre_operational_is_kept_too(tmp_path: Path) -> None:
    quick = started(tmp_path, "")
    quick.ask(Action.ENTER_PRE_OPERATIONAL, "n1")
    quick.run(3.0)
    assert quick.states() == "p"


@pytest.mark.parametrize(
    ("action", "command"), [(Action.RESET, RESET), (Action.RESET_COMMUNICATION, RESET_COMMUNICATION)]
)
def test_a_reset_node_is_booted_again(tmp_path: Path, action: Action, command: int) -> None:
    quick = started(tmp_path, "", "")
    since = quick.now
    quick.ask(action, "n2")
    quick.run(2.0)
    assert quick.nmt(since)[0] == (command, 2)
    assert quick.states() == "oo"


def test_a_command_to_the_bus_is_one_frame_to_all(tmp_path: Path) -> None:
    quick = started(tmp_path, "", "", "")
    since = quick.now
    assert quick.ask(Action.STOP_NODE, "bus/can0").ok
    quick.run(1.0)
    assert quick.nmt(since) == [(STOP, 0)]
    assert quick.states() == "sss"
    quick.ask(Action.START_NODE, "bus/can0")
    quick.run(3.0)
    assert quick.states() == "ooo"


def test_a_bus_knows_nmt_only_and_its_name(tmp_path: Path) -> None:
    quick = started(tmp_path, "")
    assert quick.ask(Action.DISABLE, "bus/can0").code is Code.UNKNOWN_TARGET
    assert quick.ask(Action.STOP_NODE, "bus/can1").code is Code.UNKNOWN_TARGET


def test_who_may_only_read_commands_no_bus(tmp_path: Path) -> None:
    quick = started(tmp_path, "")
    observer = Identity(Source.OPCUA, "eve", role=type(Identity(Source.OPCUA, "x").role).OBSERVER)
    assert quick.ask(Action.STOP_NODE, "bus/can0", observer).code is Code.NOT_ALLOWED
    quick.run(0.5)
    assert quick.states() == "o"


# reactions to a loss


def unplugged(tmp_path: Path, node: str) -> Quick:
    quick = started(tmp_path, node, "")
    quick.log.clear()
    quick.nodes[1].present = False
    quick.run(1.0)
    assert quick.core(1).state is NodeState.LOST
    return quick


@pytest.mark.parametrize("supervision", ["heartbeat", "guarding"])
def test_restart_boots_the_node_when_it_is_back(tmp_path: Path, supervision: str) -> None:
    quick = unplugged(tmp_path, f'supervision = "{supervision}"'.replace('supervision = "heartbeat"', ""))
    quick.nodes[1].present = True
    quick.run(12.0)
    assert quick.core(1).state is NodeState.OPERATIONAL
    assert quick.states() == "oo"


def test_stop_node_stops_it_and_leaves_it_stopped_until_it_restarts(tmp_path: Path) -> None:
    quick = unplugged(tmp_path, 'on_loss = "stop_node"')
    assert quick.nmt() == [(STOP, 1)]
    quick.nodes[1].present = True
    quick.run(15.0)
    assert quick.core(1).state is NodeState.LOST
    assert (START, 1) not in quick.nmt()
    quick.nodes[1].start(quick.now)
    quick.run(1.0)
    assert quick.core(1).state is NodeState.OPERATIONAL


def test_stop_all_stops_the_others_until_it_is_back(tmp_path: Path) -> None:
    quick = unplugged(tmp_path, 'on_loss = "stop_all"')
    assert (STOP, 0) in quick.nmt()
    assert quick.states()[1] == "p"
    quick.nodes[1].present = True
    quick.run(12.0)
    assert quick.states() == "oo"


@pytest.mark.parametrize("supervision", ["", 'supervision = "guarding"'])
def test_nothing_reports_and_goes_on_where_it_is_heard_again(tmp_path: Path, supervision: str) -> None:
    quick = unplugged(tmp_path, f'on_loss = "nothing"\n{supervision}')
    assert quick.nmt() == []
    assert quick.told("node lost")
    quick.run(5.0)
    assert not [frame for frame in quick.log if frame.can_id == 0x601], "it is left alone"
    quick.nodes[1].present = True
    quick.run(1.0)
    assert quick.core(1).state is NodeState.OPERATIONAL
    assert quick.nmt() == []


def test_the_state_shown_is_the_one_that_was_heard(tmp_path: Path) -> None:
    quick = started(tmp_path, "")
    quick.nodes[1].state = PRE_OPERATIONAL  # by itself
    quick.nodes[1].on_frame(Frame(0, b"\x80\x01"), quick.now)
    quick.lose = lambda frame: frame.can_id == 0x581
    quick.run(2.5)
    assert state_of(quick, 1) is NmtState.PRE_OPERATIONAL
    assert quick.core(1).state is not NodeState.OPERATIONAL


# who else is there


def test_another_master_is_told_and_forgotten_after_a_minute(tmp_path: Path) -> None:
    """Lenze §10: a quasi master broadcasts Start Remote Node 3 s after power-on."""
    quick = started(tmp_path, "")
    assert quick.value("bus/can0/second_master") is False
    for _ in range(50):
        quick.receive(Frame(0, b"\x01\x00"))
        quick.run(0.1)
    assert quick.value("bus/can0/second_master") is True
    [event] = quick.told("another NMT master")
    assert "start for all nodes" in event.message
    quick.run(61.0)
    assert quick.value("bus/can0/second_master") is False


@pytest.mark.parametrize("data", [b"", b"\x01", b"\x33\x05", b"\x01\x00\x00\x00"])
def test_nonsense_from_another_master_is_named_and_harms_nobody(tmp_path: Path, data: bytes) -> None:
    quick = started(tmp_path, "")
    quick.receive(Frame(0, data))
    assert quick.told("another NMT master")
    quick.run(1.0)
    assert quick.states() == "o"


def test_a_node_that_is_not_in_the_site_file_is_reported(tmp_path: Path) -> None:
    quick = started(tmp_path, "")
    quick.receive(Frame(0x70C, b"\0"), Frame(0x70D, b"\x05"))
    quick.receive(Frame(0x70C, b"\x7f"))
    quick.run(0.2)
    assert quick.value("bus/can0/unexpected_nodes") == "12, 13"
    assert len(quick.told("A: node 12 starts and is not in the site file")) == 1


def test_twice_as_many_heartbeats_are_a_node_id_used_twice(tmp_path: Path) -> None:
    quick = started(tmp_path, "", "")
    for _ in range(30):
        quick.run(0.1)
        quick.receive(Frame(0x702, b"\x05"))
    assert quick.value("bus/can0/duplicate_ids") == "2"
    [event] = quick.told("node id 2 (n2) seems to be used twice")
    assert "heartbeats came within" in event.message


def test_two_answers_to_each_sdo_request_are_a_node_id_used_twice(tmp_path: Path) -> None:
    quick = Quick(quick_site(tmp_path, 1))
    twin = quick.nodes[1]
    answer = twin._answer

    def twice(data: bytes) -> None:
        answer(data)
        answer(data)

    twin._answer = twice
    quick.run(3.0)
    assert quick.states() == "o", "the second answer is never taken for another one"
    assert quick.told("SDO requests were answered twice")
    assert quick.value("bus/can0/duplicate_ids") == "1"


def test_a_single_node_is_never_a_duplicate(tmp_path: Path) -> None:
    quick = started(tmp_path, "", "")
    quick.run(120.0)
    assert quick.value("bus/can0/duplicate_ids") == ""


# a node that boots in a loop


@pytest.mark.landing
def test_a_node_that_boots_in_a_loop_is_told_once_a_minute_and_does_not_load_the_bus(tmp_path: Path) -> None:
    quick = started(tmp_path, "", "")
    quick.run(30.0)
    quick.events.clear()
    quick.log.clear()
    for _ in range(1200):
        quick.nodes[1].start(quick.now)
        quick.run(0.25)
    minutes = 300 / 60
    assert 1 <= len(quick.told("starts again and again")) <= minutes + 1
    assert len(quick.events) <= 4 * (minutes + 1)
    to_the_node = [frame for frame in quick.log if frame.can_id == 0x601 or frame.data[1:] == b"\x01"]
    assert len(to_the_node) / 300 < 1, "frames a second"
    assert quick.states()[1] == "o", "the other one is not touched"
    assert quick.status(1).startswith("starts again and again")
    quick.run(70.0)
    assert quick.states() == "oo"


@pytest.mark.landing
def test_a_node_that_fails_a_second_after_each_start_is_asked_less_and_less_often(tmp_path: Path) -> None:
    quick = started(tmp_path, "")
    boots: list[float] = []
    for _ in range(600):
        quick.run(1.0)
        if quick.nodes[1].state == OPERATIONAL:
            boots.append(quick.now)
            quick.nodes[1].start(quick.now)
    assert len([at for at in boots if at > quick.now - 300]) <= 6


def test_an_operator_who_resets_it_need_not_wait(tmp_path: Path) -> None:
    quick = started(tmp_path, "")
    for _ in range(40):
        quick.nodes[1].start(quick.now)
        quick.run(0.25)
    assert quick.ask(Action.RESET, "n1").ok
    quick.run(2.0)
    assert quick.states() == "o"
    assert quick.nodes[1].state != STOPPED
