"""Backups of a drive's parameters: made, compared with a drive, written back. Procedures without a bus.

A backup holds every parameter of the mapping file that can be read and written, each element in each
parameter set. It is restored in the order of the mapping file, and only where the drive differs.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass, field

from bridge.image import Value
from bridge.mapping.model import ObjectRef
from bridge.parameter.access import MISSING, Asks, DriveParameters, Transfer, Written
from bridge.parameter.codec import encode_value
from bridge.parameter.definition import Entry
from bridge.parameter.error import ParameterError, Why
from bridge.parameter.names import Names


@dataclass(frozen=True, slots=True)
class Difference:
    """What a drive holds, and what the set has for it."""

    entry: Entry
    in_drive: Value
    in_set: Value


@dataclass(slots=True)
class Backup:
    """The values by name; ``missing`` are those that this drive does not have."""

    values: dict[str, Value] = field(default_factory=dict[str, Value])
    missing: list[str] = field(default_factory=list[str])


@dataclass(slots=True)
class Comparison:
    same: list[str] = field(default_factory=list[str])
    differences: list[Difference] = field(default_factory=list[Difference])
    missing: list[str] = field(default_factory=list[str])


@dataclass(slots=True)
class Restored:
    """``failed`` is the name at which it ended with ``error``; ``left`` are those not come to."""

    written: list[Written] = field(default_factory=list[Written])
    same: list[str] = field(default_factory=list[str])
    missing: list[str] = field(default_factory=list[str])
    failed: str = ""
    error: ParameterError | None = None
    left: list[str] = field(default_factory=list[str])
    warning: str = ""


Steps = Generator[Transfer, tuple[bytes, float], None]


def settings(names: Names, *, on_first: bool = True) -> list[Entry]:
    """What belongs into a set, in the order of the mapping file; the node's own parameters are in the set
    of the drive on its first SDO channel."""
    return [
        entry
        for entry in names.entries()
        if entry.definition
        and entry.definition.readable
        and entry.definition.writable
        and entry.definition.backup
        and (on_first or not entry.definition.of_node)
        and not names.protection.why_never(entry)
    ]


def in_order(names: Names, values: Mapping[str, Value]) -> list[tuple[Entry, Value]]:
    """The entries of a set in the order of the mapping file, then those that it does not list.

    Raises ``ParameterError`` for a name that the family does not have, for what no set holds and for two
    names of one parameter, before anything is done.
    """
    places = {entry.address: place for place, entry in enumerate(settings(names))}
    found = [(names.resolve(name), value) for name, value in values.items()]
    seen: dict[ObjectRef, str] = {}
    for name, (entry, _) in zip(values, found, strict=True):
        if entry.address in seen:
            other = seen[entry.address]
            raise ParameterError(
                Why.OUT_OF_RANGE, f"{other} and {name} are the same parameter: leave one of them out"
            )
        seen[entry.address] = name
        if entry.definition and not entry.definition.backup:
            raise ParameterError(
                Why.PROTECTED,
                f"{name} is an address, an identity or a command, and no set holds it: remove it, and write "
                "it by itself where it is to be changed",
            )
    return sorted(found, key=lambda pair: places.get(pair[0].address, len(places)))


def back_up(access: DriveParameters, into: Backup, now: float) -> Steps:
    """Read every setting into ``into``. Raises ``ParameterError`` where one cannot be read."""
    for entry in settings(access.names, on_first=access.on_first):
        try:
            reading = yield from access.read(entry, now)
        except ParameterError as error:
            if error.abort_code not in MISSING:
                raise
            into.missing.append(entry.name)
            continue
        now = reading.time
        into.values[entry.name] = reading.value


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


def restore(
    access: DriveParameters,
    values: Mapping[str, Value],
    into: Restored,
    now: float,
    before_it: Asks | None = None,
) -> Steps:
    """Write a set where the drive differs; every write is read back, and the first refusal ends it.
    ``before_it`` is that of ``DriveParameters.write``.

    Raises ``ParameterError`` only for a set that does not fit, before anything is written.
    """
    wanted = _checked(access, values)
    for place, (entry, value) in enumerate(wanted):
        try:
            written = yield from access.write(entry, value, now, before_it=before_it)
        except ParameterError as error:
            if error.abort_code in MISSING:
                into.missing.append(entry.name)
                continue
            into.failed, into.error = entry.name, error
            into.left = [later.name for later, _ in wanted[place + 1 :]]
            return
        now = written.reading.time
        if written.changed:
            into.written.append(written)
            if access.keeps_in_ram(entry):
                into.warning = _in_ram(access)
        else:
            into.same.append(entry.name)


def _checked(access: DriveParameters, values: Mapping[str, Value]) -> list[tuple[Entry, Value]]:
    """The set in the order in which it is written. The switch of the EEPROM comes first where what follows
    is to be kept, and last where it is not. Raises ``ParameterError`` with all that cannot be written."""
    wanted = in_order(access.names, values)
    refused: list[ParameterError] = []
    for entry, value in wanted:
        try:
            access.check_writable(entry)
            if entry.definition is not None:  # of others only the drive knows how long they are
                encode_value(entry, value, None)
        except ParameterError as error:
            refused.append(error)
    if refused:
        raise ParameterError(refused[0].why, "; ".join(map(str, refused)))
    switch = access.ram_switch

    def place(pair: tuple[Entry, Value]) -> int:
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
