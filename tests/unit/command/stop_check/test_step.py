"""Whether a drive followed its stop: what was sent and said when, and what comes of it, to the very bound.

Each script is played twice: the judge is asked every 1/16 s, and only when it asked for it.
"""

from __future__ import annotations

import pytest

from bridge.command.stop_check.state import LastStop, Says, Sent, StopVerdict
from tests.support.judge import Judge
from tests.support.stop_play import BOUNDS, PAUSE_S, STEP_S, UNWATCHED, Deed, Play, Script, Told, told

ENABLES, RAMP, OFF, SILENT = Sent.ENABLES, Sent.RAMP, Sent.OFF, Sent.SILENT
ENABLED, STOPPING, HOLDING, AT_REST = Says.ENABLED, Says.STOPPING, Says.HOLDING, Says.AT_REST
FOLLOWED, IGNORED = LastStop.FOLLOWED, LastStop.IGNORED


def test_of_a_drive_that_nobody_has_told_anything_nothing_is_judged() -> None:
    follow = Judge()
    assert (follow.state, follow.follows) == (LastStop.NONE, True)
    assert not (follow.is_judged or follow.awaits_sending or follow.is_informed)
    follow.on_node(is_there=True)
    assert (follow.state, follow.awaits_sending) == (LastStop.FORWARDED, True), "it gets a word that stops"
    assert not follow.is_judged, "which it has not had yet"


# the bounds


@pytest.mark.parametrize(
    ("script", "ignored_at"),
    [
        ([(1.0, OFF)], 1.5),
        ([(1.0, RAMP)], 5.0),
        ([(1.0, SILENT)], 7.0),
        # The stronger word counts, but not for longer than the weaker one.
        ([(1.0, RAMP), (2.0, OFF)], 2.5),
        ([(1.0, RAMP), (4.75, OFF)], 5.0),
        ([(1.0, SILENT), (2.0, OFF)], 2.5),
        # The drive may still have the weaker one, but to and fro does not put the end off for ever.
        ([(1.0, OFF), (1.25, RAMP)], 5.25),
        ([(1.0, OFF), (1.25, RAMP), (2.0, OFF), (2.25, RAMP)], 5.5),
        # Silence adds nothing to a word that it has had.
        ([(1.0, RAMP), (2.0, SILENT)], 5.0),
        ([(1.0, OFF), (1.25, SILENT)], 1.5),
        # Sent once more it is no other stop.
        ([(1.0, RAMP), (4.75, RAMP)], 5.0),
        # Said once more, also with another status word, it is the same.
        ([(1.0, RAMP), (4.75, Deed.SAYS_SO_AGAIN)], 5.0),
    ],
)
def test_a_drive_that_runs_on_is_named_by_its_first_telegram_at_the_end_of_the_bound(
    script: Script, ignored_at: float
) -> None:
    told(script, [(IGNORED, ignored_at)])
    [verdict] = Play().run(script).verdicts
    assert verdict == StopVerdict(IGNORED, LastStop.FORWARDED, since=1.0, at=ignored_at)


def test_silence_that_nobody_watches_has_no_bound_but_the_next_word_has() -> None:
    told([(1.0, SILENT)], [], bounds=UNWATCHED)
    told([(1.0, SILENT), (2.0, RAMP)], [(IGNORED, 6.0)], bounds=UNWATCHED)
    told([(1.0, SILENT), (2.0, OFF)], [(IGNORED, 2.5)], bounds=UNWATCHED)


def test_no_stop_is_judged_while_the_drive_is_enabled() -> None:
    play = Play().run([])
    follow = play.follow
    assert (play.told, follow.state, follow.follows) == ([], LastStop.NONE, True)
    assert not follow.is_judged and not follow.awaits_sending
    assert follow.sent_for_s(play.now) == 0.0
    assert follow.next_deadline() is None


