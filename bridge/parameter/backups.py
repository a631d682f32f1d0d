"""Backups of a drive's parameters: made, compared with a drive, written back. Procedures without a bus.

A backup holds every parameter of the mapping file that can be read and written, each element in each
parameter set, and beside them what is found where the family keeps its settings. It is restored in the order
of the mapping file, what that does not list after it, and only where the drive differs. What is interrupted
goes on where it was when it is begun again with what it has filled so far.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

from bridge.canopen import abort
from bridge.image import Value
from bridge.mapping.model import ObjectRef
from bridge.parameter.access import MISSING, DriveParameters, ParameterWritten
from bridge.parameter.backup_file import IDENTITY
from bridge.parameter.codec import encode_value
from bridge.parameter.definition import ParameterEntry
from bridge.parameter.error import ParameterError, TransferFailed, Why
from bridge.parameter.names import Names
from bridge.parameter.protection import Gate
from bridge.parameter.transfer import Transfer
from bridge.parameter.write_effect import Effect
from bridge.text import Text

_MOVING: Final = (Effect.COMMANDS, Effect.MAY_MOVE)
_NO_VALUE: Final = "is neither a number nor a text"
_READ_ONLY: Final = (0x0601_0000, 0x0601_0002)
"""Abort codes: no such access, read-only."""
_SUBS: Final = 0xFF
"""Sub-index FFh is the object's structure (CiA 301 §7.4.3)."""


@dataclass(frozen=True, slots=True)
class Difference:
    """Value that a drive holds beside the set's value for it."""

    entry: ParameterEntry
    in_drive: Value
    in_set: Value


@dataclass(slots=True)
class Backup:
    """The values by name; ``missing`` are those that this drive does not have, ``unreadable`` has why others
    were not read. ``objects`` are values that the mapping file does not list."""

    values: dict[str, Value] = field(default_factory=dict[str, Value])
    missing: list[str] = field(default_factory=list[str])
    objects: dict[str, Value] = field(default_factory=dict[str, Value])
    unreadable: dict[str, str] = field(default_factory=dict[str, str])
    identity: dict[str, int] = field(default_factory=dict[str, int])
    indices_done: int = 0
    """Number of finished entries of ``Names.settings``."""
    silent: set[str] = field(default_factory=set[str])
    """Names for which the drive once did not answer."""
    answers: int = 0
    """Number of answers of the drive, refusals included."""


@dataclass(slots=True)
class Comparison:
    same: list[str] = field(default_factory=list[str])
    differences: list[Difference] = field(default_factory=list[Difference])
    missing: list[str] = field(default_factory=list[str])


@dataclass(slots=True)
class Restored:
    """``failed`` is the name at which it ended with ``error``; ``left`` are those not come to."""

    written: list[ParameterWritten] = field(default_factory=list[ParameterWritten])
    same: list[str] = field(default_factory=list[str])
    missing: list[str] = field(default_factory=list[str])
    read_only: list[str] = field(default_factory=list[str])
    """Objects that no file describes and the drive does not take: what a scan finds may be actual values."""
    failed: str = ""
    error: ParameterError | None = None
    left: list[str] = field(default_factory=list[str])
    warning: str = ""


Steps = Generator[Transfer, tuple[bytes, float], None]


def settings(names: Names, *, on_first: bool = True) -> list[ParameterEntry]:
    """Entries that belong into a set, in the order of the mapping file; the node's own parameters are in the
    set of the drive on its first SDO channel."""
    return [one for one in _set(names, on_first) if not names.protection.why_no_setting(one)]


def left_out(names: Names, *, on_first: bool = True) -> dict[str, str]:
    """Reasons by name, for what could be set and belongs into no set, because it moves something or may."""
    return {
        one.name: str(why)
        for one in _set(names, on_first)
        if names.protection.effect(one.address) in _MOVING and (why := names.protection.why_no_setting(one))
    }


def _set(names: Names, on_first: bool) -> Iterator[ParameterEntry]:
    for entry in names.entries():
        one = entry.definition
        if one and one.readable and one.writable and one.backup and (on_first or not one.of_node):
            yield entry


def in_order(names: Names, values: Mapping[str, Value]) -> list[tuple[ParameterEntry, Value]]:
    """The entries of a set in the order of the mapping file, then those that it does not list.

    Raises ``ParameterError`` for a name that the family does not have, for what no set holds and for two
    names of one parameter, before anything is done.
    """
    places = {entry.address: place for place, entry in enumerate(settings(names))}
    seen: dict[ObjectRef, str] = {}
    found = [(_fitting(names, name, seen), value) for name, value in values.items()]
    return sorted(found, key=lambda pair: places.get(pair[0].address, len(places)))


