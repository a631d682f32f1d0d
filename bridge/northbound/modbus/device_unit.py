"""A node that is no drive as a Modbus unit: its inputs as discrete inputs and input registers.

Registers 10 … 23 are what the bridge knows, as those of a drive as far as they apply: a read within them
always succeeds. Inputs stand from register 32 on in the order of the mapping, each as wide as it is, and
those with named bits as discrete inputs from 0 on. Each follows its own quality: a read that touches one that
is waiting, dead or disabled is answered 0Bh, one that no TPDO carries 0Ah. A range that begins or ends within
a value is 02h.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from bridge.command import Identity
from bridge.command.device import worst_of
from bridge.image import Quality
from bridge.northbound.modbus.device_registers import AGE, QUALITY, DeviceMap
from bridge.northbound.modbus.pdu import ExceptionCode, Refused
from bridge.northbound.modbus.registers import DIAGNOSTICS, VALUES, VALUES_NOT_GOOD, Row, Table, Words32
from bridge.northbound.modbus.unit import Unit, refuse_quality
from bridge.northbound.view import View

_FLAGS: Final = 32


class DeviceUnit(Unit):
    """One device's unit id."""

    def __init__(self, device_map: DeviceMap, view: View, words32: Words32) -> None:
        self._map = device_map
        self._view = view
        self._image = view.image
        self._words32 = words32
        name, index = device_map.device_name, view.image.index
        self._age: Final = index[f"{name}/node/pdo_age_ms"]
        self._bits: Final = [(index[f"{name}/{bit.leaf}"], bit.bit) for bit in device_map.bits]
        self._inputs: Final = [(row, index[f"{name}/{row.name}"]) for row in device_map.inputs]
        self._all: Final = sorted({place for place, _ in self._bits} | {place for _, place in self._inputs})

    def read_bits(self, table: Table, start: int, count: int) -> Sequence[bool]:
        if table is not Table.DISCRETE_INPUT:
            raise Refused(ExceptionCode.ILLEGAL_FUNCTION)
        if start + count > len(self._bits):
            raise Refused(ExceptionCode.ILLEGAL_ADDRESS)
        self._view.look(self._map.device_name)
        found: list[bool] = []
        for index, bit in self._bits[start : start + count]:
            reading = self._image[index]
            refuse_quality(reading.quality)
            found.append(bool(int(reading.value) >> (bit or 0) & 1))
        return found

    def read_words(self, table: Table, start: int, count: int, caller: Identity) -> Sequence[int]:
        if table is not Table.INPUT_REGISTER:
            raise Refused(ExceptionCode.ILLEGAL_FUNCTION)
        end = start + count
        starts = {row.address for row, _ in self._inputs} | {self._map.end}
        if end > self._map.end or start < DIAGNOSTICS or not {max(start, VALUES), max(end, VALUES)} <= starts:
            raise Refused(ExceptionCode.ILLEGAL_ADDRESS)
        self._view.look(self._map.device_name)
        words = self._diagnostics()[start - DIAGNOSTICS : end - DIAGNOSTICS] if start < VALUES else []
        for row, index in self._inputs:
            if start <= row.address < end:
                words += self._words_of(row, index)
        return words

    def _diagnostics(self) -> list[int]:
        """Input registers 10 … 31."""
        words = [0] * (VALUES - DIAGNOSTICS)
        qualities = self._image.qualities(self._all)
        words[QUALITY - DIAGNOSTICS] = worst_of(qualities)
        age = self._words32.from_int(int(self._image[self._age].value))
        words[AGE - DIAGNOSTICS : AGE - DIAGNOSTICS + 2] = age
        flagged = self._image.qualities(index for _, index in self._inputs[:_FLAGS])
        not_good = sum(1 << bit for bit, one in enumerate(flagged) if one is not Quality.GOOD)
        place = VALUES_NOT_GOOD - DIAGNOSTICS
        words[place : place + 2] = self._words32.from_int(not_good)
        return words

    def _words_of(self, row: Row, index: int) -> Sequence[int]:
        reading = self._image[index]
        refuse_quality(reading.quality)
        if row.type == "float32":
            return self._words32.from_float(float(reading.value))
        if row.size == 1:
            return (int(reading.value) & 0xFFFF,)
        return self._words32.from_int(int(reading.value))

    def identify(self) -> Mapping[int, str]:
        return {number: text for number, text in sorted(self._map.texts.items()) if text}
