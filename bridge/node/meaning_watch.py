"""Repeated reads of what drives' words mean, while the node is in operation: somebody may have changed it at
the drive's keypad, or with the maker's tool."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from bridge.canopen.sdo import Priority, Result, SdoChannel, SdoError
from bridge.command import Drive
from bridge.command.node import Node
from bridge.drive import DriveState, Key, ParameterSet
from bridge.mapping.model import Meaning, ObjectRef, Parameter
from bridge.node.boot import code_of, deciding_of, meanings_of, parameter_value
from bridge.node.places.sdo_channels import SdoChannels

_EVERY_S: Final = 8.0
"""Age in seconds at which an answer is read again: with the time that this takes, a change is found within
``_BOUND_S``."""
_BOUND_S: Final = 10.0
"""Age in seconds beyond which an answer is no longer taken for certain."""
_LOOK_S: Final = 0.5
"""Period of the check for due reads, in seconds."""
_PAUSE_S: Final = 1.0
"""Pause in seconds from an unanswered question to the next one about the same object."""
_SHARE: Final = 0.25
"""Weight of the newest answer in the mean response time."""
_TURNS: Final = 3
"""Transfers for each one about a set that is not in use: the others are left to polling."""
_SLOWEST: Final = 0.75
"""Largest share of ``_EVERY_S`` that reads about the sets in use may take, where answers are slow."""


@dataclass(slots=True, eq=False)
class _Item:
    """One object that decides what words mean, with the times of its last answer and of the last attempt in
    vain."""

    what: Meaning | Parameter
    in_set: int
    ref: ObjectRef
    key: Key
    read_at: float
    tried_at: float = -math.inf
    is_of_all_sets: bool = field(init=False)

    def __post_init__(self) -> None:
        self.is_of_all_sets = isinstance(self.what, Parameter) and not self.what.sets


@dataclass(slots=True)
class _WatchedDrive:
    """Watch over one drive. ``items`` are the objects that count with the present codes of its words."""

    drive: Drive
    sdo: SdoChannel
    items: dict[Key, _Item] = field(default_factory=dict[Key, _Item])
    codes: object = None
    """The codes for which ``items`` were chosen."""
    was_enabled: bool = False
    not_before: float = -math.inf
    """Time before which answers do not count: those are read again."""
    answer_s: float = 0.0
    """Mean response time in seconds."""
    rest_at: float = -math.inf
    """Earliest time for the next read about a set that is not in use."""
    is_asking: bool = False
    run: int = 0
    """Number of the present run in operation; answers from an earlier one do not count."""


class MeaningWatch:
    """Watch over the drives of one node. Nothing is read where the family names no such parameters.

    Each answer is read again when it is some seconds old, oldest first, and those that count in the parameter
    sets in use before all others; all of them when the drive has been enabled, and when it reports by a TPDO
    that something has changed. ``now`` is the time of the last frame or timer.
    """

    def __init__(self, node: Node, sdo: SdoChannels) -> None:
        self._drives: list[_WatchedDrive] = []
        self._look_at: float | None = None
        self.now = 0.0
        for drive in node.drives:
            number = drive.spec.sdo_channel
            asked = meanings_of(drive) or any(
                value.scaled_by or value.when or value.steady for value in drive.family.values_of(drive.slot)
            )
            if number is not None and asked:
                self._drives.append(_WatchedDrive(drive, sdo[number]))

    def start(self, now: float) -> None:
        """Begin: the node is in operation, and its drives have just been asked."""
        self.now = now
        if not self._drives:
            return
        self._look_at = now + _LOOK_S
        for watched in self._drives:
            watched.run += 1
            watched.was_enabled = watched.is_asking = False
            watched.items.clear()
            watched.not_before = -math.inf
            self._choose(watched, now)

    def stop(self) -> None:
        self._look_at = None
        for watched in self._drives:
            watched.run += 1

    def next_deadline(self) -> float | None:
        return self._look_at

    def on_time(self, now: float) -> None:
        self.now = now
        if self._look_at is None or now < self._look_at:
            return
        self._look_at = now + _LOOK_S
        for watched in self._drives:
            news = watched.drive.news
            is_enabled = watched.drive.channel.state is DriveState.OPERATION_ENABLED
            if news.is_to_be_asked or (is_enabled and not watched.was_enabled):
                watched.not_before = now
            news.is_to_be_asked = False
            watched.was_enabled = is_enabled
            news.drop_old_setpoints(now)
            self._choose(watched, -math.inf)
            self._judge(watched)
            self._ask(watched)

    def _choose(self, watched: _WatchedDrive, read_at: float) -> None:
        """Choose the objects to read, by the present codes. New ones among them count as read at
        ``read_at``."""
        drive = watched.drive
        codes = drive.channel.meanings.codes
        if codes is watched.codes and watched.items:
            return
        watched.codes = codes
        conditions, before = drive.channel.meanings.conditions, watched.items
        told = drive.told_by_tpdo
        items = [
            _Item(one, in_set, ref, (one.leaf, in_set), read_at)
            for one, in_set, ref in meanings_of(drive)
            if one.leaf not in told
        ]
        for one, in_set, ref in deciding_of(drive, codes):
            key = conditions.key(one.name, in_set)
            items.append(_Item(one, in_set, ref, key, read_at))
        watched.items = {one.key: before.get(one.key, one) for one in items}

    def _judge(self, watched: _WatchedDrive) -> None:
        """Report objects without an answer for too long as being in doubt."""
        late = (key for key, one in watched.items.items() if self.now - one.read_at > _BOUND_S)
        watched.drive.news.on_overdue(frozenset(late), self.now)

    def _ask(self, watched: _WatchedDrive) -> None:
        """Send the next read. Its answer leads to the one after it, so that other transfers get their turn in
        between."""
        if watched.is_asking or self._look_at is None:
            return
        sets = _sets_in_use(watched.drive)
        in_use: list[_Item] = []
        rest: list[_Item] = []
        for one in watched.items.values():
            (in_use if one.is_of_all_sets or one.in_set in sets else rest).append(one)
        lead_s = min(_SLOWEST * _EVERY_S, len(in_use) * watched.answer_s)
        due = self._due(watched, in_use, _EVERY_S - lead_s)
        if not due:
            due = self._due(watched, rest, _EVERY_S)
            if due and self.now < watched.rest_at:
                self._look_at = min(self._look_at, watched.rest_at)
                return
            watched.rest_at = self.now + _TURNS * watched.answer_s
        if due:
            self._read(watched, min(due, key=lambda one: max(one.read_at, one.tried_at)))

    def _due(self, watched: _WatchedDrive, items: list[_Item], every_s: float) -> list[_Item]:
        """Items whose answers are to be read again."""
        now, not_before = self.now, watched.not_before
        return [
            one
            for one in items
            if (one.read_at < not_before or now >= one.read_at + every_s) and now >= one.tried_at + _PAUSE_S
        ]

    def _read(self, watched: _WatchedDrive, item: _Item) -> None:
        run, asked_at = watched.run, self.now

        def done(result: Result) -> None:
            if run != watched.run or self._look_at is None:
                return
            watched.is_asking = False
            watched.answer_s += _SHARE * (self.now - asked_at - watched.answer_s)
            told = watched.drive.channel.meanings.told_by_drive
            if not isinstance(result, SdoError):
                told.add(item.key)
                item.read_at = self.now
                self._told(watched.drive, item, result)
            elif result.by_server and item.key not in told:
                item.read_at = self.now
                self._told(watched.drive, item, None)
            else:
                # No answer, or a refusal of what it has told before: it has the object, and may have
                # changed it.
                item.tried_at = self.now
            self._choose(watched, -math.inf)
            self._judge(watched)
            self._ask(watched)

        watched.is_asking = True
        watched.sdo.read(item.ref.index, item.ref.sub, self.now, done, priority=Priority.MEANING)

    def _told(self, drive: Drive, item: _Item, data: bytes | None) -> None:
        """Pass an answer on to the drive; ``data`` is None where the drive has refused it."""
        if isinstance(item.what, Meaning):
            code = code_of(drive.family, item.what, data)
            drive.news.on_code(item.what, code, self.now, item.in_set)
            return
        try:
            setting = None if data is None else parameter_value(item.what, data)
        except ValueError:
            setting = 0.0
        drive.news.on_parameter(item.what.name, setting, self.now, item.in_set)


def _sets_in_use(drive: Drive) -> Sequence[int]:
    """The parameter set of the drive's status word, and the commanded one."""
    family, channel = drive.family, drive.channel
    actual = ParameterSet(family.status_word.parameter_set_bits).of(channel.drive_status_word)
    return actual, ParameterSet(family.control_word.parameter_set_bits).of(channel.control_word)