def test_for_how_long_it_has_been_told_counts_from_when_the_stop_was_handed_over() -> None:
    follow = Play().run([], end=1.0).follow
    follow.on_output(OFF)
    assert follow.awaits_sending and not follow.is_judged
    assert follow.sent_for_s(8.0) == 0.0
    follow.on_handed_over(2.0, BOUNDS)
    assert follow.is_judged and not follow.awaits_sending
    assert [follow.sent_for_s(now) for now in (1.0, 2.0, 2.5, 8.0)] == [0.0, 0.0, 0.5, 6.0]
    follow.on_output(RAMP)
    assert follow.is_judged and follow.sent_for_s(8.0) == 0.0, "this word is not on the bus yet"
    follow.on_handed_over(9.0, BOUNDS)
    assert follow.sent_for_s(9.0) == 7.0
    follow.on_output(ENABLES)
    assert follow.sent_for_s(10.0) == 0.0


# what the drive does


@pytest.mark.parametrize(
    ("script", "told_then"),
    [
        # At rest: followed with the first telegram, also with one of the very moment.
        ([(1.0, OFF), (1.25, AT_REST)], [(FOLLOWED, 1.25)]),
        ([(1.0, OFF), (1.0, AT_REST)], [(FOLLOWED, 1.0)]),
        ([(1.0, OFF), (1.4375, AT_REST)], [(FOLLOWED, 1.4375)]),
        # A ramp that is left on has no end of its own, one after the voltage was taken has.
        ([(1.0, RAMP), (1.5, STOPPING)], [(FOLLOWED, 1.5)]),
        ([(1.0, OFF), (1.25, STOPPING)], [(FOLLOWED, 1.25), (IGNORED, 5.25)]),
        ([(1.0, OFF), (1.25, STOPPING), (5.1875, AT_REST)], [(FOLLOWED, 1.25)]),
        ([(1.0, RAMP), (1.5, STOPPING), (3.0, OFF)], [(FOLLOWED, 1.5), (IGNORED, 7.0)]),
        ([(1.0, OFF), (1.25, STOPPING), (2.0, RAMP)], [(FOLLOWED, 1.25)]),
        ([(1.0, OFF), (1.25, STOPPING), (2.0, SILENT)], [(FOLLOWED, 1.25), (IGNORED, 5.25)]),
        ([(1.0, OFF), (1.25, STOPPING), (4.0, Deed.SAYS_SO_AGAIN)], [(FOLLOWED, 1.25), (IGNORED, 5.25)]),
        # That of a fault may come at any time.
        ([(1.0, OFF), (1.25, AT_REST), (9.0, STOPPING)], [(FOLLOWED, 1.25), (IGNORED, 13.0)]),
        ([(1.0, OFF), (1.25, AT_REST), (9.0, STOPPING), (12.0, AT_REST)], [(FOLLOWED, 1.25)]),
        # It holds where the voltage is left on, and lets go within the short bound of the stronger word.
        ([(1.0, RAMP), (2.0, HOLDING)], [(FOLLOWED, 2.0)]),
        ([(1.0, RAMP), (2.0, HOLDING), (8.0, OFF)], [(FOLLOWED, 2.0), (IGNORED, 8.5)]),
        ([(1.0, RAMP), (2.0, HOLDING), (8.0, OFF), (8.4375, AT_REST)], [(FOLLOWED, 2.0)]),
        ([(1.0, RAMP), (2.0, STOPPING), (8.0, OFF), (8.25, ENABLED)], [(FOLLOWED, 2.0), (IGNORED, 8.5)]),
        ([(1.0, OFF), (1.25, HOLDING)], [(IGNORED, 1.5)]),
    ],
)
def test_what_is_followed_and_for_how_long(script: Script, told_then: Told) -> None:
    told(script, told_then)


