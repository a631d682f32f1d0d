"""``Start``: one request that leads a drive through its states to *operation enabled*."""

from __future__ import annotations

from typing import Final

from bridge.command.leg.effect import StartBegun, StartEnded
from bridge.command.leg.event import Report
from bridge.command.leg.state import AWAITS_REPORT, MAY_FOLLOW_LATE, UNHEARD, Stage, Start
from bridge.command.leg.table import Deed, Stimulus
from bridge.command.leg.turn import Turn
from bridge.command.messages.request import DONE, Code, Outcome
from bridge.drive import FAULTED, DriveState
from bridge.text import Text

_LIMIT_S: Final = 3.0
_BRAKING_S: Final = 1.0
"""How long a quick stop may still take. A drive that stays in it afterwards (605Ah = 5 … 8) leaves it with
disable voltage only; at once, that would let a motor coast that is still being stopped."""
_SETTLES_S: Final = 0.2
"""For this long after a stop, reports may still describe the time before it. A drive that says "enabled"
later than that is on its ramp, or is held."""
_BELIEVED_S: Final = 1.0
"""Without a report from a drive that sends only changes, its last one is accepted after this time."""
_CAN_BE_ENABLED: Final = (DriveState.READY, DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED)


def begin(turn: Turn, word: int) -> None:
    """Start with the word that enables; the drive may be enabled and has no fault."""
    before, now, state = turn.start, turn.now, turn.drive
    if before is not None:
        turn.effects.append(StartEnded(Outcome(Code.CANCELLED, Text.of("start.started_anew"))))
    turn.effects.append(StartBegun())
    is_enabled = state is DriveState.OPERATION_ENABLED
    is_late = turn.motion in MAY_FOLLOW_LATE
    is_stopping = turn.stage is Stage.INTERLOCKED or not turn.is_enabling
    started = Start(word, now + _LIMIT_S, is_late=is_late)
    if not turn.way.is_heard:
        was = turn.stage
        turn.happens(Stimulus.START_UNHEARD)
        believed_at = before.believed_at if before and was in UNHEARD else None
        leaves_at = now + _BRAKING_S if turn.stage is Stage.ASKING else None
        turn.start = started._replace(believed_at=believed_at or now + _BELIEVED_S, leaves_at=leaves_at)
    elif is_stopping and (is_enabled or is_late):
        turn.happens(Stimulus.START_STOPPING)
        kept = before or started
        turn.start = started._replace(
            settles_at=kept.settles_at or now + _SETTLES_S,
            believed_at=kept.believed_at or now + _BELIEVED_S,
            leaves_at=kept.leaves_at or now + _BRAKING_S,
        )
    elif state is DriveState.QUICK_STOP_ACTIVE:
        turn.happens(Stimulus.START_BRAKING)
        leaves_at = before.leaves_at if before else None
        turn.start = started._replace(leaves_at=leaves_at or now + _BRAKING_S)
    else:
        turn.happens(Stimulus.START)
        turn.start = started
        if not is_enabled:
            turn.lead(turn.settings.words.ready)
        _go_on(turn, state)
        return
    # What stops it goes on until it is known to be over: to become ready may mean to coast.
    turn.lead(turn.word_at_rest)


def on_report(turn: Turn, report: Report, *, is_news: bool) -> None:
    """The drive has said in which state it is; ``is_news``: that is another one than before."""
    start, state, stage = turn.start, report.state, turn.stage
    if start is None or state is DriveState.UNKNOWN:
        return
    if not is_news and stage not in AWAITS_REPORT:
        return
    if state in FAULTED:
        why = Text.of("start.fault", fault=Text.plain(report.fault_text))
        _give_up(turn, Stimulus.SAYS_FAULT, Code.NOT_READY, why)
    elif stage is Stage.LEADING:
        _go_on(turn, state)
    elif stage is not Stage.SETTLING or not _may_be_old(turn, start, state, is_news=is_news):
        _believe(turn, start, state)