def misfits(names: Names, values: Mapping[str, Value]) -> Iterator[tuple[str, ParameterError]]:
    """Everything in a set that the family cannot have, by its name in the set: what ``in_order`` refuses, and
    values that a parameter does not take."""
    seen: dict[ObjectRef, str] = {}
    for name, value in values.items():
        try:
            entry = _fitting(names, name, seen)
            _check_moves_nothing(names, entry)
            if entry.definition is not None:  # of others only the drive knows how long they are
                encode_value(entry, value, None)
        except ParameterError as error:
            yield name, error


def _fitting(names: Names, name: str, seen: dict[ObjectRef, str]) -> ParameterEntry:
    """Entry that ``name`` means in a set that already has ``seen``. Raises ``ParameterError``."""
    entry = names.resolve(name)
    other = seen.setdefault(entry.address, name)
    if other != name:
        raise ParameterError(Why.OUT_OF_RANGE, Text.of("parameter_set.twice", other=other, name=name))
    if entry.definition and not entry.definition.backup:
        raise ParameterError(Why.PROTECTED, Text.of("parameter_set.no_setting", name=name))
    return entry


def _check_moves_nothing(names: Names, entry: ParameterEntry) -> None:
    """Raises ``ParameterError`` for what no set holds because it moves something."""
    if names.protection.effect(entry.address) in _MOVING and (why := names.protection.why_no_setting(entry)):
        raise ParameterError(Why.PROTECTED, Text.of("parameter_set.moves", why=why))


def back_up(access: DriveParameters, into: Backup, now: float) -> Steps:
    """Read every setting into ``into`` that is not there yet. Raises ``ParameterError`` where the drive does
    not answer; what it refuses costs that value alone."""
    for entry in settings(access.names, on_first=access.on_first):
        if entry.name in into.values or entry.name in into.missing or entry.name in into.unreadable:
            continue
        try:
            reading = yield from access.read(entry, now)
        except ParameterError as error:
            why = _refusal(entry, error, into)
            if error.abort_code in MISSING:
                into.missing.append(entry.name)
            else:
                into.unreadable[entry.name] = why
            continue
        now = reading.time
        into.answers += 1
        into.values[entry.name] = reading.value


def scan(access: DriveParameters, into: Backup, now: float) -> Steps:
    """Read what is found where the family keeps its settings and the mapping file does not list. Raises
    ``ParameterError`` where the drive does not answer."""
    for index in access.names.settings[into.indices_done :]:
        found = yield from _scan_object(access, index, into, now)
        into.objects |= found.objects
        into.unreadable |= found.unreadable
        into.indices_done += 1


def read_objects(access: DriveParameters, addresses: Iterable[ObjectRef], into: Backup, now: float) -> Steps:
    """Read those of these objects that the mapping file does not list and ``into`` does not have yet. Raises
    ``ParameterError`` where the drive does not answer."""
    for address in addresses:
        entry = access.names.at(address)
        known = (into.objects, into.missing, into.unreadable)
        if entry.definition is not None or any(entry.name in names for names in known):
            continue
        if access.names.protection.why_no_setting(entry):
            continue
        try:
            reading = yield from access.read(entry, now)
            _, is_told = yield from access.compare(entry, reading.value, reading.time)
        except ParameterError as error:
            why = _refusal(entry, error, into)
            if error.abort_code in MISSING:
                into.missing.append(entry.name)
            else:
                into.unreadable[entry.name] = why
            continue
        now = reading.time
        into.answers += 1
        if is_told:
            into.objects[entry.name] = reading.value
        else:
            into.unreadable[entry.name] = _NO_VALUE


def _scan_object(
    access: DriveParameters, index: int, into: Backup, now: float
) -> Generator[Transfer, tuple[bytes, float], Backup]:
    """Every sub-index of one object. Where there are others, the first is their number (CiA 301 §7.4.3)."""
    names, found, gap, has_subs = access.names, Backup(), 0, False
    first = ""
    for sub in range(_SUBS):
        entry = names.at(ObjectRef(index, sub))
        try:
            reading = yield from access.read(entry, now)
            _, is_told = yield from access.compare(entry, reading.value, reading.time)
        except ParameterError as error:
            why = _refusal(entry, error, into)
            if error.abort_code == abort.NO_OBJECT:
                break
            if error.abort_code not in MISSING:
                found.unreadable[entry.name] = why
            gap += 1
            if gap > names.widest_gap:
                break
            continue
        into.answers += 1
        gap, has_subs = 0, has_subs or sub > 0
        first = first if sub else entry.name
        if entry.definition is not None or names.protection.why_no_setting(entry):
            continue
        if is_told:
            found.objects[entry.name] = reading.value
        else:
            found.unreadable[entry.name] = _NO_VALUE
    if has_subs:
        found.objects.pop(first, None)
        found.unreadable.pop(first, None)
    return found