@pytest.mark.parametrize(
    ("script", "told_then"),
    [
        # Nothing leaves it enabled after the voltage was taken.
        ([(1.0, OFF), (1.25, AT_REST), (8.0, ENABLED)], [(FOLLOWED, 1.25), (IGNORED, 8.0)]),
        (
            [(1.0, OFF), (1.25, AT_REST), (2.0, RAMP), (7.0, OFF), (8.0, ENABLED)],
            [(FOLLOWED, 1.25), (IGNORED, 8.0)],
        ),
        ([(1.0, RAMP), (2.0, AT_REST), (3.0, OFF), (3.25, ENABLED)], [(FOLLOWED, 2.0), (IGNORED, 3.25)]),
        # At once after the stop it may be the word that enabled it, still on its way.
        (
            [(1.0, RAMP), (1.125, AT_REST), (1.1875, OFF), (1.25, ENABLED)],
            [(FOLLOWED, 1.125), (IGNORED, 1.5)],
        ),
        ([(1.0, OFF), (1.125, AT_REST), (1.25, ENABLED), (1.4375, AT_REST)], [(FOLLOWED, 1.125)]),
        # Where the voltage is left on, it may be enabled for a moment on its way to holding; once.
        ([(1.0, RAMP), (1.25, AT_REST), (8.0, ENABLED)], [(FOLLOWED, 1.25), (IGNORED, 8.5)]),
        ([(1.0, RAMP), (1.25, AT_REST), (8.0, ENABLED), (8.25, HOLDING)], [(FOLLOWED, 1.25)]),
        (
            [(1.0, RAMP), (1.25, AT_REST), (8.0, ENABLED), (8.25, AT_REST), (20.0, ENABLED)],
            [(FOLLOWED, 1.25), (IGNORED, 20.0)],
        ),
        (
            [(1.0, RAMP), (1.25, AT_REST), (8.0, ENABLED), (8.125, AT_REST), (8.25, ENABLED)],
            [(FOLLOWED, 1.25), (IGNORED, 8.5)],
        ),
        (
            [(1.0, RAMP), (1.25, STOPPING), (2.0, AT_REST), (8.0, ENABLED)],
            [(FOLLOWED, 1.25), (IGNORED, 8.5)],
        ),
        (
            [(1.0, OFF), (1.25, AT_REST), (1.375, RAMP), (1.4375, ENABLED)],
            [(FOLLOWED, 1.25), (IGNORED, 1.9375)],
        ),
        (
            [(1.0, RAMP), (1.25, STOPPING), (2.0, AT_REST), (2.5, ENABLED)],
            [(FOLLOWED, 1.25), (IGNORED, 3.0)],
        ),
        # On its ramp it may be so until the bound of the ramp; pushed by its load, for a ramp.
        ([(1.0, RAMP), (1.25, STOPPING), (3.0, ENABLED)], [(FOLLOWED, 1.25), (IGNORED, 5.0)]),
        ([(1.0, RAMP), (2.0, HOLDING), (10.0, ENABLED)], [(FOLLOWED, 2.0), (IGNORED, 14.0)]),
        ([(1.0, RAMP), (2.0, HOLDING), (10.0, ENABLED), (13.9375, HOLDING)], [(FOLLOWED, 2.0)]),
    ],
)
def test_a_drive_that_is_enabled_again(script: Script, told_then: Told) -> None:
    told(script, told_then)


@pytest.mark.parametrize(
    ("script", "told_then"),
    [
        ([(1.0, OFF), (3.0, AT_REST)], [(IGNORED, 1.5), (FOLLOWED, 3.5)]),
        ([(1.0, OFF), (3.0, AT_REST), (3.4375, ENABLED)], [(IGNORED, 1.5)]),
        (
            [(1.0, OFF), (3.0, AT_REST), (3.25, ENABLED), (3.3125, AT_REST)],
            [(IGNORED, 1.5), (FOLLOWED, 3.8125)],
        ),
        ([(1.0, RAMP), (6.0, HOLDING)], [(IGNORED, 5.0), (FOLLOWED, 6.5)]),
        ([(1.0, RAMP), (6.0, HOLDING), (6.25, OFF)], [(IGNORED, 5.0)]),
        # Also where it is another word that makes it obedient, or the end of a pause.
        ([(1.0, OFF), (1.25, HOLDING), (1.5625, RAMP)], [(IGNORED, 1.5), (FOLLOWED, 2.0625)]),
        (
            [(1.0, RAMP), (2.0, HOLDING), (8.0, OFF), (8.5625, RAMP)],
            [(FOLLOWED, 2.0), (IGNORED, 8.5), (FOLLOWED, 9.0625)],
        ),
    ],
)
@pytest.mark.parametrize("on_change", [False, True])
def test_a_drive_follows_after_all_when_it_has_done_so_for_the_short_bound(
    script: Script, told_then: Told, on_change: bool
) -> None:
    told(script, told_then, on_change=on_change)


