"""The inverter behind CAN 5000: its axes, one at a time, and the event it is in fault with."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from bridge.sim.core.store import Store
from bridge.sim.core.ticks import earliest
from bridge.sim.stoeber.stoeber_axis import AxisParameters, AxisState, StoeberAxis
from bridge.sim.stoeber.stoeber_events import CODES, NO_EVENT, brakes
from bridge.sim.stoeber.stoeber_settings import StoeberSettings


class StoeberDevice:
    """``report`` is called with error code and error register when an event has come, and with zeros when
    it has gone (ID 441684.06 §9.3)."""

    def __init__(
        self,
        axes: int,
        settings: Store[StoeberSettings],
        report: Callable[[int, int], None],
        kind: type[StoeberAxis] = StoeberAxis,
    ) -> None:
        self.event = NO_EVENT
        self.cause = 0
        self.cause_lasts = False
        self._settings = settings
        self._report = report
        self.axes = tuple(
            kind(number + 1, partial(self.parameters, number), partial(self._is_free_for, number))
            for number in range(axes)
        )

    @property
    def shown(self) -> StoeberAxis:
        """The axis whose values the device displays: the one that is switched on."""
        return next((axis for axis in self.axes if axis.blocks_others), self.axes[0])

    @property
    def state(self) -> AxisState:
        """E48."""
        return self.shown.state

    @property
    def error_register(self) -> int:
        """1001h."""
        return 0 if self.event == NO_EVENT else CODES[self.event][1]

    def parameters(self, axis: int = 0) -> AxisParameters:
        """The parameters of an axis (from 0)."""
        return self._settings.current.axes[axis]

    def power_on(self, now: float) -> None:
        self.event, self.cause, self.cause_lasts = NO_EVENT, 0, False
        for axis in self.axes:
            axis.power_on(now)

    def trip(self, event: int, cause: int = 0, *, lasting: bool = False) -> None:
        """The inverter and all its axes go into fault; the first event is the one displayed."""
        if self.event != NO_EVENT:
            return
        self.event, self.cause, self.cause_lasts = event, cause, lasting
        for axis in self.axes:
            axis.trip(brakes=brakes(event))
        self._report(*CODES[event])

    def acknowledge(self) -> None:
        """Without effect while the cause lasts or the axes still react to it."""
        reacts = any(axis.state is AxisState.FAULT_REACTION for axis in self.axes)
        if self.cause_lasts or self.event == NO_EVENT or reacts:
            return
        for axis in self.axes:
            axis.acknowledge()
        self.event, self.cause = NO_EVENT, 0
        self._report(0, 0)

    def advance(self, now: float) -> None:
        for axis in self.axes:
            axis.advance(now)
        self.settle()

    def settle(self) -> None:
        """Make all transitions that are due; an axis that has come to rest frees the others."""
        for _ in range(2):
            changes = [axis.settle() for axis in self.axes]
            if not any(changes):
                return

    def next_deadline(self) -> float | None:
        return earliest(*(axis.next_deadline() for axis in self.axes))

    def _is_free_for(self, number: int) -> bool:
        """One axis at a time: the POSISwitch changes over when no other axis is on or turns."""
        return not any(axis.blocks_others for place, axis in enumerate(self.axes) if place != number)
