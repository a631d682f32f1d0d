"""Whether outputs have what their stop gives them, by what is read of them or told: the judgement alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import pytest

from bridge.command.stop_check.output_check import OutputReadback, OutputStopCheck, Question, StoppedOutput
from bridge.command.stop_check.state import LastStop
from bridge.mapping.entry_types import ObjectRef
from bridge.text import render

NONE, FORWARDED, FOLLOWED, IGNORED = LastStop
WAY_S, BOUND_S = 0.125, 0.5
VALVES: Final = StoppedOutput("valves", ObjectRef(0x6200, 1), 8, 0)
SPEED: Final = StoppedOutput("speed", ObjectRef(0x6411, 1), 16, 50)
TOLD: Final = StoppedOutput("valves", ObjectRef(0x6200, 1), 8, 0, "TPDO1")
ON, OFF = OutputReadback(0x81), OutputReadback(0)
REFUSED: Final = OutputReadback(None, "the node does not let 6200h:01 be read: object is write-only")
SILENT: Final = OutputReadback(None, "6200h:01 cannot be read: no valid answer", was_silent=True)


class Line:
    """Outputs that were active until they are stopped at ``began``; 0 is when the stop is handed over."""

    def __init__(self, *outputs: StoppedOutput) -> None:
        self.outputs: Sequence[StoppedOutput] = outputs
        self.stop_check = OutputStopCheck()
        self.stop_check.on_settled(None, is_there=True)
        self.ended: list[tuple[LastStop, float]] = []
        self.asked: list[tuple[str, float]] = []
        self.now = -1.0
        self.stop()

    def stop(self, now: float = 0.0) -> None:
        self.stop_check.on_settled((0, 50), is_there=True)
        self.hand_over(now)

    def hand_over(self, now: float) -> None:
        self.now = now
        self.stop_check.on_handed_over(now, self.outputs, way_s=WAY_S, bound_s=BOUND_S)
        self._take()

    def ask(self, at: float) -> Question:
        """The next question, which is due by then."""
        self.now = at
        question = self.stop_check.question(at)
        assert question is not None
        self.asked.append((question.output.name, at))
        return question

    def answer(self, question: Question, answer: OutputReadback, at: float | None = None) -> None:
        self.now = self.now if at is None else at
        self.stop_check.on_answer(question, answer, self.now)
        self._take()

    def runs(self, until: float, *answers: OutputReadback) -> None:
        """Each question is asked when it is due, and answered at once: each output with its answer."""
        by_name = dict(zip((one.name for one in self.outputs), answers, strict=False))
        while (due := self.stop_check.next_reading()) is not None and due <= until:
            question = self.ask(max(due, self.now))
            self.answer(question, by_name[question.output.name])
        self.now = until

    def tells(self, raw: int, at: float) -> None:
        self.now = at
        self.stop_check.on_told([(VALVES.object, raw)], at)
        self._take()

    def _take(self) -> None:
        self.ended += [(verdict.outcome, verdict.at) for verdict in self.stop_check.take_verdicts()]

    @property
    def state(self) -> LastStop:
        return self.stop_check.last_stop


def test_a_stop_is_forwarded_when_it_is_decided_and_judged_when_it_is_handed_over() -> None:
    following = OutputStopCheck()
    assert (following.last_stop, following.follows) == (NONE, True)
    following.on_settled(None, is_there=True)
    assert (following.last_stop, following.is_judged) == (NONE, False)
    following.on_settled((0,), is_there=True)
    assert (following.last_stop, following.awaits_sending, following.is_judged) == (FORWARDED, True, False)
    assert following.next_reading() is None
    following.on_handed_over(8.0, [VALVES], way_s=WAY_S, bound_s=BOUND_S)
    assert (following.awaits_sending, following.is_judged, following.is_owed) == (False, True, True)
    assert following.next_reading() == 8.0 + WAY_S
    assert following.sent_for_s(8.5) == 0.5


def test_what_has_no_stop_is_handed_over_for_nothing() -> None:
    following = OutputStopCheck()
    following.on_settled(None, is_there=True)
    following.on_handed_over(8.0, [VALVES], way_s=WAY_S, bound_s=BOUND_S)
    assert (following.last_stop, following.is_judged, following.sent_for_s(9.0)) == (NONE, False, 0.0)


def test_outputs_that_are_read_as_they_are_sent_have_followed() -> None:
    line = Line(VALVES, SPEED)
    assert line.stop_check.question(WAY_S / 2) is None, "the frame may still be on its way"
    line.answer(line.ask(WAY_S), OFF)
    assert line.state is FORWARDED, "one of two"
    assert render(line.stop_check.why) == "its outputs have not been read back yet"
    line.answer(line.ask(WAY_S), OutputReadback(50))
    assert line.ended == [(FOLLOWED, WAY_S)]
    assert (line.stop_check.follows, render(line.stop_check.why), line.stop_check.is_owed) == (
        True,
        "",
        False,
    )
    assert line.stop_check.next_reading() is None


def test_an_output_with_another_value_is_read_again_after_the_bound_and_then_ignored() -> None:
    line = Line(VALVES, SPEED)
    line.runs(BOUND_S, ON, OutputReadback(50))
    assert line.ended == [(IGNORED, BOUND_S)]
    assert line.asked == [("valves", WAY_S), ("speed", WAY_S), ("valves", BOUND_S), ("speed", BOUND_S)]
    assert render(line.stop_check.why) == "6200h:01 (valves) holds 81h instead of 00h"
    assert not line.stop_check.follows


def test_a_late_answer_to_an_early_question_makes_no_ignored_stop() -> None:
    line = Line(VALVES)
    line.answer(line.ask(BOUND_S - 0.01), ON, BOUND_S + 0.3)
    assert line.state is FORWARDED
    line.answer(line.ask(line.now), OFF)
    assert line.ended == [(FOLLOWED, BOUND_S + 0.3)]


def test_one_question_at_a_time() -> None:
    line = Line(VALVES, SPEED)
    line.ask(WAY_S)
    assert line.stop_check.question(WAY_S) is None
    assert line.stop_check.next_reading() is None


def test_an_output_that_takes_its_time_has_until_the_bound() -> None:
    line = Line(VALVES)
    line.runs(BOUND_S / 2, ON)
    assert (line.state, render(line.stop_check.why)) == (
        FORWARDED,
        "6200h:01 (valves) holds 81h instead of 00h",
    )
    line.runs(BOUND_S, OFF)
    assert line.ended == [(FOLLOWED, BOUND_S)]


def test_what_the_node_refuses_is_asked_once_more_and_stays_forwarded_with_the_reason() -> None:
    line = Line(VALVES, SPEED)
    line.runs(BOUND_S - 0.01, REFUSED, OutputReadback(50))
    assert not line.stop_check.is_stuck, "it is asked again after the bound"
    line.runs(1000.0, REFUSED, OutputReadback(50))
    assert (line.ended, line.state, render(line.stop_check.why)) == ([], FORWARDED, render(REFUSED.why))
    assert [at for name, at in line.asked if name == "valves"] == [WAY_S, BOUND_S]
    assert line.stop_check.is_stuck


def test_one_output_that_cannot_be_read_does_not_hide_another_that_is_wrong() -> None:
    line = Line(SPEED, VALVES)
    line.runs(BOUND_S, REFUSED, ON)
    assert line.ended == [(IGNORED, BOUND_S)]


def test_a_silent_node_is_asked_again_and_has_a_bound_of_its_own() -> None:
    """Who does not answer may not have heard the stop."""
    line = Line(VALVES, SPEED)
    line.runs(2.0, SILENT, SILENT)
    assert (line.state, render(line.stop_check.why)) == (FORWARDED, render(SILENT.why))
    assert line.asked == [("valves", WAY_S), ("valves", WAY_S + 1.0)], "not each of them in vain"
    due = WAY_S + 2.0
    assert line.stop_check.next_reading() == due
    line.answer(line.ask(due), ON)
    assert line.state is FORWARDED
    line.answer(line.ask(due), OutputReadback(50))
    line.runs(due + BOUND_S - 0.01, ON, OutputReadback(50))
    assert line.state is FORWARDED
    line.runs(due + BOUND_S, ON, OutputReadback(50))
    assert line.ended == [(IGNORED, due + BOUND_S)]


def test_a_value_that_was_seen_before_counts_no_more_when_it_cannot_be_read_again() -> None:
    line = Line(VALVES)
    line.answer(line.ask(WAY_S), ON)
    line.answer(line.ask(BOUND_S), SILENT)
    assert (line.state, render(line.stop_check.why)) == (FORWARDED, render(SILENT.why))


def test_outputs_that_are_ignored_are_looked_at_until_they_follow_after_all() -> None:
    line = Line(VALVES)
    line.runs(BOUND_S + 3.0, ON)
    assert line.ended == [(IGNORED, BOUND_S)], "named once"
    line.runs(BOUND_S + 4.0, OFF)
    assert line.ended[1:] == [(FOLLOWED, BOUND_S + 4.0)]
    assert line.stop_check.follows


def test_two_masters_that_alternate_are_one_occurrence() -> None:
    line = Line(TOLD)
    for step in range(40):
        line.tells((0x81, 0)[step % 2], BOUND_S + step / 4)
    assert line.ended == [(IGNORED, BOUND_S)]
    line.tells(0, line.now + 0.25)
    line.tells(0, line.now + 1.0)
    assert [outcome for outcome, _ in line.ended] == [IGNORED, FOLLOWED]


def test_a_new_active_value_ends_the_stop_and_late_answers_say_nothing() -> None:
    line = Line(VALVES)
    question = line.ask(WAY_S)
    line.stop_check.on_settled(None, is_there=True)
    assert (line.state, line.stop_check.is_owed, line.stop_check.is_judged) == (NONE, False, False)
    line.answer(question, OFF)
    assert (line.state, line.ended) == (NONE, [])
    line.stop(8.0)
    line.answer(question, OFF)
    assert line.state is FORWARDED


def test_other_safe_values_are_another_stop() -> None:
    """What holds its last value gets 0 by somebody's Stop."""
    line = Line(VALVES)
    line.runs(WAY_S, OFF)
    line.stop_check.on_settled((0, 0), is_there=True)
    assert (line.state, line.stop_check.awaits_sending) == (FORWARDED, True)
    line.hand_over(4.0)
    line.runs(4.0 + BOUND_S, ON)
    assert [outcome for outcome, _ in line.ended] == [FOLLOWED, IGNORED]


