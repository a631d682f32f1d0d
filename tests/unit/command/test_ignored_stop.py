"""What is told, logged and done when a drive's stop has ended, word by word."""

from __future__ import annotations

import pytest

from bridge.command import Action
from bridge.command.stop_check.state import LastStop
from bridge.drive import OwnJudgement, OwnVerdict
from bridge.drive.own_judgement import DriveWatch
from bridge.text import Text
from tests.support.judged_plant import JudgedPlant
from tests.support.leg_words import NORD_TU4, VELOCITY, LegWords

OFF = Action.DISABLE_VOLTAGE
STAYS = "; it stays stopped until an operator starts or resets it"
SAYS = "the drive says 0B37h, operation enabled"
WHY = Text.of("stopped_by.plant", name="conveyor/fu1")


def ignoring(*slots: str, more: str = "") -> JudgedPlant:
    """A drive that still says after half a second that it is enabled, in telegrams of 1/32 s."""
    line = JudgedPlant(NORD_TU4, *slots, more=f"ignored_stop_ms = 500\n{more}").enables()
    line.asks(OFF)
    line.goes_on(0.5)
    assert line.last_stop is LastStop.IGNORED
    return line


def test_a_stop_that_is_followed_is_only_logged() -> None:
    line = JudgedPlant().enables()
    line.asks(OFF)
    line.goes_on(0.25)
    line.now += 1 / 64
    line.says(NORD_TU4.ready)
    line.goes_on(2.0)
    assert (line.told, line.enforced) == ([], [])
    assert line.endings == [("ok", "after 0.266 s")]


@pytest.mark.parametrize(
    ("slots", "also"),
    [
        (["fu1"], ""),
        (["fu1", "fu2"], ", which stops fu2, too"),
        (["fu1", "fu2", "fu3"], ", which stops fu2, fu3, too"),
    ],
)
def test_a_stop_that_is_ignored_is_told_and_logged_and_stops_the_node(slots: list[str], also: str) -> None:
    line = ignoring(*slots)
    message = f"ignores its stop: 0474h is sent since 0.50 s, {SAYS}; NMT stop of conveyor{also}{STAYS}"
    assert line.told == [(1000, message)]
    assert line.endings == [("ignored", message)]
    assert line.enforced == [("conveyor", Action.STOP_NODE, WHY)]


def test_with_reset_node_it_is_reset_once_and_stopped_if_it_does_not_help() -> None:
    line = ignoring("fu1", "fu2", more='on_ignored_stop = "reset_node"')
    message = f"ignores its stop: 0474h is sent since 0.50 s, {SAYS}; NMT reset node of conveyor"
    assert line.told == [(1000, f"{message}, which stops fu2, too")]
    line.restarts()
    line.goes_on(1.0)
    again = (
        f"ignores its stop: 0474h is sent since 0.50 s, {SAYS}; NMT stop of conveyor, which stops fu2, too"
    )
    assert line.told[1:] == [(1000, f"{again}{STAYS}")]
    assert [action for _, action, _ in line.enforced] == [Action.RESET, Action.STOP_NODE]


def test_with_report_nothing_is_done() -> None:
    line = ignoring(more='on_ignored_stop = "report"')
    message = f"ignores its stop: 0474h is sent since 0.50 s, {SAYS}; reported only (on_ignored_stop)"
    assert (line.told, line.enforced) == ([(1000, message)], [])


def test_who_is_enabled_by_somebody_else_is_told_as_such() -> None:
    line = JudgedPlant(NORD_TU4, more="ignored_stop_ms = 500").enables()
    line.asks(OFF)
    line.says(NORD_TU4.ready)
    line.goes_on(2.0)
    line.says(NORD_TU4.enabled)
    what = "is enabled although nothing that enables was sent: 0474h is sent for 2.00 s"
    assert line.told == [(1000, f"{what}, {SAYS}; NMT stop of conveyor{STAYS}")]


