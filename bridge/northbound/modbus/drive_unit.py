"""One drive as a Modbus unit: its registers read, and its writes as requests.

Which quality is served how: input registers 0 … 9, the scaled actual values and the discrete inputs of
the status word are the drive's data. While the drive's quality is waiting, dead or disabled a read that
touches one of them is answered 0Bh, with config_error 0Ah. Registers 10 … 31 and the discrete inputs of the
quality are what the bridge knows: a read wholly within them always succeeds, so that a control program can
see *why*. A read of 0 … 31 therefore fails while there is no data, a read of 10 … 31 does not.

While the drive has data, a value from register 32 on that is not there (its scale is not known, its own TPDO
never came, it was not read yet) reads as 0 within a longer request; registers 22 and 23 and the discrete
inputs from 4096 on say so. A request for nothing but such values is refused with the exception of the first.

Ranges: 02h where a range leaves the map, begins or ends within a 32-bit value (read or write), or a
write touches what is not writable, or more than one parameter. Gaps inside the first 32 registers read
as 0. Setpoint words the drive does not have, and register 9 within a longer write, take 0; anything
else is 03h. A range of nothing but words that the drive does not have is 02h, of words that its node does
not carry 0Ah, of words whose own TPDO never came 0Bh; within a longer range they read as 0 and take 0, and
register 21 says so.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Final

from bridge.command import Action, Do, Identity, Request, SetTimeout, Source, Write, WriteParameter
from bridge.image import Quality, Value
from bridge.northbound.modbus.pdu import ExceptionCode, MaskWrite, ModbusException
from bridge.northbound.modbus.registers import (
    ABORT_CODE,
    ACKNOWLEDGE,
    DIAGNOSTICS,
    KEEP_ALIVE,
    LIFE_SIGN,
    PARAMETERS,
    PROCESS_WORDS,
    QUALITY_BITS,
    STOP,
    TIMEOUT,
    TOKEN,
    VALUE_FLAGS,
    VALUES,
    WORDS_NOT_GOOD,
    DriveMap,
    RegisterTable,
    Row,
    Words32,
)
from bridge.northbound.modbus.unit import Unit, refuse_quality, state_code
from bridge.northbound.modbus.values32 import Values32
from bridge.northbound.view import View

_WORD_BITS: Final = 16
_FLAGS: Final = 32  # 32-bit values that have a bit in registers 22 and 23
_RESERVED: Final = 9  # between the setpoints and the keep-alive, so that one write can reach both
_DIAGNOSTICS: Final = (
    "status/state",
    "status/emcy_code",
    "supervision/last_fault",
    "supervision/watchdog_state",
    "supervision/watchdog_left_ms",
    "supervision/pdo_age_ms",
    ABORT_CODE,
    "supervision/owner",
    "supervision/telegrams",
)
_IDENTITY: Final = ("vendor", "product", "revision", "serial", "device_name")
_SOURCES: Final = {source.label: source for source in Source}
_STOPS: Final = {1: Action.STOP, 2: Action.QUICK_STOP, 3: Action.DISABLE_VOLTAGE}


class DriveUnit(Unit):
    """One drive's unit id."""

    def __init__(self, drive_map: DriveMap, view: View, words32: Words32) -> None:
        self._map = drive_map
        self._view = view
        self._image = view.image
        self._words32 = words32

        def place(leaf: str) -> int:
            return view.image.index[f"{drive_map.drive_name}/{leaf}"]

        def values(rows: Sequence[Row], first: int = VALUES) -> Values32:
            return Values32(rows, drive_map.drive_name, view.image, words32, first)

        self._status: Final = place("status/status_word")
        self._words: Final = {
            table: {address: place(leaf) for address, leaf in words.items()}
            for table, words in drive_map.words.items()
        }
        self._data: Final = {
            0: self._status,
            **self._words[RegisterTable.INPUT_REGISTER],
            _RESERVED: place("status/drive_status_word"),
        }
        self._diagnostics: Final = [place(leaf) for leaf in _DIAGNOSTICS]
        self._commands: Final = {
            0: place("command/control_word"),
            **self._words[RegisterTable.HOLDING_REGISTER],
        }
        self._token = place("supervision/life_sign") if drive_map.has_life_sign else None
        self._brought = place("command/life_sign") if drive_map.has_life_sign else None
        self._last_command: Final = LIFE_SIGN if drive_map.has_life_sign else STOP
        self._owner, self._timeout = place("supervision/owner"), place("supervision/fieldbus_timeout_ms")
        self._identity: Final = [place(f"identity/{leaf}") for leaf in _IDENTITY]
        self._inputs: Final = values(drive_map.inputs)
        self._drives_own: Final = [row.address for row in drive_map.inputs if _is_drives_own(row)]
        self._flagged: Final = self._inputs.indices[:_FLAGS]
        self._setpoints: Final = values(drive_map.setpoints)
        self._parameters: Final = values(drive_map.parameters, PARAMETERS)
        self._halves: Final = {table: drive_map.second_halves(table) for table in RegisterTable}

    # reading

    def _look(self) -> Quality:
        """The quality of the drive's data; its points are true at this moment."""
        self._view.look(self._map.drive_name)
        return self._image[self._status].quality

    def read_bits(self, table: RegisterTable, start: int, count: int) -> Sequence[bool]:
        first = 0
        if table is RegisterTable.COIL:
            bits, quality = _bits(self._control_word), Quality.GOOD
        elif start >= VALUE_FLAGS:
            self._look()
            first, bits, quality = VALUE_FLAGS, self._inputs.not_good(), Quality.GOOD
        else:
            quality = self._look()
            bits = _bits(int(self._image[self._status].value)) + [quality is each for each in Quality]
        if start - first + count > len(bits):
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)
        if start < QUALITY_BITS:
            refuse_quality(quality)
        return bits[start - first : start - first + count]

    def read_words(self, table: RegisterTable, start: int, count: int, caller: Identity) -> Sequence[int]:
        is_input = table is RegisterTable.INPUT_REGISTER
        end = start + count
        self._check_range(table, start, end)
        if start >= PARAMETERS and not is_input:
            return self._parameters.read(start, end)
        if is_input:
            quality = self._look()
            if quality.has_value:
                self._check_words(table, start, end)
            words = self._input_words(start, end, quality)
            if any(start <= address < end for address in self._drives_own):
                refuse_quality(quality)
            words += self._inputs.read(start, end, beside=start < VALUES)
        else:
            self._check_words(table, start, end)
            words = self._holding_words(caller)[start:end] if start < VALUES else []
            words += self._setpoints.read(start, end, beside=start < VALUES)
        return words

    def _check_range(self, table: RegisterTable, start: int, end: int) -> None:
        halves = self._halves[table]
        if end > self._map.end(table, start) or start in halves or end in halves:
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)

    def _check_words(self, table: RegisterTable, start: int, end: int) -> None:
        """Refuse a range in which no word is available: not in the drive, not mapped, or not received yet."""
        if not start or end > PROCESS_WORDS + 1:
            return
        words = self._words[table]
        qualities = self._image.qualities(words[address] for address in range(start, end) if address in words)
        if not qualities:
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)
        if not any(quality.has_value for quality in qualities):
            refuse_quality(qualities[0])

    def _input_words(self, start: int, end: int, quality: Quality) -> list[int]:
        """Words of the input registers 0 … 31 that are in the range."""
        words: list[int] = []
        if start < DIAGNOSTICS:
            refuse_quality(quality)
            words = self._data_words()[start:end]
        if start < VALUES and end > DIAGNOSTICS:
            words += self._diagnostic_words(quality, end)[max(start - DIAGNOSTICS, 0) : end - DIAGNOSTICS]
        return words

    def _data_words(self) -> list[int]:
        """Input registers 0 … 9."""
        words = [0] * DIAGNOSTICS
        values = self._image.values(self._data.values())
        qualities = self._image.qualities(self._data.values())
        for address, value, quality in zip(self._data, values, qualities, strict=True):
            if quality.has_value:  # otherwise what it was before the node restarted, which says nothing
                words[address] = int(value)
        return words

    def _diagnostic_words(self, quality: Quality, end: int) -> list[int]:
        """Input registers 10 … 31; the expensive ones only up to ``end``."""
        from_int = self._words32.from_int
        values = self._image.values(self._diagnostics)
        state, emcy, fault, watchdog, left_ms, age_ms, abort_code, owner, telegrams = values
        words = [
            state_code(state, watchdog, quality),
            quality,
            int(emcy),
            min(round(float(fault) * 10), 0xFFFF),
            int(watchdog),
            int(left_ms),
            *from_int(int(age_ms)),
            *from_int(int(abort_code)),
            _SOURCES.get(str(owner).partition(":")[0], Source.NONE),
        ]
        if end > WORDS_NOT_GOOD:
            # A word that the drive does not have is no bad one.
            places = self._words[RegisterTable.INPUT_REGISTER]
            words.append(self._not_good((place - 1 for place in places), places.values()))
            words += from_int(self._not_good(range(_FLAGS), self._flagged))
            words.append(int(telegrams))
        if end > TOKEN and self._token is not None:
            words += 0, int(self._image[self._token].value)
        return words + [0] * (VALUES - DIAGNOSTICS - len(words))

    def _not_good(self, bits: Iterable[int], indices: Iterable[int]) -> int:
        """The bits of those points that are not good."""
        qualities = self._image.qualities(indices)
        return sum(1 << bit for bit, one in zip(bits, qualities, strict=False) if one is not Quality.GOOD)

    @property
    def _control_word(self) -> int:
        return int(self._image[self._commands[0]].value)

    def _holding_words(self, caller: Identity) -> list[int]:
        """Holding registers 0 … 31: what the owner wrote."""
        words = [0] * VALUES
        for address, value in zip(self._commands, self._image.values(self._commands.values()), strict=True):
            words[address] = int(value)
        owner, timeout_ms = self._image.values((self._owner, self._timeout))
        words[KEEP_ALIVE] = int(owner == str(caller))
        words[TIMEOUT] = int(timeout_ms)
        if self._brought is not None:
            words[LIFE_SIGN] = int(self._image[self._brought].value)
        return words

    # writing

    def plan_bits(self, start: int, bits: Sequence[bool], caller: Identity) -> list[Request]:
        if start + len(bits) > _WORD_BITS:
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)
        word = self._control_word
        for position, bit in enumerate(bits, start):
            word = word | 1 << position if bit else word & ~(1 << position)
        return _unpressed([self._write({"control_word": word}, caller)])

    def plan_mask(self, write: MaskWrite, caller: Identity) -> list[Request]:
        if write.address > PROCESS_WORDS:
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)
        now_there = self._holding_words(caller)[write.address]
        word = now_there & write.and_mask | write.or_mask & ~write.and_mask
        return self.plan_words(write.address, (word,), caller)

    def plan_words(self, start: int, words: Sequence[int], caller: Identity) -> list[Request]:
        """One WRITE for all process words or setpoints, then acknowledge, time-out, keep-alive or release.

        A client that may not command the drive is refused at the first request. Apart from that only the
        WRITE can be refused for its content, so it goes first. A time-out that will be refused is submitted
        alone: its refusal is counted and is the answer, and nothing else happens. Values written together
        with a release (keep-alive 0) are accepted first; then the drive is stopped and released. A stop is
        open to everybody, and nothing else in its write is carried out.
        """
        end = start + len(words)
        self._check_range(RegisterTable.HOLDING_REGISTER, start, end)
        self._check_words(RegisterTable.HOLDING_REGISTER, start, end)
        if start >= PARAMETERS:
            return [self._parameter(start, words, caller)]
        self._check_writable(start, end)
        block = dict(enumerate(words, start))
        if STOP in block and (block[STOP] or start == STOP):
            return [self._stop(block[STOP], caller)]
        if block.get(_RESERVED) or block.get(ACKNOWLEDGE, 0) > 1:
            raise ModbusException(ExceptionCode.ILLEGAL_VALUE)
        values = self._values_of(start, words, block)
        if LIFE_SIGN in block:
            values = {**(values or {}), "life_sign": block[LIFE_SIGN]}
        requests = [] if values is None else [self._write(values, caller)]
        return self._with_commands(requests, block, caller)

    def _values_of(
        self, start: int, words: Sequence[int], block: dict[int, int]
    ) -> Mapping[str, Value] | None:
        """The values of the command group in a write, or None if it contains none."""
        if start <= PROCESS_WORDS:
            return self._process_values(block)
        return self._setpoint_values(start, words) if start >= VALUES else None

    def _with_commands(
        self, requests: list[Request], block: dict[int, int], caller: Identity
    ) -> list[Request]:
        target = self._map.drive_name
        is_pressed = bool(block.get(ACKNOWLEDGE))
        if is_pressed:
            requests.append(Request(caller, target, Do(Action.RESET_FAULT), pressed=True))
        if TIMEOUT in block:
            timeout_ms = block[TIMEOUT]
            request = Request(caller, target, SetTimeout(timeout_ms))
            limits = self._map.timeout_range_ms
            if limits is None or not limits[0] <= timeout_ms <= limits[1]:
                return [request]
            requests.append(request)
        if KEEP_ALIVE in block:
            action = Action.KEEP_ALIVE if block[KEEP_ALIVE] else Action.RELEASE_CONTROL
            requests.append(Request(caller, target, Do(action)))
        # Only a 0 in the acknowledge register: nothing to do, but a telegram all the same.
        requests = requests or [Request(caller, target, Do(Action.KEEP_ALIVE))]
        return requests if is_pressed else _unpressed(requests)

    def _stop(self, code: int, caller: Identity) -> Request:
        action = _STOPS.get(code)
        if action is None:
            raise ModbusException(ExceptionCode.ILLEGAL_VALUE)
        return Request(caller, self._map.drive_name, Do(action))

    def _check_writable(self, start: int, end: int) -> None:
        only_reserved = start == _RESERVED and end == KEEP_ALIVE
        if only_reserved or (start < VALUES and end > self._last_command + 1):
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)

    def _process_values(self, block: dict[int, int]) -> dict[str, Value]:
        """Registers 0 … 8 of a write as values of the command group."""
        words = self._words[RegisterTable.HOLDING_REGISTER]
        values: dict[str, Value] = {"control_word": block[0]} if 0 in block else {}
        for address in range(1, PROCESS_WORDS + 1):
            index, word = words.get(address), block.get(address, 0)
            if index is None and word:
                raise ModbusException(ExceptionCode.ILLEGAL_VALUE)
            if index is None or address not in block:
                continue
            if word or self._image[index].quality is Quality.GOOD:
                values[self._image.points[index].leaf] = word
        return values

    def _setpoint_values(self, start: int, words: Sequence[int]) -> dict[str, Value]:
        written = self._setpoints.written(start, words)
        return {row.name.removeprefix("command/"): value for row, value in written}

    def _parameter(self, start: int, words: Sequence[int], caller: Identity) -> Request:
        """One parameter only: a write of several could be carried out in part."""
        if len(words) != 2:
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)
        ((row, value),) = self._parameters.written(start, words)
        name = row.name.removeprefix("parameter/")
        return Request(caller, self._map.drive_name, WriteParameter(name, value))

    def _write(self, values: Mapping[str, Value], caller: Identity) -> Request:
        return Request(caller, self._map.drive_name, Write(values))

    # identification

    def identify(self) -> Mapping[int, str]:
        """The drive's family, and from 80h on the numbers in 1018h of the node."""
        vendor, product, revision, serial, device_name = self._image.values(self._identity)
        number, texts = int(revision), self._map.texts
        return {
            0x00: texts[0x00],
            0x01: texts[0x01],
            0x02: f"{number >> 16}.{number & 0xFFFF}",
            0x04: str(device_name) or texts[0x01],
            0x05: texts[0x05],
            0x06: texts[0x06],
            0x80: f"{int(vendor):08X}",
            0x81: f"{int(product):08X}",
            0x82: f"{number:08X}",
            0x83: f"{int(serial):08X}",
        }


def _unpressed(telegram: list[Request]) -> list[Request]:
    """The requests of a telegram that does not write 1 to the acknowledge register."""
    return [replace(telegram[0], pressed=False), *telegram[1:]]


def _is_drives_own(row: Row) -> bool:
    """True for a value of which there is none while the drive is not heard."""
    return row.name.startswith(("actual/", "status/")) or row.name == "supervision/follows"


def _bits(word: int) -> list[bool]:
    return [bool(word >> position & 1) for position in range(_WORD_BITS)]
