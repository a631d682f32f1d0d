"""One drive as a Modbus unit: its registers read, and its writes as requests.

Which quality is served how: input registers 0 … 9, the scaled actual values and the discrete inputs of
the status word are the drive's data. While the drive's quality is waiting, dead or disabled a read that
touches one of them is answered 0Bh, with config_error 0Ah (for a scaled value whose scale alone is not
known, or that comes by a TPDO of its own which never came, only where it is touched). Registers 10 … 31
and the discrete inputs of the quality are what the bridge knows: a read wholly within them always succeeds,
so that a control program can see *why*. A read of 0 … 31 therefore fails while there is no data, a read of
10 … 31 does not. Values from register 32 on that are not the drive's actual values (supervision, identity)
follow their own quality.

Ranges: 02h where a range leaves the map, begins or ends within a 32-bit value (read or write), or a
write touches what is not writable, or more than one parameter. Gaps inside the first 32 registers read
as 0. Setpoint words the drive does not have, and register 9 within a longer write, take 0; anything
else is 03h. A range of nothing but words that the drive does not have is 02h, of words that its node does
not carry 0Ah, of words whose own TPDO never came 0Bh; within a longer range they read as 0 and take 0, and
register 21 says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

from bridge.command import Action, Do, Drive, Identity, Request, SetTimeout, Write, WriteParameter
from bridge.image import Image, Quality, Value
from bridge.northbound.modbus.pdu import ExceptionCode, MaskWrite, Refused
from bridge.northbound.modbus.registers import (
    ACKNOWLEDGE,
    DIAGNOSTICS,
    KEEP_ALIVE,
    PARAMETERS,
    PROCESS_WORDS,
    QUALITY_BITS,
    STOP,
    TIMEOUT,
    VALUES,
    WORDS_NOT_GOOD,
    DriveMap,
    Row,
    Table,
    Words32,
    actual_words,
    setpoint_words,
)
from bridge.northbound.modbus.unit import refuse_quality, state_code

_WORD_BITS: Final = 16
_FLAGS: Final = 32  # 32-bit values that have a bit in registers 22 and 23
_ACTUAL: Final = "actual/"
_RESERVED: Final = 9  # between the setpoints and the keep-alive, so that one write can reach both
_STOPS: Final = {1: Action.STOP, 2: Action.QUICK_STOP, 3: Action.DISABLE_VOLTAGE}


class DriveUnit:
    """One drive's unit id."""

    __slots__ = (
        "_drive",
        "_flagged",
        "_flagged_actual",
        "_halves",
        "_image",
        "_inputs",
        "_map",
        "_parameters",
        "_setpoints",
        "_words",
        "_words32",
    )

    def __init__(self, drive: Drive, image: Image, words32: Words32) -> None:
        self._drive = drive
        self._image = image
        self._words32 = words32
        self._map = drive_map = DriveMap(drive)
        self._inputs: Final = [(row, image.index[f"{drive.name}/{row.name}"]) for row in drive_map.inputs]
        flagged = self._inputs[:_FLAGS]
        self._flagged: Final = [index for _, index in flagged]
        actual = (place for place, (row, _) in enumerate(flagged) if row.name.startswith(_ACTUAL))
        self._flagged_actual: Final = tuple(actual)
        self._setpoints: Final = [(r, image.index[f"{drive.name}/{r.name}"]) for r in drive_map.setpoints]
        self._parameters: Final = [(r, image.index[f"{drive.name}/{r.name}"]) for r in drive_map.parameters]
        self._words: Final = {
            Table.INPUT_REGISTER: {place: f"actual/{word}" for place, word in actual_words(drive)},
            Table.HOLDING_REGISTER: {place: f"command/{word}" for place, word in setpoint_words(drive)},
        }
        self._halves: Final = {table: drive_map.second_halves(table) for table in Table}

    # reading

    def read_bits(self, table: Table, start: int, count: int, now: float) -> Sequence[bool]:
        channel = self._drive.channel
        quality = channel.link.quality(now)
        if table is Table.COIL:
            bits = _bits(channel.control_word)
        else:
            bits = _bits(channel.status_word) + [quality is each for each in Quality]
        if start + count > len(bits):
            raise Refused(ExceptionCode.ILLEGAL_ADDRESS)
        if table is Table.DISCRETE_INPUT and start < QUALITY_BITS:
            refuse_quality(quality)
        return bits[start : start + count]

    def read_words(self, table: Table, start: int, count: int, caller: Identity, now: float) -> Sequence[int]:
        is_input = table is Table.INPUT_REGISTER
        end = start + count
        self._check_range(table, start, end)
        if start >= PARAMETERS and not is_input:
            return self._values(self._parameters, start, end, now, PARAMETERS)
        if is_input:
            quality = self._drive.channel.link.quality(now)
            if quality.has_value:
                self._check_words(table, start, end, now)
            words = self._input_words(start, end, quality, now)
            if end > VALUES:
                words += self._values(self._inputs, start, end, now)
        else:
            self._check_words(table, start, end, now)
            words = self._holding_words(caller)[start:end] if start < VALUES else []
            if end > VALUES:
                words += self._values(self._setpoints, start, end, now)
        return words

    def _check_range(self, table: Table, start: int, end: int) -> None:
        halves = self._halves[table]
        if table is Table.INPUT_REGISTER:
            most = self._map.input_end
        else:
            most = self._map.holding_end if start < PARAMETERS else self._map.parameter_end
        if end > most or start in halves or end in halves:
            raise Refused(ExceptionCode.ILLEGAL_ADDRESS)

    def _check_words(self, table: Table, start: int, end: int, now: float) -> None:
        """A range of nothing but words that the drive does not have, that its node does not carry, or that
        never came."""
        if not start or end > PROCESS_WORDS + 1:
            return
        words = self._words[table]
        leaves = [words[address] for address in range(start, end) if address in words]
        if not leaves:
            raise Refused(ExceptionCode.ILLEGAL_ADDRESS)
        qualities = [self._word_quality(table, leaf, now) for leaf in leaves]
        if not any(quality.has_value for quality in qualities):
            refuse_quality(qualities[0])

    def _word_quality(self, table: Table, leaf: str, now: float) -> Quality:
        if table is Table.INPUT_REGISTER:
            return self._drive.quality_at(leaf, now)
        return Quality.CONFIG_ERROR if leaf in self._drive.channel.unserved else Quality.GOOD

    def _input_words(self, start: int, end: int, quality: Quality, now: float) -> list[int]:
        """Those of input registers 0 … 31 that are in the range."""
        words: list[int] = []
        if start < DIAGNOSTICS:
            refuse_quality(quality)
            words = self._data(now)[start:end]
        if start < VALUES and end > DIAGNOSTICS:
            words += self._diagnostics(quality, end, now)[max(start - DIAGNOSTICS, 0) : end - DIAGNOSTICS]
        return words

    def _data(self, now: float) -> list[int]:
        """Input registers 0 … 9."""
        channel = self._drive.channel
        values = self._drive.words[1 : PROCESS_WORDS + 1]
        gap = [0] * (PROCESS_WORDS - len(values))
        words = [channel.status_word, *values, *gap, channel.drive_status_word]
        if self._drive.is_even:
            return words
        for place, leaf in self._words[Table.INPUT_REGISTER].items():
            if not self._drive.quality_at(leaf, now).has_value:
                words[place] = 0  # what it was before the node restarted says nothing
        return words

    def _diagnostics(self, quality: Quality, end: int, now: float) -> list[int]:
        """Input registers 10 … 31; what takes longer only as far as ``end``."""
        channel = self._drive.channel
        from_int = self._words32.from_int
        owner = channel.owner
        words = [
            state_code(self._drive, quality),
            quality,
            channel.emcy_code,
            min(round(channel.last_fault * 10), 0xFFFF),
            channel.watchdog.state,
            channel.watchdog.left_ms(now),
            *from_int(max(channel.link.age_ms(now), 0)),
            *from_int(self._drive.sdo_abort_code),
            owner.source if owner else 0,
        ]
        if end > WORDS_NOT_GOOD:
            words += [self._words_not_good(quality, now), *from_int(self._values_not_good(now))]
            words.append(channel.watchdog.telegrams)
        return words + [0] * (VALUES - DIAGNOSTICS - len(words))

    def _words_not_good(self, quality: Quality, now: float) -> int:
        """Bit 0 is actual value word 1; a word that the drive does not have is no bad one."""
        if self._drive.is_even and quality is Quality.GOOD:
            return 0
        words = self._words[Table.INPUT_REGISTER].items()
        bad = (place for place, leaf in words if self._drive.quality_at(leaf, now) is not Quality.GOOD)
        return sum(1 << place - 1 for place in bad)

    def _values_not_good(self, now: float) -> int:
        """Bit 0 is the first 32-bit value."""
        qualities = self._image.qualities(self._flagged)
        for place in self._flagged_actual:
            qualities[place] = self._drive.quality_at(self._inputs[place][0].name, now)
        return sum(1 << place for place, one in enumerate(qualities) if one is not Quality.GOOD)

    def _quality(self, row: Row, index: int, now: float) -> Quality:
        """The quality of a 32-bit value. Process data are judged now: the image learns of a passed deadline
        only when its timer has run."""
        if row.name.startswith(_ACTUAL):
            return self._drive.quality_at(row.name, now)
        return self._image[index].quality

    def _values(
        self,
        values: list[tuple[Row, int]],
        start: int,
        end: int,
        now: float,
        first: int = VALUES,
    ) -> list[int]:
        """The 32-bit values in the range, which begins and ends between values."""
        words: list[int] = []
        for row, index in values[max(start - first, 0) // 2 : (end - first) // 2]:
            refuse_quality(self._quality(row, index, now))
            reading = self._image[index]
            if row.type == "float32":
                words += self._words32.from_float(float(reading.value))
            else:
                words += self._words32.from_int(int(reading.value))
        return words

    def _holding_words(self, caller: Identity) -> list[int]:
        """Holding registers 0 … 31: what the owner wrote."""
        channel = self._drive.channel
        words = [0] * VALUES
        setpoints = channel.setpoints[:PROCESS_WORDS]
        words[0] = channel.control_word
        words[1 : len(setpoints) + 1] = setpoints
        words[KEEP_ALIVE] = int(caller.is_same(channel.owner))
        words[TIMEOUT] = channel.watchdog.timeout_ms
        return words

    # writing

    def plan_bits(self, start: int, bits: Sequence[bool], caller: Identity) -> list[Request]:
        if start + len(bits) > _WORD_BITS:
            raise Refused(ExceptionCode.ILLEGAL_ADDRESS)
        word = self._drive.channel.control_word
        for position, bit in enumerate(bits, start):
            word = word | 1 << position if bit else word & ~(1 << position)
        return _unpressed([self._write({"control_word": word}, caller)])

    def plan_mask(self, write: MaskWrite, caller: Identity) -> list[Request]:
        if write.address > PROCESS_WORDS:
            raise Refused(ExceptionCode.ILLEGAL_ADDRESS)
        now_there = self._holding_words(caller)[write.address]
        word = now_there & write.and_mask | write.or_mask & ~write.and_mask
        return self.plan_words(write.address, (word,), caller)

    def plan_words(self, start: int, words: Sequence[int], caller: Identity) -> list[Request]:
        """One WRITE for all process words or setpoints, then acknowledge, time, keep-alive or release.

        Who may not command the drive is refused at the first request. Beyond that only the WRITE can be
        refused for what it holds, so it goes first; a time that will be refused is submitted alone: its
        refusal is the answer, and is counted, and nothing else is done. Values written together with a
        release (keep-alive 0) are taken first, then the drive is stopped and free. A stop is everybody's,
        and all that is done.
        """
        end = start + len(words)
        self._check_range(Table.HOLDING_REGISTER, start, end)
        self._check_words(Table.HOLDING_REGISTER, start, end, 0.0)
        if start >= PARAMETERS:
            return [self._parameter(start, words, caller)]
        self._check_writable(start, end)
        block = dict(enumerate(words, start))
        if STOP in block and (block[STOP] or start == STOP):
            return [self._stop(block[STOP], caller)]
        if block.get(_RESERVED) or block.get(ACKNOWLEDGE, 0) > 1:
            raise Refused(ExceptionCode.ILLEGAL_VALUE)
        values = self._values_of(start, words, block)
        requests = [] if values is None else [self._write(values, caller)]
        return self._with_commands(requests, block, caller)

    def _values_of(
        self, start: int, words: Sequence[int], block: dict[int, int]
    ) -> Mapping[str, Value] | None:
        """The values of the command group in a write, or None where it reaches none."""
        if start <= PROCESS_WORDS:
            return self._process_values(block)
        return self._setpoint_values(start, words) if start >= VALUES else None

    def _with_commands(
        self, requests: list[Request], block: dict[int, int], caller: Identity
    ) -> list[Request]:
        target = self._drive.name
        is_pressed = bool(block.get(ACKNOWLEDGE))
        if is_pressed:
            requests.append(Request(caller, target, Do(Action.RESET_FAULT), pressed=True))
        if TIMEOUT in block:
            timeout_ms = block[TIMEOUT]
            request = Request(caller, target, SetTimeout(timeout_ms))
            settings = self._drive.channel.settings
            low, high = settings.timeout_range_ms
            if not settings.fieldbus_timeout_writable or not low <= timeout_ms <= high:
                return [request]
            requests.append(request)
        if KEEP_ALIVE in block:
            action = Action.KEEP_ALIVE if block[KEEP_ALIVE] else Action.RELEASE_CONTROL
            requests.append(Request(caller, target, Do(action)))
        # A 0 written to the acknowledge register alone: nothing to do, and still a telegram.
        requests = requests or [Request(caller, target, Do(Action.KEEP_ALIVE))]
        return requests if is_pressed else _unpressed(requests)

    def _stop(self, code: int, caller: Identity) -> Request:
        action = _STOPS.get(code)
        if action is None:
            raise Refused(ExceptionCode.ILLEGAL_VALUE)
        return Request(caller, self._drive.name, Do(action))

    def _check_writable(self, start: int, end: int) -> None:
        only_reserved = start == _RESERVED and end == KEEP_ALIVE
        if only_reserved or (start < VALUES and end > STOP + 1):
            raise Refused(ExceptionCode.ILLEGAL_ADDRESS)

    def _process_values(self, block: dict[int, int]) -> dict[str, Value]:
        """Registers 0 … 8 of a write as values of the command group."""
        leaves = self._words[Table.HOLDING_REGISTER]
        unserved = self._drive.channel.unserved
        values: dict[str, Value] = {"control_word": block[0]} if 0 in block else {}
        for address in range(1, PROCESS_WORDS + 1):
            leaf, word = leaves.get(address), block.get(address, 0)
            if leaf is None and word:
                raise Refused(ExceptionCode.ILLEGAL_VALUE)
            if leaf is not None and address in block and (word or leaf not in unserved):
                values[leaf.removeprefix("command/")] = word
        return values

    def _setpoint_values(self, start: int, words: Sequence[int]) -> dict[str, Value]:
        first = (start - VALUES) // 2
        pairs = zip(words[::2], words[1::2], strict=True)
        rows = self._map.setpoints[first : first + len(words) // 2]
        return {
            row.name.removeprefix("command/"): self._value(row, pair)
            for row, pair in zip(rows, pairs, strict=True)
        }

    def _value(self, row: Row, pair: Sequence[int]) -> Value:
        """What two registers that are written say, by the type of their value."""
        if row.type == "float32":
            return self._words32.to_float(*pair)
        return self._words32.to_int(*pair, signed=row.type == "int32")

    def _parameter(self, start: int, words: Sequence[int], caller: Identity) -> Request:
        """One parameter; more in one write could end half done."""
        if len(words) != 2:
            raise Refused(ExceptionCode.ILLEGAL_ADDRESS)
        row = self._map.parameters[(start - PARAMETERS) // 2]
        value = self._value(row, words)
        name = row.name.removeprefix("parameter/")
        return Request(caller, self._drive.name, WriteParameter(name, value))

    def _write(self, values: Mapping[str, Value], caller: Identity) -> Request:
        return Request(caller, self._drive.name, Write(values))

    # identification

    def identify(self) -> Mapping[int, str]:
        """The drive's family, and from 80h on the numbers of 1018h as the node gives them."""
        family, known = self._drive.family.family, self._drive.identification
        return {
            0x00: family.vendor,
            0x01: family.name,
            0x02: f"{known.revision >> 16}.{known.revision & 0xFFFF}",
            0x04: known.device_name or family.name,
            0x05: self._drive.slot.name,
            0x06: self._drive.name,
            0x80: f"{known.vendor:08X}",
            0x81: f"{known.product:08X}",
            0x82: f"{known.revision:08X}",
            0x83: f"{known.serial:08X}",
        }


def _unpressed(telegram: list[Request]) -> list[Request]:
    """The requests of a telegram that does not write 1 to the acknowledge register."""
    return [replace(telegram[0], pressed=False), *telegram[1:]]


def _bits(word: int) -> list[bool]:
    return [bool(word >> position & 1) for position in range(_WORD_BITS)]
