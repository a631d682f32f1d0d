"""Reports of the drive: its state, and whether it has moved since the last word that enabled it."""

from __future__ import annotations

from bridge.command.leg import order, start
from bridge.command.leg.deeds import happen
from bridge.command.leg.draft import Draft
from bridge.command.leg.event import StatusReport
from bridge.command.leg.state import MAY_FOLLOW_LATE, REACTING, Motion
from bridge.command.leg.table import Stimulus
from bridge.drive import FAULTED, MOVING, DriveState


def on_report(draft: Draft, report: StatusReport) -> None:
    is_news = report.state is not draft.drive
    draft.is_acknowledged = report.is_acknowledged
    _state(draft, report.state)
    if not draft.way.is_heard:
        draft.way = draft.way._replace(is_heard=True)
    start.on_report(draft, report, is_news=is_news)


def on_actual_words(draft: Draft, actual: tuple[int, ...]) -> None:
    """Setpoints of a drive that nobody commands follow it."""
    rest = list(draft.rest)
    for place, source in draft.settings.follows:
        rest[place] = actual[source]
    draft.rest = tuple(rest)
    draft.keep_at_rest()


def on_told_anew(draft: Draft) -> None:
    """From here on, reports describe the time after the drive was told everything anew."""
    if draft.motion is Motion.EXPECTED:
        draft.motion = Motion.SEEN
    elif draft.motion is Motion.FAULTED:
        draft.motion = Motion.ENDED


def _state(draft: Draft, state: DriveState) -> None:
    was_enabled = draft.is_enabled
    draft.drive = state
    if state in FAULTED or (was_enabled and not draft.is_enabled):
        draft.order = order.dropped(draft.order)
        draft.keep_at_rest()
    motion = draft.motion
    if state is DriveState.FAULT_REACTION_ACTIVE and motion in MAY_FOLLOW_LATE:
        # The fault may have come before the word that enables.
        return
    if state in MOVING:
        # Ignore a late "moving" report when the word being sent does not enable.
        if motion is Motion.EXPECTED or draft.is_enabling:
            draft.motion = Motion.SEEN
        elif motion is Motion.FAULTED:
            draft.motion = Motion.ENDED
    elif state is not DriveState.UNKNOWN:
        if draft.stage in REACTING:
            happen(draft, Stimulus.SAYS_FAULT if state in FAULTED else Stimulus.SAYS_AT_REST)
        if motion is Motion.SEEN:
            draft.motion = Motion.ENDED
        elif motion is Motion.EXPECTED and state is DriveState.FAULT:
            draft.motion = Motion.FAULTED
