"""Policy for reading and writing one drive's parameters, as procedures without a bus.

A procedure yields the transfers it needs and is sent what each brought and when; whoever runs it
carries them out on the SDO channel of the drive (``node.parameters``, or the command line).
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Final

from bridge.canopen import abort, width
from bridge.image import Value
from bridge.mapping.model import Family, ObjectRef
from bridge.parameter.codec import decode, encode_value, forms, matches, shown
from bridge.parameter.definition import ParameterEntry
from bridge.parameter.error import ParameterError, TransferFailed, Why
from bridge.parameter.ledger import Key, Ledger
from bridge.parameter.names import Names
from bridge.parameter.protection import Gate
from bridge.parameter.transfer import Transfer
from bridge.text import Said, Text

FRESH_S: Final = 1.0
"""A value that was read this long ago is what the drive holds: it is not read again before a write."""
_RAM_ONLY_FRESH_S: Final = 10.0
_SAVE: Final = b"save"
MISSING: Final = (abort.NO_OBJECT, abort.NO_SUB)
"""Abort codes: no such object, no such sub-index."""


@dataclass(frozen=True, slots=True)
class ParameterReading:
    """Value that a drive holds, and when it was asked, in monotonic seconds."""

    entry: ParameterEntry
    value: Value
    time: float

    def __str__(self) -> str:
        return f"{self.entry.name} = {shown(self.entry, self.value)}"


@dataclass(frozen=True, slots=True)
class ParameterWritten:
    """A value that the drive holds now, as it was read back. ``before`` is None where it was not read.
    ``changed`` is false where it was there already; ``warning`` is what the EEPROM guard has to say."""

    reading: ParameterReading
    before: Value | None
    changed: bool
    warning: Said = ""


Reads = Generator[Transfer, tuple[bytes, float], ParameterReading]
Writes = Generator[Transfer, tuple[bytes, float], ParameterWritten]
Saves = Generator[Transfer, tuple[bytes, float], Said]
"""Returns the guard's warning, or an empty text."""