def test_the_same_stop_begins_once() -> None:
    line = Line(VALVES)
    line.runs(WAY_S, OFF)
    line.stop_check.on_settled((0, 50), is_there=True)
    assert (line.state, line.stop_check.awaits_sending) == (FOLLOWED, False)


def test_a_node_that_leaves_is_not_judged_and_then_from_when_it_is_back() -> None:
    line = Line(VALVES)
    question = line.ask(WAY_S)
    line.stop_check.on_settled((0, 50), is_there=False)
    assert (line.state, line.stop_check.is_judged, line.stop_check.next_reading()) == (FORWARDED, False, None)
    assert render(line.stop_check.why) == "the node left operation before its outputs were read back"
    assert not line.stop_check.is_stuck
    line.answer(question, ON)
    line.stop_check.on_settled((0, 50), is_there=True)
    assert line.stop_check.awaits_sending
    line.hand_over(10.0)
    line.runs(10.0 + BOUND_S, ON)
    assert line.ended == [(IGNORED, 10.0 + BOUND_S)]


def test_who_has_ignored_its_stop_still_does_when_its_node_was_stopped() -> None:
    line = Line(VALVES)
    line.runs(BOUND_S, ON)
    line.stop_check.on_settled((0, 50), is_there=False)
    assert (line.state, line.stop_check.follows) == (IGNORED, False)
    assert render(line.stop_check.why) == "6200h:01 (valves) holds 81h instead of 00h"