def test_who_enables_takes_back_a_stop_and_what_came_of_it() -> None:
    told([(1.0, OFF), (1.25, ENABLES)], [])
    play = Play().run([(1.0, OFF), (1.25, AT_REST), (3.0, ENABLES), (3.25, ENABLED), (4.0, OFF)])
    assert play.told == [(FOLLOWED, 1.25), (IGNORED, 4.5)]
    assert [verdict.before for verdict in play.verdicts] == [LastStop.FORWARDED] * 2
    follow = Play().run([(1.0, OFF)], end=1.25).follow
    follow.on_report(AT_REST, 1.25)
    follow.on_output(ENABLES)
    assert follow.on_time(1.25, 1.25, PAUSE_S) == []


def test_who_rested_for_a_moment_between_two_looks_has_had_its_ramp() -> None:
    judge = Play().run([(1.0, RAMP)], end=1.0 + STEP_S).follow
    judge.on_report(AT_REST, 1.25)
    judge.on_report(ENABLED, 1.25 + STEP_S)
    granted = 1.25 + STEP_S + BOUNDS.off_s
    told = [*judge.on_time(granted - STEP_S, granted - STEP_S, PAUSE_S)]
    told += judge.on_time(granted, granted, PAUSE_S)
    assert [(one.outcome, one.at) for one in told] == [(FOLLOWED, 1.25), (IGNORED, granted)]


# drives that send changes alone


@pytest.mark.parametrize(
    ("script", "told_then"),
    [
        ([(1.0, OFF)], [(IGNORED, 1.5)]),
        ([(1.0, RAMP)], [(IGNORED, 5.0)]),
        ([(1.0, OFF), (1.25, AT_REST)], [(FOLLOWED, 1.25)]),
        ([(1.0, OFF), (1.0, AT_REST)], [(FOLLOWED, 1.0)]),
        # What it said before may have been true before the word that enabled it: until the short bound.
        ([(0.5, AT_REST), (1.0, OFF)], [(FOLLOWED, 1.5)]),
        ([(0.5, AT_REST), (1.0, RAMP)], [(FOLLOWED, 1.5)]),
        ([(1.0, OFF), (1.25, STOPPING)], [(FOLLOWED, 1.25), (IGNORED, 5.25)]),
    ],
)
def test_a_drive_that_sends_changes_alone_is_judged_by_its_last_one(script: Script, told_then: Told) -> None:
    told(script, told_then, on_change=True)


# who is not heard


@pytest.mark.parametrize(
    ("script", "told_then"),
    [
        ([(1.0, OFF), (1.25, Deed.MUTE)], []),
        ([(1.0, OFF), (1.25, Deed.MUTE), (9.0, Deed.HEARD_AGAIN)], [(IGNORED, 9.5)]),
        ([(1.0, RAMP), (1.25, Deed.MUTE), (9.0, Deed.HEARD_AGAIN)], [(IGNORED, 13.0)]),
        ([(1.0, SILENT), (1.25, Deed.MUTE), (9.0, Deed.HEARD_AGAIN)], [(IGNORED, 15.0)]),
        ([(1.0, OFF), (1.25, Deed.MUTE), (1.3125, Deed.HEARD_AGAIN)], [(IGNORED, 1.5)]),
        (
            [(1.0, RAMP), (1.25, AT_REST), (1.5, Deed.MUTE), (9.0, ENABLED), (9.0, Deed.HEARD_AGAIN)],
            [(FOLLOWED, 1.25), (IGNORED, 9.5)],
        ),
        (
            [(1.0, OFF), (1.25, STOPPING), (1.5, Deed.MUTE), (3.0, Deed.HEARD_AGAIN)],
            [(FOLLOWED, 1.25), (IGNORED, 7.0)],
        ),
        (
            [(1.0, RAMP), (1.25, STOPPING), (1.5, Deed.MUTE), (3.0, Deed.HEARD_AGAIN)],
            [(FOLLOWED, 1.25)],
        ),
        ([(0.5, Deed.MUTE), (1.0, OFF)], []),
        # Who has rested has had its ramp, also where it was called ignored before.
        (
            [*[(1.0, RAMP), (6.0, AT_REST)], *[(8.0, Deed.MUTE), (9.0, ENABLED), (9.0, Deed.HEARD_AGAIN)]],
            [(IGNORED, 5.0), (FOLLOWED, 6.5), (IGNORED, 9.5)],
        ),
    ],
)
def test_the_bound_of_who_was_not_heard_begins_with_its_first_telegram(
    script: Script, told_then: Told
) -> None:
    told(script, told_then)


