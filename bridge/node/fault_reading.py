"""Reads the fault numbers that drives keep themselves, such as P700 of a NORD drive.

A drive is asked after an emergency message about it, repeatedly while it is in the state *fault*, and once
more after that, so that a fault that is gone is no longer shown.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from bridge.canopen.sdo import Priority, Result, SdoChannel, SdoError
from bridge.command import Drive
from bridge.command.node import Node
from bridge.drive import FAULTED
from bridge.mapping.model import FaultParameter, Parameter
from bridge.node.boot import parameter_value
from bridge.node.places.sdo_channels import SdoChannels

_LOOK_S: Final = 0.5
_AGAIN_S: Final = 1.0
"""Period of the reads while a drive is in fault."""


@dataclass(slots=True)
class _FaultWatch:
    drive: Drive
    sdo: SdoChannel
    due: float = math.inf
    was_faulted: bool = False


class FaultReading:
    """Fault reading for the drives of one node. Nothing is read where the family names no such parameter."""

    def __init__(self, node: Node, sdo: SdoChannels) -> None:
        faults, family = node.family.faults, node.family

        def parameter(given: FaultParameter | None) -> Parameter | None:
            return None if given is None else family.parameter_named(given.parameter)

        # Some families have a number for "no fault" that is not 0.
        self._none = family.emcy.event.gone if family.emcy.event else None
        self._current, self._last = parameter(faults.current), parameter(faults.last)
        self._drives: dict[str, _FaultWatch] = {}
        self._look_at: float | None = None
        self._now = 0.0
        if self._current is None and self._last is None:
            return
        for drive in node.drives:
            number = drive.spec.sdo_channel
            if number is not None:
                self._drives[drive.name] = _FaultWatch(drive, sdo[number])

    def start(self, now: float) -> None:
        """Ask each drive once for its stored faults: the node is in operation."""
        if not self._drives:
            return
        self._look_at = now
        for asked in self._drives.values():
            asked.due = now

    def stop(self) -> None:
        self._look_at = None

    def on_emcy(self, drive: Drive, now: float) -> None:
        """Ask this drive at once: an emergency message about it came."""
        asked = self._drives.get(drive.name)
        if asked is not None and self._look_at is not None:
            asked.due = now
            self._look_at = now

    def next_deadline(self) -> float | None:
        return self._look_at

    def on_time(self, now: float) -> None:
        self._now = now
        if self._look_at is None or now < self._look_at:
            return
        self._look_at = now + _LOOK_S
        for asked in self._drives.values():
            is_faulted = asked.drive.channel.state in FAULTED
            if is_faulted is not asked.was_faulted:
                asked.was_faulted = is_faulted
                asked.due = now
            if asked.due <= now:
                asked.due = now + _AGAIN_S if is_faulted else math.inf
                self._ask(asked, now)

    def _ask(self, asked: _FaultWatch, now: float) -> None:
        channel = asked.drive.channel

        def tell_current(value: float) -> None:
            channel.on_drive_fault(0.0 if value == self._none else value, None, self._now)

        def tell_last(value: float) -> None:
            channel.on_drive_fault(None, value, self._now)

        for parameter, tell in ((self._current, tell_current), (self._last, tell_last)):
            if parameter is not None:
                ref = asked.drive.family.object_of(parameter)
                done = _done(parameter, tell)
                asked.sdo.read(ref.index, ref.sub, now, done, priority=Priority.POLL)


def _done(parameter: Parameter, tell: Callable[[float], None]) -> Callable[[Result], None]:
    def done(result: Result) -> None:
        if isinstance(result, SdoError):
            return
        try:
            value = parameter_value(parameter, result)
        except ValueError:
            return
        if math.isfinite(value):
            tell(value)

    return done