class DriveParameters:
    """The parameters of the drive called ``name`` of the node ``node_name``; its cache and its counts.

    Every procedure raises ``ParameterError``; of ``TransferFailed``, which is thrown into it, it makes
    one. ``on_first`` is false for a drive behind another SDO channel than the node's first.
    """

    def __init__(
        self,
        name: str,
        node_name: str,
        family: Family,
        names: Names,
        ledger: Ledger,
        *,
        on_first: bool = True,
    ) -> None:
        self.name = name
        self.on_first = on_first
        self.names = names
        self._node_name = node_name
        self._eeprom = family.eeprom
        self._ledger = ledger
        self._cache: dict[ObjectRef, tuple[bytes, float]] = {}

    def forget(self) -> None:
        """The drive may have been switched off, or exchanged."""
        self._cache.clear()

    def cached(self, entry: ParameterEntry) -> ParameterReading | None:
        """Reading that was taken last."""
        held = self._cache.get(entry.address)
        return ParameterReading(entry, decode(entry, held[0]), held[1]) if held else None

    def held(self, entry: ParameterEntry) -> bytes | None:
        """The bytes that were last read."""
        held = self._cache.get(entry.address)
        return held[0] if held else None

    # reading

    def read(self, entry: ParameterEntry, now: float, max_age_s: float = 0.0) -> Reads:
        """The value, from the drive, or from the cache where it is not older than ``max_age_s``."""
        if entry.definition and not entry.definition.readable:
            raise ParameterError(Why.WRITE_ONLY, Text.of("parameter.write_only", parameter=entry.name))
        data, time = yield from self._fetch(entry, now, max_age_s)
        return ParameterReading(entry, decode(entry, data), time)

    def _fetch(
        self, entry: ParameterEntry, now: float, max_age_s: float
    ) -> Generator[Transfer, tuple[bytes, float], tuple[bytes, float]]:
        held = self._cache.get(entry.address)
        if held and now - held[1] < max_age_s:
            return held
        try:
            held = yield Transfer(entry.address, of_node=_is_of_node(entry))
        except TransferFailed as failure:
            raise self._error(entry, failure) from None
        self._cache[entry.address] = held
        return held

    def compare(
        self, entry: ParameterEntry, value: Value, now: float
    ) -> Generator[Transfer, tuple[bytes, float], tuple[ParameterReading, bool]]:
        """Reading of the drive, and whether it equals ``value``. Raises ``ParameterError`` also where it
        cannot hold ``value``."""
        held, time = yield from self._fetch(entry, now, FRESH_S)
        same = matches(entry, held, encode_value(entry, value, held))
        return ParameterReading(entry, decode(entry, held), time), same

    # writing

    def write(
        self, entry: ParameterEntry, value: Value, now: float, gate: Gate, expected: Value | None = None
    ) -> Writes:
        """Write ``value`` where the drive does not hold it yet, and read it back; a command is written and
        has been given when the drive answers. ``gate`` lets in what may be written. With ``expected`` nothing
        is written where the drive, asked just before, holds anything else, or cannot be asked."""
        self.check_writable(entry)
        self._pass(entry, gate)
        definition = entry.definition
        blind = definition is not None and (definition.command or not definition.readable)
        before: bytes | None = None
        if not blind:
            before, time = yield from self._fetch(entry, now, FRESH_S if expected is None else 0.0)
            now = max(now, time)
        if expected is not None:
            _check_expected(entry, expected, before)
        data = encode_value(entry, value, before)
        if before is not None and matches(entry, before, data):
            return ParameterWritten(
                ParameterReading(entry, _held(entry, before, value), now),
                decode(entry, before),
                changed=False,
            )
        wears = yield from self._wears(entry, now)
        key = (self._node_name if _is_of_node(entry) else self.name, str(entry.address))
        if wears:
            self._check(key, entry.name, now)
        if gate.asks is not None:
            yield from gate.asks([entry])
        self._cache.pop(entry.address, None)
        lost: TransferFailed | None = None
        try:
            now = yield from self._put(entry, data, before, gate)
        except TransferFailed as failure:
            if failure.by_drive or blind:
                raise self._error(entry, failure) from None
            lost = failure
        # Also where the answer was lost: it may have been written.
        warning = self._count(key, entry.name, now) if wears else ""
        if blind:
            return ParameterWritten(
                ParameterReading(entry, _held(entry, data, value), now), None, True, warning
            )
        try:
            held, now = yield from self._fetch(entry, now, 0.0)
        except ParameterError as error:
            said = Text.of("parameter.may_be_written", why=error.said)
            raise ParameterError(error.why, said, error.abort_code) from None
        if not matches(entry, held, data):
            if lost:
                raise self._error(entry, lost)
            found = shown(entry, decode(entry, held))
            said = Text.of("parameter.holds_other", parameter=entry.name, value=found)
            raise ParameterError(Why.NOT_TAKEN, said)
        was = None if before is None else decode(entry, before)
        return ParameterWritten(ParameterReading(entry, _held(entry, held, value), now), was, True, warning)

    def _put(
        self, entry: ParameterEntry, data: bytes, before: bytes | None, gate: Gate
    ) -> Generator[Transfer, tuple[bytes, float], float]:
        """Write ``data`` in the width in which the drive takes it; when that was, in monotonic seconds."""
        refused: TransferFailed | None = None
        for form in forms(entry, data, before):
            try:
                _, now = yield self._transfer(entry, form, gate, of_node=_is_of_node(entry))
            except TransferFailed as failure:
                refused = failure
                if not failure.by_drive or not width.may_mean_width(failure.abort_code):
                    raise
            else:
                return now
        raise refused or AssertionError("there is one form at least")

    def check_writable(self, entry: ParameterEntry) -> None:
        """Raises ``ParameterError`` for what nobody writes by this way."""
        if entry.definition and not entry.definition.writable:
            raise ParameterError(Why.READ_ONLY, Text.of("parameter.read_only", parameter=entry.name))
        why = self.names.protection.why_never(entry)
        if why:
            raise ParameterError(Why.PROTECTED, why)

    def _pass(self, entry: ParameterEntry, gate: Gate) -> None:
        """Raises ``ParameterError`` where the gate does not let it in."""
        if why := self.names.protection.why_not(entry, gate):
            raise ParameterError(Why.PROTECTED, why)

    def _transfer(self, entry: ParameterEntry, data: bytes, gate: Gate, *, of_node: bool) -> Transfer:
        """A write, which passes the gate once more when its turn has come."""

        def why_not() -> Text | None:
            return self.names.protection.why_not(entry, gate)

        return Transfer(entry.address, data, of_node, why_not)

    # the EEPROM

    @property
    def saving(self) -> ParameterEntry | None:
        """Entry to be written when the parameters are saved; None where the family has no such command."""
        eeprom = self._eeprom
        if eeprom is None or not eeprom.can_save:
            return None
        if eeprom.save_command is not None:
            return self.names.resolve(eeprom.save_command.parameter)
        return None if eeprom.save is None else ParameterEntry("save", eeprom.save)

    def save(self, now: float, gate: Gate) -> Saves:
        """The parameters of the node go to its EEPROM. What the gate lets in is judged by the parameter that
        the family saves by; 1010h does nothing but save, and a node need not have it: that is
        ``Why.NOT_CONFIGURED``, as a family without a command is."""
        entry, eeprom = self.saving, self._eeprom
        if entry is None or eeprom is None:
            raise ParameterError(Why.NOT_CONFIGURED, Text.of("parameter.no_save", drive=self.name))
        command = eeprom.save_command
        data = _SAVE if command is None else encode_value(entry, command.value, None)
        key = (self._node_name, str(entry.address))
        if command is not None:
            self._pass(entry, gate)
        self._check(key, entry.name, now)
        if gate.asks is not None:
            yield from gate.asks([entry])
        try:
            if command is None:
                _, now = yield Transfer(entry.address, data, of_node=True)
            else:
                _, now = yield self._transfer(entry, data, gate, of_node=True)
        except TransferFailed as failure:
            if not failure.by_drive:
                self._count(key, entry.name, now)
            if command is None and failure.abort_code in MISSING:
                lack = Text.of("parameter.no_save_object", object=_address(entry))
                raise ParameterError(Why.NOT_CONFIGURED, lack, failure.abort_code) from None
            raise self._error(entry, failure) from None
        return self._count(key, entry.name, now)

    def writes(self, entry: ParameterEntry) -> int:
        """Number of known EEPROM writes of this parameter."""
        owner = self._node_name if _is_of_node(entry) else self.name
        return self._ledger.writes((owner, str(entry.address)))

    def keeps_in_ram(self, entry: ParameterEntry) -> bool:
        """Whether what is written is lost at power-off because of the family's switch, as last read."""
        switch, reading = self.ram_switch, None
        if switch is not None and not (entry.definition and entry.definition.volatile):
            reading = self.cached(switch)
        return reading is not None and self.means_ram(reading.value)

    @property
    def ram_switch(self) -> ParameterEntry | None:
        """The parameter that keeps writes out of the EEPROM, where the family has one."""
        ram_only = self._eeprom.ram_only if self._eeprom else None
        return self.names.resolve(ram_only.parameter) if ram_only else None

    def means_ram(self, value: Value) -> bool:
        """Whether ``value`` of ``ram_switch``, a number or the text of a state, keeps writes in the RAM."""
        switch, eeprom = self.ram_switch, self._eeprom
        if switch is None or eeprom is None or eeprom.ram_only is None:
            return False
        return decode(switch, encode_value(switch, value, None)) == eeprom.ram_only.value

    def _check(self, key: Key, name: str, now: float) -> None:
        self._ledger.check(key, name, now, self._eeprom.cycles if self._eeprom else None)

    def _count(self, key: Key, name: str, now: float) -> Said:
        return self._ledger.count(key, name, self._eeprom.cycles if self._eeprom else None, now)

    def _wears(self, entry: ParameterEntry, now: float) -> Generator[Transfer, tuple[bytes, float], bool]:
        """Whether writing it goes to the EEPROM. Where that cannot be read it is taken to."""
        eeprom = self._eeprom
        if eeprom is None or eeprom.written_on_save_only or (entry.definition and entry.definition.volatile):
            return False
        if eeprom.ram_only is None:
            return True
        switch = self.names.resolve(eeprom.ram_only.parameter)
        if switch.address == entry.address:
            return True
        try:
            data, _ = yield from self._fetch(switch, now, _RAM_ONLY_FRESH_S)
            return decode(switch, data) != eeprom.ram_only.value
        except ParameterError:
            return True

    def _error(self, entry: ParameterEntry, failure: TransferFailed) -> ParameterError:
        said = Text.of("parameter.of", owner=entry.name, what=failure.said)
        if failure.abort_code in MISSING and not entry.definition:
            hints = (*self.names.hints(entry.name), *self.names.set_hints(entry.name))
            said = Text.of("parameter.of_advised", owner=entry.name, what=failure.said, hints=hints)
        why = Why.REFUSED if failure.by_drive else Why.NO_ANSWER
        return ParameterError(why, said, failure.abort_code)


def _check_expected(entry: ParameterEntry, expected: Value, held: bytes | None) -> None:
    if held is None:
        said = Text.of("parameter.expected_unread", parameter=entry.name)
        raise ParameterError(Why.WRITE_ONLY, said)
    if not matches(entry, held, encode_value(entry, expected, held)):
        found = shown(entry, decode(entry, held))
        said = Text.of("parameter.not_expected", parameter=entry.name, value=found)
        raise ParameterError(Why.OTHER_VALUE, said)


def _address(entry: ParameterEntry) -> str:
    return f"{entry.address.index:04X}h:{entry.address.sub:02X}"


def _is_of_node(entry: ParameterEntry) -> bool:
    return entry.definition is not None and entry.definition.of_node


def _held(entry: ParameterEntry, data: bytes, written: Value) -> Value:
    """Value in ``data``; of an object that no file describes with the sign that was written."""
    negative = entry.definition is None and not isinstance(written, str) and written < 0
    return written if negative else decode(entry, data)
