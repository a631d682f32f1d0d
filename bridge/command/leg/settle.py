"""The end of each step: the way to the drive and what is sent are brought up to date."""

from __future__ import annotations

from bridge.command.leg import order
from bridge.command.leg.deeds import About, happen
from bridge.command.leg.due import run_out
from bridge.command.leg.settings import HandshakeSettings
from bridge.command.leg.state import Motion, Stage
from bridge.command.leg.table import Stimulus
from bridge.command.leg.turn import Turn
from bridge.command.leg.words import send
from bridge.command.messages.event import Kind
from bridge.command.messages.request import Code, Outcome
from bridge.drive import DriveState
from bridge.text import Text


def look_at_way(turn: Turn) -> None:
    """Go on as the way to the drive is now. What was sent last may have closed it: a drive that is stopped
    needs a known position before it is enabled anew."""
    if turn.may_enable:
        happen(turn, Stimulus.WAY_OPEN)
    else:
        happen(turn, Stimulus.WAY_CLOSED, About(Outcome(Code.NOT_READY, turn.why_blocked)))


def settle(turn: Turn) -> None:
    look_at_way(turn)
    run_out(turn)
    was_enabling = turn.is_enabling
    if turn.drive is DriveState.FAULT and turn.word & turn.settings.words.acknowledge_mask:
        # It ends with the fault: what was asked for then would hold the motor after it.
        turn.is_asked = False
    send(turn)
    if turn.stage is Stage.BURST:
        turn.trip = turn.trip._replace(burst=turn.sent.words[0])
    handshake = turn.settings.handshake
    if handshake is not None:
        _hand_position_over(turn, handshake)
    if turn.is_enabling:
        if not was_enabling:
            turn.motion = Motion.SEEN if turn.is_enabled else Motion.EXPECTED
        turn.is_asked = False


def _hand_position_over(turn: Turn, handshake: HandshakeSettings) -> None:
    turn.order, is_untaken = order.went_on(
        turn.order,
        tuple(turn.setpoints[place] for place in handshake.places),
        turn.now,
        is_taken=turn.is_taken,
        commanded=turn.is_commanded,
    )
    send(turn)
    if is_untaken:
        turn.tell(Kind.REFUSED, 500, Text.of("start.position_not_taken"))
