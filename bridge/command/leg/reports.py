"""Reports of the drive: its state, and whether it has moved since the last word that enabled it."""

from __future__ import annotations

from bridge.command.leg import order, start
from bridge.command.leg.deeds import happen
from bridge.command.leg.event import Report
from bridge.command.leg.state import MAY_FOLLOW_LATE, REACTING, Motion
from bridge.command.leg.table import Stimulus
from bridge.command.leg.turn import Turn
from bridge.drive import FAULTED, MOVING, DriveState


def on_report(turn: Turn, report: Report) -> None:
    is_news = report.state is not turn.drive
    turn.is_taken = report.is_taken
    _state(turn, report.state)
    if not turn.way.is_heard:
        turn.way = turn.way._replace(is_heard=True)
    start.on_report(turn, report, is_news=is_news)


def on_actual_words(turn: Turn, actual: tuple[int, ...]) -> None:
    """Setpoints of a drive that nobody commands follow it."""
    rest = list(turn.rest)
    for place, source in turn.settings.follows:
        rest[place] = actual[source]
    turn.rest = tuple(rest)
    turn.keep_at_rest()


def on_told_anew(turn: Turn) -> None:
    """From here on, reports describe the time after the drive was told everything anew."""
    if turn.motion is Motion.EXPECTED:
        turn.motion = Motion.SEEN
    elif turn.motion is Motion.FAULTED:
        turn.motion = Motion.ENDED


def _state(turn: Turn, state: DriveState) -> None:
    was_enabled = turn.is_enabled
    turn.drive = state
    if state in FAULTED or (was_enabled and not turn.is_enabled):
        turn.order = order.dropped(turn.order)
        turn.keep_at_rest()
    motion = turn.motion
    if state is DriveState.FAULT_REACTION_ACTIVE and motion in MAY_FOLLOW_LATE:
        # The fault may have come before the word that enables.
        return
    if state in MOVING:
        # Ignore a late "moving" report when the word being sent does not enable.
        if motion is Motion.EXPECTED or turn.is_enabling:
            turn.motion = Motion.SEEN
        elif motion is Motion.FAULTED:
            turn.motion = Motion.ENDED
    elif state is not DriveState.UNKNOWN:
        if turn.stage in REACTING:
            happen(turn, Stimulus.SAYS_FAULT if state in FAULTED else Stimulus.SAYS_AT_REST)
        if motion is Motion.SEEN:
            turn.motion = Motion.ENDED
        elif motion is Motion.EXPECTED and state is DriveState.FAULT:
            turn.motion = Motion.FAULTED