def identify(into: dict[str, int]) -> Steps:
    """Read the node's identity (1018h). Raises ``ParameterError`` where it does not answer, and where it says
    something else than ``into`` has."""
    found: dict[str, int] = {}
    for sub, name in enumerate(IDENTITY, 1):
        try:
            data, _ = yield Transfer(ObjectRef(0x1018, sub), of_node=True)
        except TransferFailed as failure:
            if not failure.by_drive:
                said = Text.of("parameter_set.identity", why=failure.said)
                raise ParameterError(Why.NO_ANSWER, said) from None
            continue
        found[name] = int.from_bytes(data[:4], "little")
    if into and into != found:
        raise ParameterError(Why.NOT_CONFIGURED, Text.of("parameter_set.other_device"))
    into |= found


def _refusal(entry: ParameterEntry, error: ParameterError, into: Backup) -> str:
    """Reason why a value was not read, in words. Raises ``error`` again where the drive has not answered at
    all, but for what it was silent about before: whoever begins again has seen that it answers."""
    if error.why is Why.NO_ANSWER:
        if entry.name not in into.silent:
            into.silent.add(entry.name)
            raise error
        return "no answer, twice"
    into.answers += 1
    code = error.abort_code
    return f"{abort.text(code)} ({code:08X}h)" if code and error.why is Why.REFUSED else str(error)


def compare(
    access: DriveParameters,
    values: Mapping[str, Value],
    into: Comparison,
    now: float,
) -> Steps:
    """Compare a set with the drive. Raises ``ParameterError``."""
    for entry, value in in_order(access.names, values):
        try:
            reading, same = yield from access.compare(entry, value, now)
        except ParameterError as error:
            if error.abort_code not in MISSING:
                raise
            into.missing.append(entry.name)
            continue
        now = reading.time
        if same:
            into.same.append(entry.name)
        else:
            into.differences.append(Difference(entry, reading.value, value))


def compare_sets(
    names: Names, values: Mapping[str, Value], wanted: Mapping[str, Value], into: Comparison
) -> None:
    """Compare ``wanted`` with ``values``, which stand for the drive. Raises ``ParameterError``."""
    held = {entry.address: value for entry, value in in_order(names, values)}
    for entry, value in in_order(names, wanted):
        if entry.address not in held:
            into.missing.append(entry.name)
        elif _is_same(entry, held[entry.address], value):
            into.same.append(entry.name)
        else:
            into.differences.append(Difference(entry, held[entry.address], value))


def _is_same(entry: ParameterEntry, one: Value, other: Value) -> bool:
    if entry.definition is None:
        return one == other
    return encode_value(entry, one, None) == encode_value(entry, other, None)


def restore(
    access: DriveParameters,
    values: Mapping[str, Value],
    into: Restored,
    now: float,
    gate: Gate,
) -> Steps:
    """Write a set where the drive differs; every write is read back, and the first refusal ends it.
    ``gate`` is that of ``DriveParameters.write``. It may be done again with the same ``into``.

    Raises ``ParameterError`` only for a set that does not fit, before anything is written.
    """
    wanted = _checked(access, values)
    ours = {one.reading.entry.address for one in into.written}
    into.same, into.missing, into.read_only, into.left = [], [], [], []
    into.failed, into.error = "", None
    for place, (entry, value) in enumerate(wanted):
        try:
            written = yield from access.write(entry, value, now, gate)
        except ParameterError as error:
            if error.abort_code in MISSING:
                into.missing.append(entry.name)
                continue
            if error.abort_code in _READ_ONLY and entry.definition is None:
                into.read_only.append(entry.name)
                continue
            into.failed, into.error = entry.name, error
            into.left = [later.name for later, _ in wanted[place + 1 :]]
            return
        now = written.reading.time
        if written.changed:
            into.written.append(written)
            if access.keeps_in_ram(entry):
                into.warning = _in_ram(access)
        elif entry.address not in ours:
            into.same.append(entry.name)


def _checked(access: DriveParameters, values: Mapping[str, Value]) -> list[tuple[ParameterEntry, Value]]:
    """The set in the order in which it is written. The switch of the EEPROM comes first where what follows
    is to be kept, and last where it is not. Raises ``ParameterError`` with all that cannot be written."""
    wanted = in_order(access.names, values)
    refused: list[ParameterError] = []
    for entry, value in wanted:
        try:
            _check_moves_nothing(access.names, entry)
            access.check_writable(entry)
            if entry.definition is not None:  # of others only the drive knows how long they are
                encode_value(entry, value, None)
        except ParameterError as error:
            refused.append(error)
    if refused:
        reasons = tuple(one.said for one in refused)
        raise ParameterError(refused[0].why, Text.of("parameter_set.refused", reasons=reasons))
    switch = access.ram_switch

    def place(pair: tuple[ParameterEntry, Value]) -> int:
        if switch is None or pair[0].address != switch.address:
            return 0
        return 1 if access.means_ram(pair[1]) else -1

    return sorted(wanted, key=place)


def _in_ram(access: DriveParameters) -> str:
    switch = access.ram_switch
    name = switch.name if switch else ""
    return (
        f"the drive keeps changes in its RAM alone ({name}): what was written is lost when it is switched off"
    )