def test_a_second_ignored_stop_is_said_to_be_one() -> None:
    line = Line(VALVES)
    line.runs(BOUND_S, ON)
    line.stop_check.on_settled((0, 50), is_there=False)
    line.stop_check.on_settled((0, 50), is_there=True)
    assert not line.stop_check.follows
    line.stop_check.on_handed_over(9.0, [VALVES], way_s=WAY_S, bound_s=BOUND_S)
    question = line.ask(9.0 + BOUND_S)
    line.stop_check.on_answer(question, ON, line.now)
    (verdict,) = line.stop_check.take_verdicts()
    assert (verdict.outcome, verdict.before, verdict.again) == (IGNORED, FORWARDED, True)
    assert (verdict.since, verdict.at) == (9.0, 9.0 + BOUND_S)


def test_a_verdict_waits_to_be_told_at_once() -> None:
    following = OutputStopCheck()
    following.on_settled((0,), is_there=True)
    following.on_handed_over(3.0, [], way_s=WAY_S, bound_s=BOUND_S)
    assert following.next_deadline() == 3.0
    assert [verdict.outcome for verdict in following.take_verdicts()] == [FOLLOWED]
    assert (following.next_deadline(), following.next_reading()) == (None, None)


def test_a_stop_that_gives_no_output_a_value_is_followed_at_once() -> None:
    line = Line()
    assert line.ended == [(FOLLOWED, 0.0)]


