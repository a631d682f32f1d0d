"""A node in Stopped answers no SDO: whoever was stopped has to be woken first."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.canopen.frame import Frame
from bridge.command import Action
from bridge.command.drive_link import NodeState
from bridge.node.boot.error_status import HINTS
from bridge.text import render
from tests.support.quick import OPERATIONAL, STOPPED, Quick, quick_site

SUPERVISIONS = ("heartbeat", "guarding", "none")
ENTER, RESET = 0x80, 0x81


def site_with(tmp_path: Path, *nodes: str, bus: str = "") -> Quick:
    return Quick(quick_site(tmp_path, nodes, bus=bus))


# found stopped


@pytest.mark.parametrize("supervision", SUPERVISIONS)
def test_a_node_that_is_stopped_when_the_bridge_starts_is_woken(tmp_path: Path, supervision: str) -> None:
    quick = site_with(tmp_path, f'supervision = "{supervision}"')
    quick.nodes[1].state = STOPPED
    quick.run(5.0)
    assert quick.states() == "o"


def test_a_node_that_is_not_there_is_woken_and_told_to_stop_in_each_attempt(tmp_path: Path) -> None:
    """It may hear all the same. In Stopped a NORD may run on: it is reset."""
    quick = site_with(tmp_path, "")
    quick.nodes[1].present = False
    quick.run(3.1)
    assert quick.nmt()[:2] == [(ENTER, 1), (RESET, 1)]
    stopped, woken = 0x201, [frame.can_id for frame in quick.log].index(0)
    assert stopped in [frame.can_id for frame in quick.log[:woken]], "stopped words first"
    assert quick.core(1).state is NodeState.ABSENT
    quick.run(60.0)
    attempts = quick.nmt()
    assert 5 <= attempts.count((RESET, 1)) <= 12
    assert set(attempts) == {(ENTER, 1), (RESET, 1)}
    assert attempts[2:5] == [(ENTER, 1), (ENTER, 1), (RESET, 1)], "told to stop, it is woken first"
    assert "topped" in render(HINTS["B"])
    assert quick.status(1).endswith(render(HINTS["B"]))


def test_a_node_that_answers_is_not_sent_it_twice(tmp_path: Path) -> None:
    quick = site_with(tmp_path, "")
    quick.run(3.0)
    assert quick.nmt() == [(ENTER, 1), (0x01, 1)]


# stopped by the bridge


@pytest.mark.landing(4)
@pytest.mark.parametrize("supervision", SUPERVISIONS)
@pytest.mark.parametrize("boots_for_s", [0.05, 0.25, 0.5, 0.9])
def test_stop_all_wakes_who_was_just_booted(tmp_path: Path, supervision: str, boots_for_s: float) -> None:
    quick = site_with(tmp_path, 'on_loss = "stop_all"', f'supervision = "{supervision}"')
    quick.nodes[2].delay_s = 0.05
    quick.run(6.0)
    assert quick.states() == "oo"
    quick.nodes[1].present = False
    quick.run(max(0.0, 0.29 - boots_for_s))
    quick.nodes[2].start(quick.now)
    quick.run(3.0)
    quick.nodes[1].present = True
    quick.nodes[1].start(quick.now)
    quick.run(12.0)
    assert quick.states() == "oo", quick.status(2)


@pytest.mark.parametrize("supervision", SUPERVISIONS)
def test_a_node_stopped_by_all_is_woken_without_a_silence_first(tmp_path: Path, supervision: str) -> None:
    """What was sent is known: nobody has to wait for two time-outs."""
    quick = site_with(tmp_path, 'on_loss = "stop_all"', f'supervision = "{supervision}"')
    quick.run(3.0)
    quick.nodes[2].start(quick.now)
    quick.lose = lambda frame: frame.can_id == 0x582
    quick.nodes[1].present = False
    quick.run(0.35)
    assert (0x02, 0) in quick.nmt()
    quick.lose = lambda frame: False
    since = quick.now
    quick.run(0.4)
    assert (ENTER, 2) in quick.nmt(since)
    assert quick.core(2).booting.is_held, "booted, and waits for node 1"


def test_a_node_that_cannot_be_used_is_woken_too(tmp_path: Path) -> None:
    quick = site_with(tmp_path, 'on_loss = "stop_all"', "[bus.node.identity]\nvendor_id = 5")
    quick.run(3.0)
    assert quick.core(2).state is NodeState.CONFIG_ERROR
    quick.nodes[1].present = False
    since = quick.now
    quick.run(2.0)
    assert [command for command in quick.nmt(since) if command[1] == 2][-2:] == [(ENTER, 2), (0x02, 2)], (
        "woken, looked at, and stopped again"
    )
    assert quick.states()[1] == "s"


def test_a_node_that_an_operator_keeps_pre_operational_can_be_started_after_stop_all(tmp_path: Path) -> None:
    quick = site_with(tmp_path, 'on_loss = "stop_all"', 'supervision = "none"')
    quick.run(3.0)
    quick.ask(Action.ENTER_PRE_OPERATIONAL, "n2")
    quick.nodes[1].present = False
    quick.run(2.0)
    assert quick.states()[1] == "s"
    quick.nodes[1].present = True
    quick.nodes[1].start(quick.now)
    quick.run(5.0)
    assert quick.states() == "os", "an operator has taken it out of service"
    quick.ask(Action.START_NODE, "n2")
    quick.run(0.5)
    assert quick.states() == "oo"


@pytest.mark.landing(3)
@pytest.mark.parametrize("supervision", SUPERVISIONS)
def test_the_lost_node_itself_hears_the_stop_and_is_woken(tmp_path: Path, supervision: str) -> None:
    """Only its own frames were lost."""
    quick = site_with(tmp_path, f'on_loss = "stop_all"\nsupervision = "{supervision}"', "")
    quick.run(3.0)
    quick.lose = lambda frame: frame.can_id == 0x701
    if supervision == "none":
        quick.core(1)._lose("lost", quick.now)
    quick.run(1.0)
    quick.lose = lambda frame: False
    quick.run(14.0)
    assert quick.states() == "oo"


def test_a_bus_that_comes_back_starts_who_was_stopped_with_all(tmp_path: Path) -> None:
    quick = site_with(tmp_path, 'on_loss = "stop_all"', 'on_loss = "stop_node"')
    quick.run(3.0)
    quick.nodes[1].present = False
    quick.run(0.32)
    quick.network.bus_is_gone(quick.now)
    quick.nodes[1].present = True
    quick.nodes[1].start(quick.now)
    quick.run(15.0)
    assert quick.states() == "oo"


def test_a_boot_up_message_that_crossed_the_stop_is_no_reason_to_be_forgotten(tmp_path: Path) -> None:
    quick = site_with(tmp_path, 'on_loss = "stop_all"', 'supervision = "none"')
    quick.run(3.0)
    quick.nodes[1].present = False
    quick.run(0.31)
    quick.receive(Frame(0x702, b"\0"))
    quick.nodes[2].state = STOPPED
    quick.nodes[1].present = True
    quick.nodes[1].start(quick.now)
    quick.run(6.0)
    assert quick.nodes[2].state == OPERATIONAL
