"""Changes of what a drive's words mean by its settings: events, and what becomes of setpoints in force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from bridge.command.drive_channel import DriveChannel
from bridge.command.messages.event import Event, EventKind, EventQueue
from bridge.command.setpoint_doubts import InForce
from bridge.drive import Codes, Key, is_scale, no_scale
from bridge.mapping.model import Family, Meaning, Slot
from bridge.text import Text


class HasWords(Protocol):
    """The drive whose words they are."""

    name: str
    family: Family
    slot: Slot
    channel: DriveChannel

    @property
    def is_enabled(self) -> bool: ...

    @property
    def words(self) -> Sequence[int]: ...

    def in_force(self) -> dict[str, InForce]: ...

    def on_codes(self, codes: Codes) -> bool: ...

    def compile(self) -> None: ...

    def refresh(self, now: float) -> None: ...


class MeaningNews:
    """News of one drive's settings; those read for the first time are none."""

    def __init__(self, drive: HasWords, events: EventQueue) -> None:
        self._drive = drive
        self._events = events
        self._is_commanded_otherwise = False
        """A setpoint in force was written for another meaning of its words."""
        self.is_to_be_asked = False
        """Something has happened after which the words may mean something else."""

    def on_boot_up(self, settings: Mapping[Key, float | None], now: float) -> None:
        """Take over the settings of parameters, each in one of its sets, that a boot-up has read.

        Those read for the first time are compiled once for all of them: the other nodes of a bus wait for
        their frames meanwhile.
        """
        meanings = self._drive.channel.meanings
        asked = meanings.conditions.has_been_asked
        first = [key for key in settings if not asked(meanings.conditions.key(*key))]
        for name, in_set in first:
            meanings.on_parameter(name, settings[name, in_set], in_set)
        if first:
            self._drive.compile()
            self._drive.refresh(now)
        for (name, in_set), setting in settings.items():
            self.on_parameter(name, setting, now, in_set)

    def on_parameter(self, name: str, setting: float | None, now: float, in_set: int = 1) -> None:
        """Take over the setting of a parameter that decides the meaning of words, in the parameter's unit;
        None where the drive refuses to tell it."""
        drive, meanings = self._drive, self._drive.channel.meanings
        if meanings.has_told(name, setting, in_set):
            return
        key = meanings.conditions.key(name, in_set)
        had, before = meanings.conditions.told(key), drive.in_force()
        is_first = not meanings.conditions.has_been_asked(key)
        meanings.on_parameter(name, setting, in_set)
        drive.compile()
        if is_first:
            drive.refresh(now)
            return
        after = drive.in_force()
        gone = [leaf for leaf, one in before.items() if leaf not in after and any(one.words)]
        self._is_commanded_otherwise |= bool(gone)
        affected = [*self._doubted(before, after), *self._affected_by(name, setting)]
        self._tell((name, in_set), setting, had, affected, now)

    def on_code(self, meaning: Meaning, code: int | None, now: float, in_set: int = 1) -> None:
        """Take over the code of what one word carries; None where the drive refuses to tell it."""
        known = self._drive.channel.meanings.codes
        of_sets = [*known.get(meaning.leaf, (None,) * self._drive.family.sets)]
        had, of_sets[in_set - 1] = of_sets[in_set - 1], code
        if code == had:
            return
        codes = {**known, meaning.leaf: of_sets}
        self._is_commanded_otherwise |= self._drive.on_codes(codes)
        affected = [Text.of("meaning.other", leaf=meaning.leaf)]
        self._tell((meaning.parameter, in_set), code, had, affected, now)

    def on_told(self, meaning: Meaning, code: int, now: float) -> None:
        """Take over the code of a word's meaning from a TPDO, and have what depends on it asked at once."""
        self.is_to_be_asked = True
        self.on_code(meaning, code, now)

    def on_overdue(self, overdue: frozenset[Key], now: float) -> None:
        """Take over the settings that decide the meaning of words and have not been read again in time."""
        if self._drive.channel.meanings.on_overdue(overdue):
            self._drive.compile()
            self._drive.refresh(now)

    def drop_old_setpoints(self, now: float) -> None:
        """Drop setpoints that were written for another meaning of their words, where the drive is not
        enabled: it has to be commanded anew. One that runs does already what its words mean."""
        channel = self._drive.channel
        is_old = self._is_commanded_otherwise or channel.doubts.has_any(channel.setpoints)
        if is_old and not self._drive.is_enabled:
            self._is_commanded_otherwise = False
            channel.start_anew(now)

    def _doubted(self, before: Mapping[str, InForce], after: Mapping[str, InForce]) -> list[Text]:
        note = self._drive.channel.doubts.note
        return [
            Text.of("meaning.in_doubt", leaf=name, why=why)
            for name, one in before.items()
            if name in after and (why := note(name, one, after[name]))
        ]

    def _affected_by(self, name: str, setting: float | None) -> list[Text]:
        """Texts about the values that depend on a parameter: what changes with it."""
        family = self._drive.family
        found: list[Text] = []
        for value in family.values_of(self._drive.slot):
            is_steady = name in family.steady_of(value)
            if name in value.when or is_steady:
                found.append(Text.of("meaning.other", leaf=value.leaf))
            elif name in value.scaled_by and setting is not None and not is_scale(setting):
                found.append(no_scale(name, setting))
            elif name in value.scaled_by:
                found.append(Text.of("meaning.other_scale", leaf=value.leaf))
        return list(dict.fromkeys(found))

    def _tell(
        self, key: Key, setting: float | None, had: float | None, affected: Sequence[Text], now: float
    ) -> None:
        said = _changed(*key, setting, had, tuple(affected))
        self._events.report(Event(now, EventKind.CONFIGURATION, self._drive.name, 500, said))
        self.drop_old_setpoints(now)
        self._drive.refresh(now)


def _changed(
    name: str, in_set: int, setting: float | None, had: float | None, affected: tuple[Text, ...]
) -> Text:
    if setting is None and had is None:
        return Text.of("meaning.unreadable", parameter=name, in_set=in_set, affected=affected)
    if setting is None:
        return Text.of("meaning.lost", parameter=name, in_set=in_set, before=had or 0, affected=affected)
    if had is None:
        return Text.of("meaning.found", parameter=name, in_set=in_set, setting=setting, affected=affected)
    return Text.of(
        "meaning.changed", parameter=name, in_set=in_set, setting=setting, before=had, affected=affected
    )