def test_a_verdict_says_since_when_it_was_told_again() -> None:
    [verdict] = Play().run([(1.0, OFF), (1.25, Deed.MUTE), (9.0, Deed.HEARD_AGAIN)]).verdicts
    assert (verdict.since, verdict.at) == (9.0, 9.5)


# when the judge is asked


@pytest.mark.parametrize(
    ("script", "on_change", "looks"),
    [
        ([(1.0, OFF)], True, [1.5]),
        ([(1.0, OFF), (1.0, STOPPING)], True, [1.0, 5.0]),
        ([(0.5, AT_REST), (1.0, OFF)], True, [1.0, 1.5]),
        ([(1.0, OFF), (3.0, AT_REST)], True, [1.5, 3.5]),
        ([(0.5, Deed.MUTE), (1.0, OFF)], False, [1.5, *(2.5 + n for n in range(30))]),
        ([(1.0, OFF), (1.4375, Deed.MUTE)], False, [1.5, *(2.5 + n for n in range(30))]),
        ([(1.0, OFF), (1.0, Deed.CUT_OFF)], False, [1.5]),
    ],
)
def test_a_drive_that_says_no_more_is_looked_at_seldom(
    script: Script, on_change: bool, looks: list[float]
) -> None:
    play = Play(on_change, always=False).run(script, end=script[-1][0] + STEP_S)
    play.wait(32.0)
    assert play.looks == looks


def test_who_is_not_heard_is_looked_at_at_once_when_something_new_has_happened() -> None:
    script: Script = [(1.0, OFF), (1.25, HOLDING), (1.375, Deed.MUTE)]
    judge = Play(always=False).run(script, end=1.5).follow
    assert judge.on_time(1.5, 1.3125, PAUSE_S) == [] and judge.next_deadline() == 2.5
    judge.on_output(RAMP)
    judge.on_handed_over(1.625, BOUNDS)
    assert judge.next_deadline() == 1.0, "holding is what it asks"
    assert judge.on_time(1.625, 1.3125, PAUSE_S)[0].outcome is FOLLOWED
    judge = Play(always=False).run([(1.0, OFF), (1.375, Deed.MUTE)], end=1.5).follow
    assert judge.on_time(1.5, 1.3125, PAUSE_S) == [] and judge.next_deadline() == 2.5
    judge.on_cut_off(1.625, BOUNDS)
    assert judge.next_deadline() == 1.5, "its bound is over"


def test_what_a_drive_says_after_the_bound_is_looked_for_at_its_next_telegram() -> None:
    """Not a second later, as for one that is not heard."""
    play = Play(always=False).run([(1.0, OFF)], end=1.5)
    assert play.follow.on_time(1.5, 1.4375, PAUSE_S) == []
    due = play.follow.next_deadline()
    assert due is not None and due <= 1.4375 + 2 * PAUSE_S


def test_a_drive_that_was_called_ignored_is_looked_at_when_it_may_have_followed() -> None:
    play = Play(always=False).run([(1.0, OFF)], end=2.0)
    judge = play.follow
    assert judge.state is IGNORED and judge.next_deadline() is None
    judge.on_report(AT_REST, 2.0)
    assert judge.next_deadline() == 2.5
    judge.on_report(ENABLED, 2.25)
    assert judge.next_deadline() is None, "it does not follow any more"