def _may_be_old(turn: Turn, start: Start, state: DriveState, *, is_news: bool) -> bool:
    """While a stop is on its way: what the drive says now may still come from the enable before it."""
    is_early = start.settles_at is not None and turn.now < start.settles_at
    if not is_news:
        return is_early
    if state is DriveState.OPERATION_ENABLED:
        return True
    return start.is_late and is_early and state in _CAN_BE_ENABLED


def _believe(turn: Turn, start: Start, state: DriveState) -> None:
    """Take it that the drive is in this state now, and leave the waiting for it."""
    if state is DriveState.QUICK_STOP_ACTIVE:
        turn.happens(Stimulus.SAYS_BRAKING)
        turn.start = start._replace(settles_at=None, believed_at=None)
        if start.leaves_at is None:
            _leave(turn)
        return
    turn.lead(turn.settings.words.ready)
    _go_on(turn, state)


def _go_on(turn: Turn, state: DriveState) -> None:
    """The next word for a drive in this state."""
    start, words = turn.start, turn.settings.words
    if start is None or state is DriveState.UNKNOWN:
        return
    if state is DriveState.OPERATION_ENABLED:
        turn.lead(start.word | words.begin)
        turn.happens(Stimulus.SAYS_ENABLED, DONE)
        return
    if state is not DriveState.QUICK_STOP_ACTIVE:
        turn.happens(Stimulus.SAYS_AT_REST)
        turn.start = Start(start.word, start.until)
    if state in _CAN_BE_ENABLED:
        turn.lead(start.word)
    elif state is DriveState.SWITCH_ON_INHIBITED:
        # Where a stop was on its way, what was known of the drive was out of date.
        turn.lead(words.ready)


def on_time(turn: Turn) -> None:
    start, now = turn.start, turn.now
    if start is None:
        return
    if now >= start.until:
        why = Text.of("start.overdue", state=Text.word("drive_state", turn.drive.label))
        _give_up(turn, Stimulus.START_OVERDUE, Code.TIMED_OUT, why)
        return
    if start.believed_at is not None and now >= start.believed_at:
        _believe_without_report(turn, start)
    start = turn.start
    if start is not None and start.leaves_at is not None and now >= start.leaves_at:
        turn.start = start._replace(leaves_at=None)
        if turn.drive is DriveState.QUICK_STOP_ACTIVE:
            _leave(turn)


def _leave(turn: Turn) -> None:
    """The drive has had its time for the quick stop, and is still in it."""
    if turn.happens(Stimulus.BRAKING_OVERDUE) is Deed.LEAVE:
        words = turn.settings.words
        turn.lead(words.disable_voltage(words.ready))


def _believe_without_report(turn: Turn, start: Start) -> None:
    """The drive has said nothing in time. Of one that has said nothing since its node is operational nothing
    is believed: it is made ready and then enabled, and has to say that it is."""
    if turn.stage is Stage.SETTLING:
        if turn.drive is DriveState.UNKNOWN:
            turn.start = start._replace(believed_at=None)
        else:
            _believe(turn, start, turn.drive)
        return
    deed = turn.happens(Stimulus.REPORT_OVERDUE)
    if deed is Deed.READY:
        turn.start = start._replace(believed_at=turn.now + _BELIEVED_S, leaves_at=None)
        turn.lead(turn.settings.words.ready)
    elif deed is Deed.ENABLE:
        turn.start = start._replace(believed_at=None)
        turn.lead(start.word)


def _give_up(turn: Turn, stimulus: Stimulus, code: Code, why: Text) -> None:
    turn.happens(stimulus, Outcome(code, why))
    turn.stop(turn.word_at_rest)


def next_deadline(start: Start) -> float:
    times = (start.believed_at, start.leaves_at, start.until)
    return min(time for time in times if time is not None)
