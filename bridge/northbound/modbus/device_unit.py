"""A node that is no drive as a Modbus unit: its inputs and outputs as bits and registers.

Input registers 10 … 31 are what the bridge knows, as those of a drive as far as they apply: a read within
them always succeeds. Inputs stand in input registers from 32 on in the order of the mapping, each as wide as
it is, and those with named bits as discrete inputs from 0 on; outputs in the same way in holding registers
and coils. Each follows its own quality: one that is not there reads as 0 beside others; registers 22 and 23
and the discrete inputs from 4096 and 8192 on say which. A read of nothing else is answered 0Bh where it is
waiting, dead or disabled, 0Ah where no PDO carries it, and so is one that touches a value while the node has
none at all. A range that begins or ends within a value is 02h.

Everything that one write has of the outputs is one telegram. Holding registers 10, 11 and 13 are keep-alive,
acknowledge and stop as those of a drive, parameters stand from 1000 on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

from bridge.command import Action, Do, Identity, Request, Source, Write, WriteParameter
from bridge.command.device import worst_of
from bridge.image import Quality, Value
from bridge.northbound.modbus.device_registers import (
    ABORT,
    AGE,
    OWNER,
    QUALITY,
    WATCHDOG,
    DeviceMap,
    SignalBit,
)
from bridge.northbound.modbus.pdu import ExceptionCode, MaskWrite, ModbusException
from bridge.northbound.modbus.registers import (
    ABORT_CODE,
    ACKNOWLEDGE,
    DIAGNOSTICS,
    INPUT_FLAGS,
    KEEP_ALIVE,
    PARAMETERS,
    STOP,
    TELEGRAMS,
    VALUE_FLAGS,
    VALUES,
    VALUES_NOT_GOOD,
    RegisterTable,
    Row,
    Words32,
)
from bridge.northbound.modbus.unit import Unit, refuse_all_absent
from bridge.northbound.modbus.values32 import Values32, value_of, words_read
from bridge.northbound.view import View

_FLAGS: Final = 32
_SOURCES: Final = {source.label: source for source in Source}
_SUPERVISION: Final = ("watchdog_state", "watchdog_left_ms", "owner", "telegrams")
_STOPS: Final = (1, 2, 3)
_COMMANDS: Final = range(KEEP_ALIVE, STOP + 1)


class DeviceUnit(Unit):
    """One device's unit id."""

    def __init__(self, device_map: DeviceMap, view: View, words32: Words32) -> None:
        self._map = device_map
        self._name = name = device_map.device_name
        self._view = view
        self._image = view.image
        self._words32 = words32

        def place(leaf: str) -> int:
            return view.image.index[f"{name}/{leaf}"]

        def bits(signals: Sequence[SignalBit]) -> list[tuple[SignalBit, int]]:
            return [(bit, place(bit.leaf)) for bit in signals]

        def rows(of_map: Sequence[Row]) -> list[tuple[Row, int]]:
            return [(row, place(row.name)) for row in of_map]

        self._age: Final = place("node/pdo_age_ms")
        self._abort: Final = place(ABORT_CODE)
        leaves = _SUPERVISION if device_map.has_outputs else ()
        self._supervision: Final = [place(f"supervision/{leaf}") for leaf in leaves]
        self._bits: Final = {
            RegisterTable.DISCRETE_INPUT: bits(device_map.discrete_inputs),
            RegisterTable.COIL: bits(device_map.coils),
        }
        self._rows: Final = {
            RegisterTable.INPUT_REGISTER: rows(device_map.input_registers),
            RegisterTable.HOLDING_REGISTER: rows(device_map.holding_registers),
        }
        self._parameters: Final = Values32(device_map.parameters, name, view.image, words32, PARAMETERS)
        self._all: Final = sorted(
            {index for signals in self._bits.values() for _, index in signals}
            | {index for values in self._rows.values() for _, index in values}
        )

    # reading

    def read_bits(self, table: RegisterTable, start: int, count: int) -> Sequence[bool]:
        bits = self._bits[table]
        if table is RegisterTable.COIL and not self._map.has_outputs:
            raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)
        self._view.look(self._name)
        if table is RegisterTable.DISCRETE_INPUT and start >= VALUE_FLAGS:
            return self._flags(start, count)
        if start + count > len(bits):
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)
        readings = [(signal, self._image[index]) for signal, index in bits[start : start + count]]
        refuse_all_absent([reading.quality for _, reading in readings])
        return [
            reading.quality.has_value and bool(int(reading.value) >> (signal.bit or 0) & 1)
            for signal, reading in readings
        ]

    def _flags(self, start: int, count: int) -> Sequence[bool]:
        """Flags of the values that are not good: those of the input registers and then the parameters, or the
        discrete inputs."""
        first, indices = INPUT_FLAGS, [index for _, index in self._bits[RegisterTable.DISCRETE_INPUT]]
        if start < INPUT_FLAGS:
            of_rows = [index for _, index in self._rows[RegisterTable.INPUT_REGISTER]]
            first, indices = VALUE_FLAGS, of_rows + self._parameters.indices
        if start - first + count > len(indices):
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)
        qualities = self._image.qualities(indices[start - first : start - first + count])
        return [quality is not Quality.GOOD for quality in qualities]

    def read_words(self, table: RegisterTable, start: int, count: int, caller: Identity) -> Sequence[int]:
        end = start + count
        if table is RegisterTable.HOLDING_REGISTER and start >= PARAMETERS:
            self._check_parameters(start, end)
            return self._parameters.read(start, end)
        if table is RegisterTable.HOLDING_REGISTER and not (self._map.has_outputs or self._map.parameters):
            raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)
        self._check_range(table, start, end)
        self._view.look(self._name)
        words: list[int] = []
        if start < VALUES:
            known = (
                self._diagnostics() if table is RegisterTable.INPUT_REGISTER else self._command_words(caller)
            )
            words = known[start - DIAGNOSTICS : end - DIAGNOSTICS]
        return words + self._value_words(table, start, end)

    def _value_words(self, table: RegisterTable, start: int, end: int) -> list[int]:
        """Registers from 32 on that are in the range."""
        touched = [
            (row, self._image[index]) for row, index in self._rows[table] if start <= row.address < end
        ]
        if touched:
            refuse_all_absent(self._image.qualities(index for _, index in self._rows[table]))
        if start >= VALUES:
            refuse_all_absent([reading.quality for _, reading in touched])
        return [word for row, reading in touched for word in words_read(row, reading, self._words32)]

    def _check_range(self, table: RegisterTable, start: int, end: int) -> None:
        last = self._map.end(table)
        starts = {row.address for row, _ in self._rows[table]} | {last, VALUES}
        if end > last or start < DIAGNOSTICS or not {max(start, VALUES), max(end, VALUES)} <= starts:
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)

    def _check_parameters(self, start: int, end: int) -> None:
        if end > PARAMETERS + 2 * len(self._map.parameters) or (start - PARAMETERS) % 2 or (end - start) % 2:
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)

    def _diagnostics(self) -> list[int]:
        """Input registers 10 … 31."""
        words = [0] * (VALUES - DIAGNOSTICS)

        def put(register: int, *values: int) -> None:
            place = register - DIAGNOSTICS
            words[place : place + len(values)] = values

        from_int = self._words32.from_int
        put(QUALITY, worst_of(self._image.qualities(self._all)))
        put(AGE, *from_int(int(self._image[self._age].value)))
        put(ABORT, *from_int(int(self._image[self._abort].value)))
        flagged = self._image.qualities(
            index for _, index in self._rows[RegisterTable.INPUT_REGISTER][:_FLAGS]
        )
        not_good = sum(1 << bit for bit, one in enumerate(flagged) if one is not Quality.GOOD)
        put(VALUES_NOT_GOOD, *from_int(not_good))
        if self._supervision:
            watchdog, left_ms, owner, telegrams = self._image.values(self._supervision)
            put(WATCHDOG, int(watchdog), min(int(left_ms), 0xFFFF))
            put(OWNER, _SOURCES.get(str(owner).partition(":")[0], Source.NONE))
            put(TELEGRAMS, int(telegrams))
        return words

    def _command_words(self, caller: Identity) -> list[int]:
        """Holding registers 10 … 31."""
        words = [0] * (VALUES - DIAGNOSTICS)
        if self._supervision:
            owner = str(self._image[self._supervision[2]].value)
            words[KEEP_ALIVE - DIAGNOSTICS] = int(owner == str(caller))
        return words

    # writing

    def plan_bits(self, start: int, bits: Sequence[bool], caller: Identity) -> list[Request]:
        coils = self._coils(start, len(bits))
        values: dict[str, Value] = {}
        for signal, value in zip(coils, bits, strict=True):
            name = signal.leaf.removeprefix("output/")
            values[name if signal.bit is None else f"{name}.{signal.bit}"] = value
        return self._telegram([self._request(Write(values), caller)])

    def plan_mask(self, write: MaskWrite, caller: Identity) -> list[Request]:
        registers = self._map.holding_registers
        row = next((row for row in registers if row.address == write.address and row.size == 1), None)
        if row is None:
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)
        (now_there,) = self.read_words(RegisterTable.HOLDING_REGISTER, write.address, 1, caller)
        word = now_there & write.and_mask | write.or_mask & ~write.and_mask
        return self.plan_words(write.address, (word,), caller)

    def plan_words(self, start: int, words: Sequence[int], caller: Identity) -> list[Request]:
        """One WRITE for all outputs, then acknowledge, keep-alive or release; a stop alone. Only the WRITE
        can be refused for its content, so it goes first."""
        end = start + len(words)
        if start >= PARAMETERS:
            return [self._parameter(start, words, caller)]
        if not self._map.has_outputs:
            raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)
        if start < VALUES:
            return self._commands(start, words, caller)
        self._check_range(RegisterTable.HOLDING_REGISTER, start, end)
        values: dict[str, Value] = {}
        for row in self._map.holding_registers:
            if start <= row.address < end:
                written = words[row.address - start : row.address - start + row.size]
                values[row.name.removeprefix("output/")] = value_of(row, written, self._words32)
        return self._telegram([self._request(Write(values), caller)])

    def _coils(self, start: int, count: int) -> Sequence[SignalBit]:
        if not self._map.has_outputs:
            raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)
        if start + count > len(self._map.coils):
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)
        return self._map.coils[start : start + count]

    def _commands(self, start: int, words: Sequence[int], caller: Identity) -> list[Request]:
        block = dict(enumerate(words, start))
        if not (start in _COMMANDS and start + len(words) - 1 in _COMMANDS):
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)
        if STOP in block and (block[STOP] or start == STOP):
            if block[STOP] not in _STOPS:
                raise ModbusException(ExceptionCode.ILLEGAL_VALUE)
            return [self._request(Do(Action.STOP), caller)]
        if block.get(ACKNOWLEDGE, 0) > 1:
            raise ModbusException(ExceptionCode.ILLEGAL_VALUE)
        requests: list[Request] = []
        if block.get(ACKNOWLEDGE):
            requests.append(replace(self._request(Do(Action.RESET_FAULT), caller), pressed=True))
        if KEEP_ALIVE in block:
            action = Action.KEEP_ALIVE if block[KEEP_ALIVE] else Action.RELEASE_CONTROL
            requests.append(self._request(Do(action), caller))
        requests = requests or [self._request(Do(Action.KEEP_ALIVE), caller)]
        return requests if block.get(ACKNOWLEDGE) else self._telegram(requests)

    def _parameter(self, start: int, words: Sequence[int], caller: Identity) -> Request:
        """One parameter only: a write of several could be carried out in part."""
        self._check_parameters(start, start + len(words))
        if len(words) != 2:
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)
        ((row, value),) = self._parameters.written(start, words)
        return self._request(WriteParameter(row.name.removeprefix("parameter/"), value), caller)

    def _request(self, command: Write | Do | WriteParameter, caller: Identity) -> Request:
        return Request(caller, self._name, command)

    def _telegram(self, requests: list[Request]) -> list[Request]:
        """The requests of a telegram that does not write 1 to the acknowledge register."""
        return [replace(requests[0], pressed=False), *requests[1:]]

    def identify(self) -> Mapping[int, str]:
        return {number: text for number, text in sorted(self._map.texts.items()) if text}