# another stop, while one is on the bus


def changing(*, is_cut_off: bool = False) -> Judge:
    """A drive that runs on, with a stop on the bus since 1.0 and another one to be sent."""
    judge = Play().run([(1.0, OFF)], end=1.0 + STEP_S).follow
    if is_cut_off:
        judge.on_cut_off(1.125, BOUNDS)
    judge.on_output(RAMP)
    assert judge.awaits_sending and judge.is_judged
    return judge


def is_of_no_stop_on_the_bus(judge: Judge) -> bool:
    is_quiet = judge.next_deadline() is None and judge.on_time(9.0, 9.0, PAUSE_S) == []
    return is_quiet and not judge.stop.is_on_bus


def test_who_enables_takes_back_a_stop_that_is_changing() -> None:
    judge = changing()
    judge.on_output(ENABLES)
    assert (judge.state, judge.awaits_sending) == (LastStop.NONE, False)
    assert is_of_no_stop_on_the_bus(judge)


def test_a_node_that_leaves_takes_the_stop_with_it() -> None:
    judge = Play().run([(1.0, OFF)], end=1.0 + STEP_S).follow
    judge.on_node(is_there=False)
    assert is_of_no_stop_on_the_bus(judge)
    judge = Play().run([(1.0, OFF), (1.0, Deed.CUT_OFF)], end=1.0 + STEP_S).follow
    assert judge.stop.is_on_bus
    judge.on_restart()
    assert is_of_no_stop_on_the_bus(judge)


def test_a_node_that_leaves_takes_back_what_was_to_be_sent() -> None:
    judge = changing()
    judge.on_node(is_there=False)
    assert not judge.awaits_sending and not judge.is_informed
    assert is_of_no_stop_on_the_bus(judge)
    judge.on_node(is_there=True)
    assert (judge.state, judge.awaits_sending) == (LastStop.FORWARDED, True)


def test_a_pause_begins_the_bound_anew_while_the_stop_is_changing() -> None:
    judge = changing()
    judge.on_pause(1.25)
    assert judge.awaits_sending
    assert judge.on_time(1.75 - STEP_S, 1.75 - STEP_S, PAUSE_S) == []
    [verdict] = judge.on_time(1.75, 1.75, PAUSE_S)
    assert verdict == StopVerdict(IGNORED, LastStop.FORWARDED, since=1.25, at=1.75)


def test_who_is_cut_off_while_the_stop_is_changing_is_judged_on() -> None:
    judge = changing(is_cut_off=True)
    judge.on_node(is_there=False)
    judge.on_output(SILENT)
    assert not judge.awaits_sending, "nothing is sent to a node that is not in operation"
    [verdict] = judge.on_time(5.5, None, PAUSE_S)
    assert (verdict.outcome, verdict.is_cut_off) == (IGNORED, True)


@pytest.mark.parametrize("starts", [False, True])
def test_a_node_that_is_back_after_the_bridge_cut_it_off_is_told_to_stop_again(starts: bool) -> None:
    judge = changing(is_cut_off=True)
    judge.on_node(is_there=False)
    if starts:
        judge.on_restart()
        assert not judge.awaits_sending and not judge.is_informed
        assert is_of_no_stop_on_the_bus(judge)
    judge.on_node(is_there=True)
    assert (judge.state, judge.awaits_sending, judge.is_informed) == (LastStop.FORWARDED, True, False)
    assert is_of_no_stop_on_the_bus(judge)


# nodes that leave


