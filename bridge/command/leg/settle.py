"""The end of each step: the way to the drive and what is sent are brought up to date."""

from __future__ import annotations

from bridge.command.leg import order
from bridge.command.leg.deeds import About, happen
from bridge.command.leg.draft import Draft
from bridge.command.leg.due import run_out
from bridge.command.leg.settings import HandshakeSettings
from bridge.command.leg.state import Motion, Stage
from bridge.command.leg.table import Stimulus
from bridge.command.leg.word_table import send
from bridge.command.messages.event import EventKind
from bridge.command.messages.request import Code, Outcome
from bridge.drive import DriveState
from bridge.text import Text


def look_at_way(draft: Draft) -> None:
    """Go on as the way to the drive is now. What was sent last may have closed it: a drive that is stopped
    needs a known position before it is enabled anew."""
    if draft.may_enable:
        happen(draft, Stimulus.WAY_OPEN)
    else:
        happen(draft, Stimulus.WAY_CLOSED, About(Outcome(Code.NOT_READY, draft.why_blocked)))


def settle(draft: Draft) -> None:
    look_at_way(draft)
    run_out(draft)
    was_enabling = draft.is_enabling
    if draft.drive is DriveState.FAULT and draft.word & draft.settings.words.acknowledge_mask:
        # It ends with the fault: what was asked for then would hold the motor after it.
        draft.is_asked = False
    send(draft)
    if draft.stage is Stage.BURST:
        draft.trip = draft.trip._replace(burst=draft.sent.words[0])
    handshake = draft.settings.handshake
    if handshake is not None:
        _hand_position_over(draft, handshake)
    if draft.is_enabling:
        if not was_enabling:
            draft.motion = Motion.SEEN if draft.is_enabled else Motion.EXPECTED
        draft.is_asked = False


def _hand_position_over(draft: Draft, handshake: HandshakeSettings) -> None:
    draft.order, is_untaken = order.went_on(
        draft.order,
        tuple(draft.setpoints[place] for place in handshake.places),
        draft.now,
        is_acknowledged=draft.is_acknowledged,
        commanded=draft.is_commanded,
    )
    send(draft)
    if is_untaken:
        draft.tell(EventKind.REFUSED, 500, Text.of("start.position_not_taken"))
