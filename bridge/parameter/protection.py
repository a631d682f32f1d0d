"""Protection of objects that may not be written as a parameter, under whatever name: judged by the objects
that a write touches.

Every write of a client and of the command line goes through ``DriveParameters``, which asks ``Protection``
with a ``Gate``. A maker's parameter may be another name of a communication object, or determine one in
another form: see ``[aliases]`` of the mapping file.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from typing import Final

from bridge.image import Value
from bridge.mapping.alias_places import Alias, aliases
from bridge.mapping.aliases import COMMUNICATION
from bridge.mapping.entry_types import said_of
from bridge.mapping.model import Family, ObjectRef, Parameter
from bridge.mapping.own_places import places
from bridge.mapping.parameters import indices
from bridge.parameter.definition import ParameterEntry
from bridge.parameter.profiles import effect_of
from bridge.parameter.transfer import Transfer
from bridge.parameter.write_effect import Effect, WriteVerdict, judge
from bridge.text import Text

_PROFILE: Final = 0xFFFF
"""The bits of 1000h that are the number of the profile (CiA 301 §7.5.2.1)."""
_CIA_402: Final = 402
_ORDER: Final = tuple(Effect)

Asks = Callable[[Iterable[ParameterEntry]], Generator[Transfer, tuple[bytes, float], None]]


@dataclass(frozen=True, slots=True)
class Gate:
    """Rights of the writer, and what is known of what the node moves.

    ``is_moving`` is asked before a write is queued and again when its turn has come: whoever owns the drive
    may enable it in between. ``asks`` comes right before the write, and raises ``ParameterError`` where there
    is to be none: for whoever has to ask the drive whether it moves. With ``expected`` nothing is written
    where the drive, asked just before, holds anything else, or cannot be asked.
    """

    is_engineer: bool
    is_moving: Callable[[], bool]
    asks: Asks | None = None
    expected: Value | None = None


class Protection:
    """Effects of writing the objects of one family. ``listed`` has its definitions, with the index of each
    one's object."""

    def __init__(self, family: Family, listed: Iterable[tuple[int, Parameter]]) -> None:
        rule = family.parameter_names
        self._is_device = family.is_device
        self._profile = _profile_of(family)
        self._read_only = said_of(family.family.read_only)
        self._commands = [indices(one) for one in rule.protected] if rule else []
        axes = {1, *(slot.axis for slot in family.slot)}
        self._own = {place.ref.index for one in axes for place in places(family.of_axis(one), link=True)}
        self._names_objects = rule is None or (rule.hexadecimal and not rule.index)
        self._listed: set[int] = set()
        self._flags: dict[int, Effect] = {}
        for index, one in listed:
            self._listed.add(index)
            if one.protected:
                self._flags[index] = _first(Effect(one.protected), self._flags.get(index))
        self._aliases: dict[int, list[Alias]] = {}
        for alias in aliases(family):
            self._aliases.setdefault(alias.ref.index, []).append(alias)
        self._process = {
            part
            for slot in family.slot
            for pdo in slot.rpdo
            for objects in pdo.objects
            for mapped in objects
            for part in mapped.parts
        }
        self._outputs = {output.object.index for output in family.output}
        self._errors = {
            ref.index for one in family.output for ref in (one.error_mode, one.error_value) if ref
        }

    def stands_for(self, address: ObjectRef) -> tuple[ObjectRef, ...]:
        """The communication objects that an object is another name of, or decides; what stands beside one
        under the same index is taken to be one, too."""
        beside = self._aliases.get(address.index, [])
        exact = [alias for alias in beside if alias.ref.sub == address.sub]
        return tuple(dict.fromkeys(ref for alias in exact or beside for ref in alias.objects))

    def effect(self, address: ObjectRef) -> Effect:
        """Effect of a write of an object. What stands beside a protected parameter under the same index is
        protected like it."""
        index = address.index
        if (
            self._read_only
            or address in self._process
            or index in self._outputs
            or any(index in span for span in self._commands)
        ):
            return Effect.COMMANDS
        if index in COMMUNICATION or self._aliases.get(index):
            return Effect.BUS
        own = Effect.SUPERVISES if index in self._own else None
        error = Effect.MAKES_SAFE if index in self._errors else None
        found = _first(own, error, self._flags.get(index), effect_of(index, self._profile))
        if found is Effect.SETTING and self._names_objects and index not in self._listed:
            return Effect.MAY_MOVE
        return found

    def level(self, address: ObjectRef) -> str:
        """Level needed to write an object, as clients are told (``Effect.level``)."""
        return self.effect(address).level

    def may_set(self, address: ObjectRef, *, is_engineer: bool) -> bool:
        """Whether an engineer, or somebody who is none, ever writes an object."""
        return judge(self.effect(address), is_engineer=is_engineer, is_moving=False) is WriteVerdict.WRITTEN

    def tells_own_supervision(self, address: ObjectRef) -> bool:
        """Whether an object says what the node does when the bridge falls silent."""
        return any(one.index in self._own for one in (address, *self.stands_for(address))) or (
            self._is_device and self.effect(address) is Effect.MAKES_SAFE
        )

    def why_not(self, entry: ParameterEntry, gate: Gate) -> Text | None:
        """Reason why this is not written by whom the gate lets in; None where it is."""
        effect = self.effect(entry.address)
        match judge(effect, is_engineer=gate.is_engineer, is_moving=gate.is_moving()):
            case WriteVerdict.WRITTEN:
                return None
            case WriteVerdict.NEVER:
                return self.why_never(entry)
            case WriteVerdict.NOT_AN_ENGINEER:
                return Text.of("protection.needs_engineer", what=self._what(entry, effect))
            case WriteVerdict.NOT_AT_REST if self._is_device:
                return Text.of("protection.output_active", parameter=entry.name)
            case WriteVerdict.NOT_AT_REST:
                return Text.of("protection.drive_enabled", parameter=entry.name)

    def why_never(self, entry: ParameterEntry) -> Text | None:
        """Reason why nobody writes it as a parameter; None where somebody may."""
        name, address, effect = entry.name, entry.address, self.effect(entry.address)
        if self._read_only:
            return Text.of("protection.device_read_only", parameter=name, why=self._read_only)
        if effect is Effect.BUS and (objects := self.stands_for(address)):
            refs = tuple(str(ref) for ref in objects)
            return Text.of("protection.stands_for", parameter=name, object=str(address), objects=refs)
        if effect is Effect.BUS:
            return Text.of("protection.communication", parameter=name)
        if effect is Effect.SHAPES:
            return Text.of("protection.shapes_outputs", parameter=name)
        if effect is not Effect.COMMANDS:
            return None
        if self._is_device:
            return Text.of("protection.commands_outputs", parameter=name)
        if address in self._process:
            return Text.of("protection.process_data", parameter=name)
        return Text.of("protection.commands_drive", parameter=name)

    def why_no_setting(self, entry: ParameterEntry) -> Text | None:
        """Reason why no parameter set holds it: a restore would move something. None where one may. What an
        RPDO can carry to a drive moves nothing while that is disabled, and a set is restored only then."""
        effect = self.effect(entry.address)
        if effect is Effect.MAY_MOVE and self._is_device:
            return Text.of("protection.in_no_set", parameter=entry.name)
        return self.why_never(entry)

    def why_forced(self, entry: ParameterEntry) -> Text | None:
        """Reason why the command line, which knows no roles, writes it with ``--force`` only, if at all. What
        may move a drive does so only while that is enabled, and then it is not written."""
        effect = self.effect(entry.address)
        if effect is Effect.MAY_MOVE and not self._is_device:
            return None
        verdict = judge(effect, is_engineer=False, is_moving=False)
        if verdict is WriteVerdict.NOT_AN_ENGINEER:
            return self._what(entry, effect)
        return self.why_never(entry)

    def _what(self, entry: ParameterEntry, effect: Effect) -> Text:
        if effect is Effect.SUPERVISES:
            return Text.of("protection.supervises", parameter=entry.name)
        if effect is Effect.MAKES_SAFE:
            return Text.of("protection.makes_safe", parameter=entry.name)
        return Text.of("protection.may_move", parameter=entry.name)


def _profile_of(family: Family) -> int | None:
    """The number of the device profile; None where nobody says it."""
    if family.family.profile is not None:
        return family.family.profile
    if family.slot:
        return _CIA_402
    return None if family.identity.device_type is None else family.identity.device_type & _PROFILE


def _first(*effects: Effect | None) -> Effect:
    """The strictest of those that there are."""
    return min((one for one in effects if one is not None), key=_ORDER.index, default=Effect.SETTING)
