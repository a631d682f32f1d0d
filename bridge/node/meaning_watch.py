"""Asks drives again what their words mean, while the node is in operation: somebody may have changed it at
the drive's keypad, or with the maker's tool."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

from bridge.canopen.sdo import Priority, Result, SdoChannel, SdoError
from bridge.command import Drive
from bridge.command.event import Event, Kind
from bridge.command.plant import Node, Plant
from bridge.drive import MOVING, DriveState, ParameterSet, is_scale, no_scale
from bridge.mapping.model import Meaning, ObjectRef, Parameter
from bridge.node.boot import code_of, meanings_of, parameter_value, scales_of
from bridge.node.sdo_channels import SdoChannels, channel_of

_EVERY_S: Final = 8.0
"""From one pass to the next: with the pass itself a change is found within 10 s."""
_LOOK_S: Final = 0.5
"""How often it is looked whether a drive has been enabled."""

_Asked = tuple[Meaning | Parameter, int, ObjectRef]


@dataclass(slots=True)
class _Watched:
    drive: Drive
    sdo: SdoChannel
    asked: list[_Asked]
    set: ParameterSet
    due: float = math.inf
    was_enabled: bool = False
    means_otherwise: bool = False
    """The setpoints that are held were written for another meaning of their words."""
    run: int = 0
    """Counts passes: what an earlier one is told late does not count."""
    codes: dict[str, list[int | None]] = field(default_factory=dict[str, list[int | None]])
    scales: dict[tuple[str, int], float] = field(default_factory=dict[tuple[str, int], float])


class MeaningWatch:
    """The drives of one node. Nothing is asked where the family names no such parameters. A drive is asked
    every few seconds and whenever it has been enabled, first for the parameter set that is active."""

    def __init__(self, node: Node, sdo: SdoChannels, plant: Plant) -> None:
        self._plant = plant
        self._drives: list[_Watched] = []
        self._look_at: float | None = None
        self._now = 0.0
        for drive in node.drives:
            number = channel_of(node, drive.slot)
            asked: list[_Asked] = [*meanings_of(drive), *scales_of(drive)]
            if number is not None and asked:
                bits = ParameterSet(drive.family.status_word.parameter_set_bits)
                self._drives.append(_Watched(drive, sdo[number], asked, bits))

    def start(self, now: float) -> None:
        """The node is in operation, and its drives have just been asked."""
        if not self._drives:
            return
        self._look_at = now + _LOOK_S
        for watched in self._drives:
            watched.due = now + _EVERY_S
            watched.was_enabled = False

    def stop(self) -> None:
        self._look_at = None
        for watched in self._drives:
            watched.run += 1

    def next_deadline(self) -> float | None:
        return self._look_at

    def on_time(self, now: float) -> None:
        self._now = now
        if self._look_at is None or now < self._look_at:
            return
        self._look_at = now + _LOOK_S
        for watched in self._drives:
            is_enabled = watched.drive.channel.state is DriveState.OPERATION_ENABLED
            if is_enabled and not watched.was_enabled:
                watched.due = now
            watched.was_enabled = is_enabled
            self._drop_setpoints(watched, now)
            if watched.due <= now:
                watched.due = now + _EVERY_S
                self._ask(watched, now)

    def _drop_setpoints(self, watched: _Watched, now: float) -> None:
        """Of a drive that is not enabled: it has to be commanded anew. One that runs does already what its
        words mean now."""
        channel = watched.drive.channel
        is_moving = channel.state in MOVING or channel.words.enables(channel.output.words[0])
        if watched.means_otherwise and not is_moving:
            watched.means_otherwise = False
            channel.start_anew(now)

    def _ask(self, watched: _Watched, now: float) -> None:
        """One pass. Each answer leads to the next question, so that others get their turn in between."""
        watched.run += 1
        known = watched.drive.channel.meanings
        watched.codes = {leaf: list(codes) for leaf, codes in known.codes.items()}
        active = watched.set.of(watched.drive.channel.drive_status_word)
        # The last one is asked first.
        rest = sorted(watched.asked, key=lambda one: one[1] == active)
        self._next(watched, rest, watched.run, now)

    def _next(self, watched: _Watched, rest: list[_Asked], run: int, now: float) -> None:
        if not rest:
            return
        what, in_set, ref = rest.pop()

        def done(result: Result) -> None:
            if run != watched.run or self._look_at is None:
                return
            if isinstance(what, Parameter):
                self._told_scale(watched, what, in_set, result)
            elif not (isinstance(result, SdoError) and not result.by_server):
                data = None if isinstance(result, SdoError) else result
                self._told(watched, what, in_set, code_of(watched.drive.family, what, data))
            self._next(watched, rest, run, self._now)

        watched.sdo.read(ref.index, ref.sub, now, done, priority=Priority.POLL)

    def _told_scale(self, watched: _Watched, parameter: Parameter, in_set: int, result: Result) -> None:
        if isinstance(result, SdoError):
            return
        try:
            value = parameter_value(parameter, result)
        except ValueError:
            value = 0.0
        key = parameter.name, in_set
        if watched.scales.get(key) == value:
            return
        watched.scales[key] = value
        watched.drive.on_scale(parameter.name, value, in_set)
        watched.drive.refresh(self._now)
        if not is_scale(value):
            message = no_scale(parameter.name, value)
            self._plant.report(Event(self._now, Kind.CONFIGURATION, watched.drive.name, 500, message))

    def _told(self, watched: _Watched, meaning: Meaning, in_set: int, code: int | None) -> None:
        codes = watched.codes.setdefault(meaning.leaf, [None] * watched.drive.family.sets)
        before = codes[in_set - 1]
        if code == before:
            return
        codes[in_set - 1] = code
        drive = watched.drive
        watched.means_otherwise |= drive.on_codes(watched.codes)
        self._drop_setpoints(watched, self._now)
        drive.refresh(self._now)
        told = "cannot be read" if code is None else f"is {code}"
        was = "could not be read" if before is None else f"was {before}"
        what = f"{meaning.parameter} of parameter set {in_set} {told}, it {was}"
        message = f"{what}: {meaning.leaf} has another meaning"
        self._plant.report(Event(self._now, Kind.CONFIGURATION, drive.name, 500, message))
