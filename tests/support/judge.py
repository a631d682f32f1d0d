"""One judge of a drive's stops, told what happens call by call."""

from __future__ import annotations

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
    TelegramHeard,
    TimePassed,
)
from bridge.command.stop_check.state import Bounds, LastStop, Says, Sent, StopState, StopVerdict
from bridge.command.stop_check.step import next_deadline, step


class Judge:
    """A judge with its state."""

    def __init__(self) -> None:
        self.stop = StopState()

    @property
    def state(self) -> LastStop:
        return self.stop.last_stop

    @property
    def follows(self) -> bool:
        return self.stop.follows

    @property
    def awaits_sending(self) -> bool:
        return self.stop.awaits_sending

    @property
    def is_judged(self) -> bool:
        return self.stop.is_judged

    @property
    def is_informed(self) -> bool:
        return self.stop.is_informed

    def sent_for_s(self, now: float) -> float:
        return self.stop.sent_for_s(now)

    def next_deadline(self) -> float | None:
        return next_deadline(self.stop)

    def on_output(self, sent: Sent) -> None:
        self._step(Sends(sent))

    def on_handed_over(self, now: float, bounds: Bounds) -> None:
        self._step(HandedOver(now, bounds))

    def on_node(self, *, is_there: bool) -> None:
        self._step(NodeOperational(is_there))

    def on_cut_off(self, now: float, bounds: Bounds) -> None:
        self._step(CutOff(now, bounds))

    def on_node_stopped(self, now: float) -> None:
        self._step(NodeStopped(now))

    def on_restart(self) -> None:
        self._step(NodeRestarted())

    def on_pause(self, at: float) -> None:
        self._step(TelegramGap(at))

    def on_report(self, says: Says, at: float) -> None:
        self._step(StatusChange(says, at))

    def on_telegram(self, at: float, speed: float | None) -> None:
        self._step(TelegramHeard(at, speed))

    def on_time(self, now: float, heard_at: float | None, pause_s: float | None) -> list[StopVerdict]:
        self.stop, verdicts = step(self.stop, TimePassed(now, heard_at, pause_s))
        return list(verdicts)

    def _step(self, event: Event) -> None:
        self.stop, verdicts = step(self.stop, event)
        assert not verdicts, "they are told when the bus has been drained"
