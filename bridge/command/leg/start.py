"""``Start``: one request that leads a drive through its states to *operation enabled*.

Here it is decided what happens to a start; the table says what is done then.
"""

from __future__ import annotations

from typing import Final

from bridge.command.leg.deeds import BELIEVED_S, About, happen, start_of
from bridge.command.leg.effect import StartBegun, StartEnded
from bridge.command.leg.event import Report
from bridge.command.leg.state import AWAITS_REPORT, MAY_FOLLOW_LATE, UNHEARD, Stage, Start
from bridge.command.leg.table import Stimulus
from bridge.command.leg.turn import Turn
from bridge.command.messages.request import DONE, Code, Outcome
from bridge.command.messages.telegram import Refusal
from bridge.drive import FAULTED, DriveState
from bridge.text import Text

_LIMIT_S: Final = 3.0
_BRAKING_S: Final = 1.0
"""Time that a quick stop may still take. A drive that stays in it afterwards (605Ah = 5 … 8) leaves it with
disable voltage only; at once, that would let a motor coast that is still being stopped."""
_SETTLES_S: Final = 0.2
"""For this long after a stop, reports may still describe the time before it. A drive that says "enabled"
later than that is on its ramp, or is held."""
_CAN_FOLLOW_LATE: Final = (DriveState.READY, DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED)
"""States in which a drive may still follow an enabling word that was sent before the stop."""


def begin(turn: Turn, word: int, refusal: Refusal) -> None:
    """Start with the word that enables. Raises ``refusal`` where the table refuses it."""
    before, now = turn.start, turn.now
    if before is not None:
        turn.effects.append(StartEnded(Outcome(Code.CANCELLED, Text.of("start.started_anew"))))
    turn.effects.append(StartBegun())
    is_late = turn.motion in MAY_FOLLOW_LATE
    stimulus = _kind_of_start(turn, is_late=is_late)
    started = Start(word, now + _LIMIT_S, is_late=is_late)
    kept = before or started
    match stimulus:
        case Stimulus.START_UNHEARD:
            is_asking = turn.stage not in (Stage.PREPARED, Stage.BLIND)
            believed_at = kept.believed_at if turn.stage in UNHEARD else None
            started = started._replace(
                believed_at=believed_at or now + BELIEVED_S,
                leaves_at=now + _BRAKING_S if is_asking else None,
            )
        case Stimulus.START_STOPPING:
            started = started._replace(
                settles_at=kept.settles_at or now + _SETTLES_S,
                believed_at=kept.believed_at or now + BELIEVED_S,
                leaves_at=kept.leaves_at or now + _BRAKING_S,
            )
        case Stimulus.START_BRAKING:
            started = started._replace(leaves_at=kept.leaves_at or now + _BRAKING_S)
        case _:
            pass
    turn.start = started
    happen(turn, stimulus, About(DONE, refusal=refusal))


def _kind_of_start(turn: Turn, *, is_late: bool) -> Stimulus:
    if turn.stage is Stage.CLOSED or turn.is_tripped:
        return Stimulus.START
    if turn.drive in FAULTED or turn.way.why_unsent:
        return Stimulus.START_REFUSED
    is_enabled = turn.drive is DriveState.OPERATION_ENABLED
    is_stopping = turn.stage is Stage.INTERLOCKED or not turn.is_enabling
    if not turn.way.is_heard:
        return Stimulus.START_UNHEARD
    if is_stopping and (is_enabled or is_late):
        return Stimulus.START_STOPPING
    if turn.drive is DriveState.QUICK_STOP_ACTIVE:
        return Stimulus.START_BRAKING
    return Stimulus.START_ENABLED if is_enabled else Stimulus.START


def on_report(turn: Turn, report: Report, *, is_news: bool) -> None:
    """The drive has said in which state it is; ``is_news``: that is another one than before."""
    start, state, stage = turn.start, report.state, turn.stage
    if start is None or state is DriveState.UNKNOWN:
        return
    if not is_news and stage not in AWAITS_REPORT:
        return
    if state in FAULTED:
        why = Text.of("start.fault", fault=report.fault)
        happen(turn, Stimulus.SAYS_FAULT, About(Outcome(Code.NOT_READY, why)))
    elif stage is not Stage.SETTLING or not _may_be_old(turn, start, state, is_news=is_news):
        _believe(turn)


def _may_be_old(turn: Turn, start: Start, state: DriveState, *, is_news: bool) -> bool:
    """While a stop is on its way: what the drive says now may still come from the enable before it."""
    is_early = start.settles_at is not None and turn.now < start.settles_at
    if not is_news:
        return is_early
    if state is DriveState.OPERATION_ENABLED:
        return True
    return start.is_late and is_early and state in _CAN_FOLLOW_LATE


def _believe(turn: Turn) -> None:
    """Take it that the drive is in the state now that it has reported last, and leave the waiting for it."""
    if turn.drive is DriveState.QUICK_STOP_ACTIVE:
        happen(turn, Stimulus.SAYS_BRAKING)
        if turn.stage is Stage.BRAKING and start_of(turn).leaves_at is None:
            happen(turn, Stimulus.BRAKING_OVERDUE)
    elif turn.drive is DriveState.OPERATION_ENABLED:
        happen(turn, Stimulus.SAYS_ENABLED, About(DONE))
    else:
        happen(turn, Stimulus.SAYS_AT_REST)


def on_time(turn: Turn) -> None:
    start, now = turn.start, turn.now
    if start is None:
        return
    if now >= start.until:
        why = Text.of("start.overdue", state=Text.word("drive_state", turn.drive.label))
        happen(turn, Stimulus.START_OVERDUE, About(Outcome(Code.TIMED_OUT, why)))
        return
    if start.believed_at is not None and now >= start.believed_at:
        _believe_without_report(turn, start)
    start = turn.start
    if start is not None and start.leaves_at is not None and now >= start.leaves_at:
        turn.start = start._replace(leaves_at=None)
        if turn.drive is DriveState.QUICK_STOP_ACTIVE:
            happen(turn, Stimulus.BRAKING_OVERDUE)


def _believe_without_report(turn: Turn, start: Start) -> None:
    """The drive has said nothing in time. Of one that has said nothing since its node is operational nothing
    is believed: it is made ready and then enabled, and has to say that it is."""
    if turn.stage is not Stage.SETTLING:
        happen(turn, Stimulus.REPORT_OVERDUE)
    elif turn.drive is DriveState.UNKNOWN:
        turn.start = start._replace(believed_at=None)
    else:
        _believe(turn)


def next_deadline(start: Start) -> float:
    times = (start.believed_at, start.leaves_at, start.until)
    return min(time for time in times if time is not None)
