"""Conditions of values by parameters of the drive: the settings with which a value means what the mapping
file says, and the parameters that may not be changed."""

from __future__ import annotations

from typing import Final, NamedTuple

from bridge.image import Quality
from bridge.mapping.model import Family, ProcessValue
from bridge.text import Said, Text

_FIRST: Final = 1

Key = tuple[str, int]
"""A parameter's name, or a word's leaf, and the parameter set; 1 for what all sets share."""


class Lack(NamedTuple):
    """Reason why a value is not served, or with the quality *stale*, why it is in doubt."""

    quality: Quality
    why: Said


class Conditions:
    """Settings that one drive has told, in the unit of each parameter."""

    def __init__(self, family: Family) -> None:
        self._family = family
        self._told: dict[Key, float | None] = {}
        self._first: dict[Key, float] = {}
        """First setting told since the bridge runs."""

    def key(self, name: str, in_set: int) -> Key:
        """Key of the setting that counts in this parameter set."""
        return name, in_set if self._family.parameter_named(name).sets else _FIRST

    def told(self, key: Key) -> float | None:
        """Setting told by the drive; None where it refuses, or has not been asked."""
        return self._told.get(key)

    def has_been_asked(self, key: Key) -> bool:
        """Whether the drive has answered, if only that it does not tell it."""
        return key in self._told

    def tell(self, key: Key, value: float | None) -> None:
        """Take over the drive's answer; None where it refuses one."""
        self._told[key] = value
        if value is not None:
            self._first.setdefault(key, value)

    def take_defaults(self) -> None:
        """Take defaults where there is no drive to ask: everything means what the mapping file says."""
        for value in self._family.value:
            for name, settings in value.when.items():
                for in_set in range(_FIRST, self._family.sets + 1):
                    self._told[self.key(name, in_set)] = settings[0]

    def lack(self, value: ProcessValue, in_set: int, unread: Lack) -> Lack | None:
        """Lack of ``value`` in this set where it does not mean what the mapping file says; None where it
        does. ``unread`` is the lack of a parameter that the drive has not told."""
        for name, settings in value.when.items():
            setting = self.told(self.key(name, in_set))
            if setting is None:
                return Lack(unread.quality, unread_in((name,), self._set_of(name, in_set), unread.why))
            if setting not in settings:
                shown = (self._shown(name, setting),)
                why = otherwise_in((value.said_otherwise,), self._set_of(name, in_set), shown)
                return Lack(Quality.DISABLED, why)
        for name in self._family.steady_of(value):
            key = self.key(name, in_set)
            first, setting = self._first.get(key), self.told(key)
            if first is not None and setting is not None and first != setting:
                return Lack(Quality.CONFIG_ERROR, _was_changed(name, first, setting))
        return None

    def _shown(self, name: str, setting: float) -> Text:
        state = self._family.parameter_named(name).said_state(round(setting))
        if state:
            return Text.of("meaning.setting_state", parameter=name, value=setting, state=state)
        return Text.of("meaning.setting", parameter=name, value=setting)

    def _set_of(self, name: str, in_set: int) -> int | None:
        """Parameter set to be named with the setting; None where all share it."""
        return in_set if self._family.parameter_named(name).sets else None


def unread_in(parameters: tuple[str, ...], in_set: int | None, why: Said) -> Text:
    """Text about parameters that the drive has not told."""
    if in_set is None:
        return Text.of("meaning.unread", parameters=parameters, why=why)
    return Text.of("meaning.unread_in_set", parameters=parameters, in_set=in_set, why=why)


def otherwise_in(otherwise: tuple[Text, ...], in_set: int | None, settings: tuple[Text, ...]) -> Text:
    """Text about values that with these settings mean otherwise, as the mapping file has it."""
    if in_set is None:
        return Text.of("meaning.otherwise", otherwise=otherwise, settings=settings)
    return Text.of("meaning.otherwise_in_set", otherwise=otherwise, in_set=in_set, settings=settings)


def _was_changed(name: str, first: float, setting: float) -> Text:
    return Text.of("meaning.was_changed", parameter=name, first=first, now=setting)
