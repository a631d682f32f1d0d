"""Stop check of one drive: feeds the judge with the drive's words, telegrams and node states."""

from __future__ import annotations

from typing import Final

from bridge.command.drive_channel import DriveChannel
from bridge.command.drive_link import NodeState
from bridge.command.stop_check.event import (
    CutOff,
    Event,
    HandedOver,
    NodeOperational,
    NodeRestarted,
    NodeStopped,
    Sends,
    StatusChange,
    TelegramGap,
    TimePassed,
)
from bridge.command.stop_check.state import Bounds, LastStop, Says, Sent, StopState, StopVerdict
from bridge.command.stop_check.step import next_deadline, on_telegram, step
from bridge.drive import MOVING, DriveState, OwnJudgement, OwnVerdict, StatusWords

_DEADLINES: Final = 3
_ON_CHANGE_S: Final = 0.5
"""Deadline in seconds where the drive sends its TPDO on change only."""
_CYCLE_S: Final = 0.1
"""Time in seconds from a word in the node to a telegram with another speed: by a bus interface and back."""


class DriveStopCheck:
    """Stop check of one drive, called on every change of its channel's output, status word and node."""

    def __init__(self, channel: DriveChannel) -> None:
        self._channel = channel
        self._state = StopState()
        self._output: tuple[int, bool] | None = None
        self._status_word: int | None = None
        self._words = StatusWords(channel.family.status_word)

    @property
    def follows(self) -> bool:
        return self._state.follows

    @property
    def last_stop(self) -> LastStop:
        return self._state.last_stop

    @property
    def is_judged(self) -> bool:
        """A stop is on the bus, and the drive's node is in operation."""
        return self._state.is_judged

    def sent_for_s(self, now: float) -> float:
        """Time in seconds for which the stop has been on the bus; 0 if there is none, or not known."""
        return self._state.sent_for_s(now)

    @property
    def awaits_sending(self) -> bool:
        return self._state.awaits_sending

    # what we do

    def on_settled(self) -> None:
        """Take over the output of the settled channel, and the state of its node."""
        channel = self._channel
        self._tell(NodeOperational(channel.link.node is NodeState.OPERATIONAL))
        words, silent = channel.output
        output = words[0], silent
        if output != self._output:
            self._output = output
            self._tell(Sends(self._sent(*output)))

    def _sent(self, word: int, silent: bool) -> Sent:
        words = self._channel.words
        if silent:
            return Sent.SILENT
        if words.enables(word):
            return Sent.ENABLES
        return Sent.OFF if words.takes_voltage(word) else Sent.RAMP

    def on_handed_over(self, now: float, rpdo_period_ms: int, own: OwnJudgement | None) -> None:
        """Begin the bound: the stop has been handed to the bus. ``rpdo_period_ms`` is its longest time to the
        drive, ``own`` the drive's own reaction to a silent bridge."""
        self._tell(HandedOver(now, self._bounds(rpdo_period_ms, own)))
        self._channel.plan_anew()

    def on_cut_off(self, now: float, rpdo_period_ms: int, own: OwnJudgement | None) -> None:
        """Judge by the last report: the bridge cuts off the node, and the drive will not be heard again."""
        self._tell(CutOff(now, self._bounds(rpdo_period_ms, own)))
        self._channel.plan_anew()

    def on_node_stopped(self, now: float) -> None:
        """Note that the node reports a state in which its drives do not run."""
        self._tell(NodeStopped(now))
        self._channel.plan_anew()

    def on_restart(self) -> None:
        """Note that the node has started: what it was told before is over."""
        self._tell(NodeRestarted())

    def _bounds(self, rpdo_period_ms: int, own: OwnJudgement | None) -> Bounds:
        channel = self._channel
        given_ms = channel.settings.ignored_stop_ms
        stopping = channel.family.stopping
        deadline_s = channel.link.pdo_deadline_s or _ON_CHANGE_S
        way_s = rpdo_period_ms / 1000
        if given_ms is not None:
            off_s = ramp_s = given_ms / 1000
        else:
            off_s = _DEADLINES * deadline_s + way_s + stopping.off_ms / 1000
            ramp_s = off_s + stopping.ramp_ms / 1000
        silence_s = None
        if own is not None and own.verdict is OwnVerdict.STOPS:
            # Our heartbeat goes on while the RPDOs are silent: a drive that supervises it would not stop.
            silence_s = (own.process_data_ms or own.bridge_ms) / 1000 + ramp_s
        return Bounds(off_s, ramp_s, silence_s, way_s + stopping.off_ms / 1000, way_s + _CYCLE_S)

    # what the drive does

    def before_pdo(self, now: float) -> None:
        """Take note of a TPDO with the status word, before the link knows of it."""
        link = self._channel.link
        last, deadline_s = link.last_pdo, link.pdo_deadline_s
        if last is not None and deadline_s is not None and now - last > deadline_s:
            self._tell(TelegramGap(now))
            self._channel.plan_anew()

    def after_pdo(self, now: float) -> None:
        """Take over the status word of the TPDO, which the channel has."""
        word = self._channel.drive_status_word
        if word != self._status_word or not self._state.is_informed:
            self._status_word = word
            self._tell(StatusChange(self._says(word), now))
            self._channel.plan_anew()

    def on_telegram(self, now: float, speed: float | None) -> None:
        """Take note of the TPDO that ``after_pdo`` knows, changed or not. ``speed`` is the actual speed or
        frequency in any unit, None where it is not known."""
        before = self._state
        state = self._state = on_telegram(before, now, speed)
        if state.last_stop is not before.last_stop:
            self._channel.plan_anew()

    def _says(self, word: int) -> Says:
        state = self._channel.state
        if state is DriveState.OPERATION_ENABLED:
            return Says.HOLDING if self._words.holds(word) else Says.ENABLED
        if state is DriveState.UNKNOWN:
            return Says.NOTHING
        return Says.STOPPING if state in MOVING else Says.AT_REST

    # time

    def on_time(self, now: float) -> tuple[StopVerdict, ...]:
        """Verdicts on the stops that have ended by ``now``; call it when the bus has been drained."""
        link = self._channel.link
        heard_at = link.last_pdo if link.is_heard else None
        self._state, verdicts = step(self._state, TimePassed(now, heard_at, link.pdo_deadline_s))
        return verdicts

    def next_deadline(self) -> float | None:
        return next_deadline(self._state)

    def _tell(self, event: Event) -> None:
        """Tell the judge of an event. It gives no verdict: those are told when the bus has been drained."""
        self._state, _ = step(self._state, event)