@pytest.mark.parametrize(
    ("script", "told_then"),
    [
        # It leaves by itself: what its drive says then is of no stop, and it is told anew when it is back.
        ([(1.0, OFF), (1.25, Deed.NODE_LEAVES)], []),
        ([(1.0, OFF), (1.25, Deed.NODE_LEAVES), (2.0, AT_REST)], []),
        ([(1.0, OFF), (1.25, Deed.NODE_LEAVES), (8.0, Deed.NODE_BACK)], [(IGNORED, 8.5)]),
        ([(0.5, Deed.NODE_LEAVES), (1.0, OFF), (8.0, Deed.NODE_BACK)], [(IGNORED, 8.5)]),
        ([(1.0, OFF), (1.25, Deed.NODE_LEAVES), (1.3125, ENABLES), (8.0, Deed.NODE_BACK)], []),
        # It is cut off by the bridge: nothing else is heard of the drive, so its last word counts.
        ([(1.0, OFF), (1.0, Deed.CUT_OFF)], [(IGNORED, 1.5)]),
        ([(1.0, RAMP), (2.0, Deed.CUT_OFF)], [(IGNORED, 5.0)]),
        ([(1.0, OFF), (1.25, AT_REST), (2.0, Deed.CUT_OFF)], [(FOLLOWED, 1.25)]),
        ([(1.0, OFF), (1.25, STOPPING), (2.0, Deed.CUT_OFF)], [(FOLLOWED, 1.25)]),
        ([(1.0, OFF), (2.0, Deed.CUT_OFF)], [(IGNORED, 1.5)]),
        ([(1.0, Deed.CUT_OFF)], []),
        # Its node says that it is stopped, or starts anew.
        ([(1.0, OFF), (1.0, Deed.CUT_OFF), (1.4375, Deed.NODE_STOPPED)], [(FOLLOWED, 1.4375)]),
        ([(1.0, OFF), (1.0, Deed.CUT_OFF), (1.4375, Deed.NODE_STARTS)], []),
        ([(1.0, OFF), (1.0, Deed.CUT_OFF), (2.0, Deed.NODE_STOPPED)], [(IGNORED, 1.5)]),
        ([(1.0, OFF), (1.4375, Deed.NODE_STOPPED)], [(IGNORED, 1.5)]),
        ([(1.0, OFF), (1.4375, Deed.NODE_STARTS)], [(IGNORED, 1.5)]),
        # That it is stopped is the last word also of a drive that was on its ramp, or enabled for a moment.
        ([(0.5, STOPPING), (1.0, OFF), (1.0, Deed.CUT_OFF)], [(FOLLOWED, 1.0), (IGNORED, 5.0)]),
        (
            [(0.5, STOPPING), (1.0, OFF), (1.0, Deed.CUT_OFF), (1.125, Deed.NODE_STOPPED)],
            [(FOLLOWED, 1.0)],
        ),
        (
            [(1.0, RAMP), (2.0, AT_REST), (2.5, ENABLED), (2.75, OFF), (2.75, Deed.CUT_OFF)],
            [(FOLLOWED, 2.0), (IGNORED, 3.0)],
        ),
        (
            [
                *[(1.0, RAMP), (2.0, AT_REST), (2.5, ENABLED)],
                *[(2.75, OFF), (2.75, Deed.CUT_OFF), (2.875, Deed.NODE_STOPPED)],
            ],
            [(FOLLOWED, 2.0)],
        ),
    ],
)
def test_a_node_that_leaves(script: Script, told_then: Told) -> None:
    told(script, told_then)


def test_a_node_that_says_that_it_is_stopped_is_believed_at_once() -> None:
    """Also of a drive that sends changes alone, whose last report may otherwise be too old to count."""
    script: Script = [(1.0, OFF), (1.0, Deed.CUT_OFF), (1.125, Deed.NODE_STOPPED)]
    told(script, [(FOLLOWED, 1.125)], on_change=True)


def test_who_is_cut_off_and_was_silenced_without_a_bound_has_that_of_a_ramp() -> None:
    told([(1.0, SILENT), (2.0, Deed.CUT_OFF)], [(IGNORED, 6.0)], bounds=UNWATCHED)


def test_who_has_never_said_anything_is_not_judged_when_it_is_cut_off() -> None:
    play = Play(is_mute=True).run([(1.0, OFF), (1.0, Deed.CUT_OFF)])
    assert play.told == []
    assert play.follow.sent_for_s(play.now) == 0.0
    assert not play.follow.is_informed