# by a TPDO


def test_an_output_that_a_tpdo_brings_is_not_asked_for() -> None:
    line = Line(TOLD)
    assert line.stop_check.next_reading() is None
    line.tells(0, WAY_S / 2)
    assert line.state is FORWARDED, "it may be older than the stop"
    line.tells(0, WAY_S)
    assert line.ended == [(FOLLOWED, WAY_S)]


def test_a_telegram_after_the_bound_makes_an_ignored_stop() -> None:
    line = Line(TOLD)
    line.tells(0x81, BOUND_S - 0.01)
    assert line.state is FORWARDED
    line.tells(0x81, BOUND_S)
    assert line.ended == [(IGNORED, BOUND_S)]
    line.tells(0x81, BOUND_S + 5)
    assert len(line.ended) == 1


def test_a_tpdo_that_does_not_come_is_the_reason() -> None:
    line = Line(TOLD, SPEED)
    line.runs(1000.0, OFF, OutputReadback(50))
    assert (line.state, render(line.stop_check.why)) == (FORWARDED, "no TPDO1 from the node")
    assert not line.stop_check.is_stuck, "it may still come"
    line.tells(0, 1001.0)
    assert line.state is FOLLOWED


def test_a_pause_longer_than_the_deadline_begins_the_bound_anew() -> None:
    line = Line(TOLD)
    line.stop_check.on_pause(5.0)
    line.tells(0x81, 5.0)
    line.tells(0x81, 5.0 + BOUND_S - 0.01)
    assert line.state is FORWARDED
    line.tells(0x81, 5.0 + BOUND_S)
    assert line.state is IGNORED


@pytest.mark.parametrize("output", [VALVES, TOLD])
def test_an_output_that_changes_after_it_had_followed_is_named(output: StoppedOutput) -> None:
    line = Line(output)
    line.tells(0, WAY_S)
    line.tells(0x81, BOUND_S)
    assert line.ended == [(FOLLOWED, WAY_S), (IGNORED, BOUND_S)]


def test_one_that_is_ignored_at_the_end_of_the_bound_is_not_read_at_once_to_say_the_same() -> None:
    line = Line(VALVES)
    line.tells(0, WAY_S)
    line.tells(0x81, BOUND_S)
    due = line.stop_check.next_reading()
    assert due is not None
    assert due > BOUND_S


def test_one_that_changes_within_the_bound_is_read_or_heard_again_after_it() -> None:
    line = Line(VALVES)
    line.tells(0, WAY_S)
    line.tells(0x81, WAY_S + 0.1)
    assert (line.state, line.stop_check.next_reading()) == (FOLLOWED, BOUND_S)
    line.runs(BOUND_S, ON)
    assert line.state is IGNORED
    line = Line(TOLD)
    line.tells(0, WAY_S)
    line.tells(0x81, WAY_S + 0.1)
    assert (line.state, line.stop_check.is_owed) == (FOLLOWED, True)
    line.tells(0, WAY_S + 0.2)
    assert (line.state, line.stop_check.is_owed) == (FOLLOWED, False)


def test_what_is_sent_on_change_counts_beside_the_answers_and_the_newer_one_wins() -> None:
    line = Line(VALVES)
    question = line.ask(WAY_S)
    line.tells(0, WAY_S + 0.05)
    assert line.ended == [(FOLLOWED, WAY_S + 0.05)]
    line.answer(question, ON, WAY_S + 0.1)
    assert line.state is FOLLOWED, "the answer may be older than the telegram"
    assert not line.stop_check.is_owed


def test_what_is_told_of_other_objects_says_nothing() -> None:
    line = Line(SPEED)
    line.tells(0, BOUND_S)
    assert (line.state, render(line.stop_check.why)) == (FORWARDED, "its outputs have not been read back yet")


@pytest.mark.parametrize(
    ("size", "raw", "shown"), [(1, 1, "1h"), (8, 5, "05h"), (16, 0x1A, "001Ah"), (24, 1, "000001h")]
)
def test_values_are_shown_as_wide_as_they_are(size: int, raw: int, shown: str) -> None:
    assert StoppedOutput("one", ObjectRef(0x2000, 0x1F), size, 0).shown(raw) == shown
    assert StoppedOutput("one", ObjectRef(0x2000, 0x1F), size, 0).place == "2000h:1F"
