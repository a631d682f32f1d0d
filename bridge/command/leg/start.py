"""``StartProgress``: one request that leads a drive through its states to *operation enabled*.

Here it is decided what happens to a start; the table says what is done then.
"""

from __future__ import annotations

from typing import Final

from bridge.command.leg.deeds import BELIEVED_S, About, happen, start_of
from bridge.command.leg.draft import Draft
from bridge.command.leg.effect import StartBegun, StartEnded
from bridge.command.leg.event import StatusReport
from bridge.command.leg.state import AWAITS_REPORT, MAY_FOLLOW_LATE, UNHEARD, Stage, StartProgress
from bridge.command.leg.table import Stimulus
from bridge.command.messages.request import DONE, Code, Outcome
from bridge.command.messages.telegram import Refusal
from bridge.drive import FAULTED, DriveState
from bridge.text import Text

_LIMIT_S: Final = 3.0
_BRAKING_S: Final = 1.0
"""Time in seconds that a quick stop may still take. A drive that stays in it afterwards (605Ah = 5 … 8)
leaves it with disable voltage only; at once, that would let a motor coast that is still being stopped."""
_SETTLES_S: Final = 0.2
"""Time in seconds after a stop in which reports may still describe the time before it. A drive that says
"enabled" later than that is on its ramp, or is held."""
_CAN_FOLLOW_LATE: Final = (DriveState.READY, DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED)
"""States in which a drive may still follow an enabling word that was sent before the stop."""


def begin(draft: Draft, word: int, refusal: Refusal) -> None:
    """Start with the word that enables. Raises ``refusal`` where the table refuses it."""
    before, now = draft.start, draft.now
    if before is not None:
        draft.effects.append(StartEnded(Outcome(Code.CANCELLED, Text.of("start.started_anew"))))
    draft.effects.append(StartBegun())
    is_late = draft.motion in MAY_FOLLOW_LATE
    stimulus = _kind_of_start(draft, is_late=is_late)
    started = StartProgress(word, now + _LIMIT_S, is_late=is_late)
    kept = before or started
    match stimulus:
        case Stimulus.START_UNHEARD:
            is_asking = draft.stage not in (Stage.PREPARED, Stage.BLIND)
            believed_at = kept.believed_at if draft.stage in UNHEARD else None
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
    draft.start = started
    happen(draft, stimulus, About(DONE, refusal=refusal))


def _kind_of_start(draft: Draft, *, is_late: bool) -> Stimulus:
    if draft.stage is Stage.CLOSED or draft.is_tripped:
        return Stimulus.START
    if draft.drive in FAULTED or draft.way.why_unsent:
        return Stimulus.START_REFUSED
    is_enabled = draft.drive is DriveState.OPERATION_ENABLED
    is_stopping = draft.stage is Stage.INTERLOCKED or not draft.is_enabling
    if not draft.way.is_heard:
        return Stimulus.START_UNHEARD
    if is_stopping and (is_enabled or is_late):
        return Stimulus.START_STOPPING
    if draft.drive is DriveState.QUICK_STOP_ACTIVE:
        return Stimulus.START_BRAKING
    return Stimulus.START_ENABLED if is_enabled else Stimulus.START


def on_report(draft: Draft, report: StatusReport, *, is_news: bool) -> None:
    """The drive has said in which state it is; ``is_news``: that is another one than before."""
    start, state, stage = draft.start, report.state, draft.stage
    if start is None or state is DriveState.UNKNOWN:
        return
    if not is_news and stage not in AWAITS_REPORT:
        return
    if state in FAULTED:
        why = Text.of("start.fault", fault=report.fault)
        happen(draft, Stimulus.SAYS_FAULT, About(Outcome(Code.NOT_READY, why)))
    elif stage is not Stage.SETTLING or not _may_be_old(draft, start, state, is_news=is_news):
        _believe(draft)


def _may_be_old(draft: Draft, start: StartProgress, state: DriveState, *, is_news: bool) -> bool:
    """While a stop is on its way: what the drive says now may still come from the enable before it."""
    is_early = start.settles_at is not None and draft.now < start.settles_at
    if not is_news:
        return is_early
    if state is DriveState.OPERATION_ENABLED:
        return True
    return start.is_late and is_early and state in _CAN_FOLLOW_LATE


def _believe(draft: Draft) -> None:
    """Take it that the drive is in the state now that it has reported last, and leave the waiting for it."""
    if draft.drive is DriveState.QUICK_STOP_ACTIVE:
        happen(draft, Stimulus.SAYS_BRAKING)
        if draft.stage is Stage.BRAKING and start_of(draft).leaves_at is None:
            happen(draft, Stimulus.BRAKING_OVERDUE)
    elif draft.drive is DriveState.OPERATION_ENABLED:
        happen(draft, Stimulus.SAYS_ENABLED, About(DONE))
    else:
        happen(draft, Stimulus.SAYS_AT_REST)


def on_time(draft: Draft) -> None:
    start, now = draft.start, draft.now
    if start is None:
        return
    if now >= start.until:
        why = Text.of("start.overdue", state=Text.word("drive_state", draft.drive.label))
        happen(draft, Stimulus.START_OVERDUE, About(Outcome(Code.TIMED_OUT, why)))
        return
    if start.believed_at is not None and now >= start.believed_at:
        _believe_without_report(draft, start)
    start = draft.start
    if start is not None and start.leaves_at is not None and now >= start.leaves_at:
        draft.start = start._replace(leaves_at=None)
        if draft.drive is DriveState.QUICK_STOP_ACTIVE:
            happen(draft, Stimulus.BRAKING_OVERDUE)


def _believe_without_report(draft: Draft, start: StartProgress) -> None:
    """The drive has said nothing in time. Of one that has said nothing since its node is operational nothing
    is believed: it is made ready and then enabled, and has to say that it is."""
    if draft.stage is not Stage.SETTLING:
        happen(draft, Stimulus.REPORT_OVERDUE)
    elif draft.drive is DriveState.UNKNOWN:
        draft.start = start._replace(believed_at=None)
    else:
        _believe(draft)


def next_deadline(start: StartProgress) -> float:
    times = (start.believed_at, start.leaves_at, start.until)
    return min(time for time in times if time is not None)