def test_who_follows_after_all_is_told_too() -> None:
    line = ignoring()
    line.goes_on(1.0)
    line.says(NORD_TU4.ready)
    line.goes_on(2.0)
    assert line.told[1:] == [(300, "follows its stop after all: the drive says 0B31h, ready")]
    assert line.endings[1:] == [("ok", "after 1.500 s")]
    assert len(line.enforced) == 1


@pytest.mark.parametrize(
    ("words", "said", "why"),
    [
        (NORD_TU4, "0B37h", "an NMT stop does not stop it"),
        (VELOCITY, "0237h", "conveyor has not said that it is stopped"),
    ],
)
def test_who_was_cut_off_may_run_on_and_nothing_more_is_done(words: LegWords, said: str, why: str) -> None:
    line = JudgedPlant(words, more="ignored_stop_ms = 500").enables()
    line.asks(OFF)
    line.is_cut_off()
    line.is_silent(60.0)
    message = (
        f"may run on, and is not known to follow its stop: it said {said}, operation enabled before its node "
        f"was taken out of operation 0.50 s ago, and nothing since; {why}: see to it at the drive"
    )
    assert line.told == [(1000, message)]
    assert line.endings == [("ignored", message)]
    assert line.enforced == []


def test_who_was_in_its_fault_reaction_when_it_was_cut_off_is_not_named_if_its_node_is_stopped() -> None:
    """020Fh is CiA 402's fault reaction active. Of its end nothing is heard but the node's state."""
    line = JudgedPlant(VELOCITY, more="ignored_stop_ms = 500").enables()
    line.says(0x020F)
    line.asks(OFF)
    line.is_cut_off()
    line.is_silent(0.125)
    line.drive.stop_check.on_node_stopped(line.now)
    line.is_silent(60.0)
    assert line.last_stop is LastStop.FOLLOWED
    assert [text for _, text in line.told if "may run on" in text] == []


def test_a_drive_that_is_sent_nothing_is_told_as_such() -> None:
    """The drive's own time-out of half a second, and the bound."""
    more = 'ignored_stop_ms = 500\non_expiry = "silence"'
    line = JudgedPlant(more=more, timeout_ms=250)
    p151 = DriveWatch("P151", "process_data", "P151", 500.0, "", OwnVerdict.STOPS)
    line.drive.on_own_supervision(OwnJudgement((p151,)), line.now)
    line.enables().goes_on(0.25 + 0.5 + 0.5)
    message = f"ignores its stop: nothing is sent since 1.00 s, {SAYS}; NMT stop of conveyor{STAYS}"
    assert line.told[-1] == (1000, message)


def test_stops_that_are_ignored_together_are_told_with_their_time() -> None:
    line = JudgedPlant(more="ignored_stop_ms = 2000").enables()
    line.drive.words[1] = 0x2000
    for _ in range(20):
        if line.told:
            break
        line.asks(Action.STOP)
        line.goes_on(line.now - 1024.0 + 0.5)
        line.writes(NORD_TU4.shut_down)
        line.writes(NORD_TU4.enable)
        line.goes_on(line.now - 1024.0 + 0.5)
    message = (
        f"ignores its stop: enabled and no slower in 6 stops of together 2.03 s, {SAYS}; NMT stop of conveyor"
    )
    assert line.told == [(1000, f"{message}{STAYS}")]
    assert line.endings[-1] == ("ignored", f"{message}{STAYS}")


def test_one_long_ramp_on_which_a_drive_gets_no_slower_is_told_as_any_ignored_stop() -> None:
    line = JudgedPlant().enables()
    line.drive.words[1] = 0x2000
    line.asks(Action.STOP)
    line.goes_on(20.0)
    [(severity, message)] = line.told
    assert severity == 1000
    assert message.startswith("ignores its stop: ") and f"is sent since 15.22 s, {SAYS}" in message
