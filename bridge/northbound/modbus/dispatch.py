"""One request PDU in, one answer PDU out: units, exceptions and the way to the view."""

from __future__ import annotations

import logging
import math
import unicodedata
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Final

from bridge.base.quietlog import log_source
from bridge.base.sources import source_of
from bridge.command import Action, Code, Identity, Outcome, Rejection, Request
from bridge.command.messages.freshness import NOW_S
from bridge.config import WordOrder
from bridge.northbound.modbus.device_unit import DeviceUnit
from bridge.northbound.modbus.drive_unit import DriveUnit
from bridge.northbound.modbus.pdu import (
    ExceptionCode,
    Function,
    Identify,
    Loopback,
    MaskWrite,
    ModbusException,
    ModbusRead,
    ReadWrite,
    WriteBits,
    WriteWords,
    bits_answer,
    identification_answer,
    parse,
    refusal,
    words_answer,
)
from bridge.northbound.modbus.registers import BRIDGE_UNITS, MIRROR, RegisterTable, Words32
from bridge.northbound.modbus.unit import BridgeUnit, Unit
from bridge.northbound.modbus.units import Units
from bridge.northbound.view import View
from bridge.text import Text

_log = logging.getLogger(__name__)

Answer = Callable[[bytes], None]

_TABLES: Final = {
    Function.READ_COILS: RegisterTable.COIL,
    Function.READ_DISCRETE_INPUTS: RegisterTable.DISCRETE_INPUT,
    Function.READ_HOLDING_REGISTERS: RegisterTable.HOLDING_REGISTER,
    Function.READ_INPUT_REGISTERS: RegisterTable.INPUT_REGISTER,
}

EXCEPTIONS: Final = {
    Code.UNKNOWN_TARGET: ExceptionCode.PATH_UNAVAILABLE,
    Code.UNKNOWN_POINT: ExceptionCode.ILLEGAL_ADDRESS,
    Code.READ_ONLY: ExceptionCode.ILLEGAL_ADDRESS,
    Code.OUT_OF_RANGE: ExceptionCode.ILLEGAL_VALUE,
    Code.NOT_VALID: ExceptionCode.ILLEGAL_VALUE,
    Code.NOT_ALLOWED: ExceptionCode.ILLEGAL_FUNCTION,
    Code.ACKNOWLEDGE_FIRST: ExceptionCode.DEVICE_FAILURE,
    Code.NOT_READY: ExceptionCode.NOT_RESPONDING,
    Code.STALE: ExceptionCode.BUSY,
    Code.NOT_CONFIGURED: ExceptionCode.PATH_UNAVAILABLE,
    Code.TIMED_OUT: ExceptionCode.DEVICE_FAILURE,
    Code.CANCELLED: ExceptionCode.DEVICE_FAILURE,
    Code.UNKNOWN_PARAMETER: ExceptionCode.ILLEGAL_ADDRESS,
    Code.WRITE_ONLY: ExceptionCode.ILLEGAL_ADDRESS,
    Code.BUSY: ExceptionCode.BUSY,
    Code.OTHER_VALUE: ExceptionCode.DEVICE_FAILURE,
    Code.TOO_OFTEN: ExceptionCode.ILLEGAL_FUNCTION,
    Code.REFUSED_BY_DRIVE: ExceptionCode.DEVICE_FAILURE,
}
"""The exception for a request that did not succeed."""

_CODES: Final = {
    ExceptionCode.ILLEGAL_FUNCTION: Code.NOT_ALLOWED,
    ExceptionCode.ILLEGAL_ADDRESS: Code.UNKNOWN_POINT,
    ExceptionCode.ILLEGAL_VALUE: Code.OUT_OF_RANGE,
    ExceptionCode.PATH_UNAVAILABLE: Code.UNKNOWN_TARGET,
    ExceptionCode.NOT_RESPONDING: Code.NOT_READY,
}
"""The outcome for an exception that is raised here."""
WRITES: Final = (
    Function.WRITE_COIL,
    Function.WRITE_REGISTER,
    Function.WRITE_COILS,
    Function.WRITE_REGISTERS,
    Function.MASK_WRITE,
    Function.READ_WRITE,
)

_Write = WriteBits | WriteWords | MaskWrite | ReadWrite
_TEXT_MOST: Final = 240  # an object of FC43/14 must fit into one PDU


class Dispatcher:
    """All units of a site. ``clock`` is that of ``received_at``, in monotonic seconds."""

    def __init__(self, view: View, units: Units, word_order: WordOrder, clock: Callable[[], float]) -> None:
        self._view = view
        self._clock = clock
        self._names = {drive.unit_id: drive.drive_name for drive in units.drives}
        words32 = Words32(word_order)
        self._units: dict[int, Unit] = {
            drive.unit_id: DriveUnit(drive, view, words32) for drive in units.drives
        }
        for device in units.devices:
            self._names[device.unit_id] = device.device_name
            self._units[device.unit_id] = DeviceUnit(device, view, words32)
        known, own = _ranges(self._names), BRIDGE_UNITS[0]
        self._served = (
            Text.of("modbus.units", units=known, own=own) if known else Text.of("modbus.no_units", own=own)
        )
        for unit_id in BRIDGE_UNITS:
            self._units[unit_id] = BridgeUnit(units, view)

    def handle(
        self, unit_id: int, pdu: bytes, caller: Identity, answer: Answer, received_at: float = math.inf
    ) -> None:
        """Carry out ``pdu`` (at least one byte). ``answer`` is called exactly once, now or later.

        ``received_at`` is the earliest time at which it can have arrived.
        """
        try:
            unit = self._units.get(unit_id)
            if unit is None:
                if pdu[0] not in WRITES:  # a refused write is an event
                    self._note_unknown(unit_id, caller)
                raise ModbusException(ExceptionCode.PATH_UNAVAILABLE)
            request = parse(pdu)
            if isinstance(request, _Write):
                self._write(unit, request, pdu[0], caller, answer, received_at)
                return
            given = self._read(unit, request, caller)
        except ModbusException as error:
            given = refusal(pdu[0], error.code)
            if pdu[0] in WRITES:
                self._note_refusal(unit_id, pdu[0], caller, error.code)
        answer(given)

    def _note_refusal(self, unit_id: int, function: int, caller: Identity, code: ExceptionCode) -> None:
        """A write that was refused before it became a request, for the audit log and the events."""
        target = self._names.get(unit_id, f"unit {unit_id}")
        ending, said = _CODES.get(code, Code.NOT_READY), self._why(unit_id)
        if unit_id in BRIDGE_UNITS:
            ending = Code.READ_ONLY
        said = said or Text.of("modbus.refused", function=function, exception=code.value)
        self._view.rejected(Rejection(caller, target, Action.WRITE, ending, said))

    def _note_unknown(self, unit_id: int, caller: Identity) -> None:
        """A PLC that asks for a unit which is not there is set up wrongly, and shows its user a number."""
        source, why = source_of(caller.user), self._why(unit_id)
        _log.warning("Modbus: %s is refused: %s", caller.address, why, extra=log_source(source, unit_id))

    def _why(self, unit_id: int) -> Text | None:
        """Reason why nothing can be written to a unit id; None for that of a drive or device."""
        if unit_id in self._names:
            return None
        if unit_id in BRIDGE_UNITS:
            return Text.of("modbus.unit_is_bridge", unit=unit_id, served=self._served)
        return Text.of("modbus.no_unit", unit=unit_id, served=self._served)

    def _read(self, unit: Unit, request: ModbusRead | Identify | Loopback, caller: Identity) -> bytes:
        match request:
            case ModbusRead(function, start, count):
                table = _TABLES[function]
                if table in (RegisterTable.COIL, RegisterTable.DISCRETE_INPUT):
                    return bits_answer(function, unit.read_bits(table, start, count))
                return words_answer(function, _words(unit, table, start, count, caller))
            case Identify():
                objects = {number: _ascii(text) for number, text in unit.identify().items()}
                return identification_answer(request, objects)
            case Loopback(echo):
                return echo

    def _write(
        self,
        unit: Unit,
        request: _Write,
        function: int,
        caller: Identity,
        answer: Answer,
        received_at: float,
    ) -> None:
        """Plan the whole write, then submit it. Raises ``ModbusException`` before anything is submitted."""
        match request:
            case WriteWords(start, words):
                plan = unit.plan_words(start, words, caller)
            case WriteBits(start, bits):
                plan = unit.plan_bits(start, bits, caller)
            case MaskWrite():
                plan = unit.plan_mask(request, caller)
            case ReadWrite(start, words):
                plan = unit.plan_words(start, words, caller)
                self._read_back(unit, request, caller)  # a read that cannot be answered writes nothing

        def conclude(outcome: Outcome) -> None:
            if not outcome.ok:
                answer(refusal(function, EXCEPTIONS[outcome.code]))
            elif not isinstance(request, ReadWrite):
                answer(request.echo)
            else:
                try:
                    given = self._read_back(unit, request, caller)
                except ModbusException as error:
                    given = refusal(function, error.code)
                answer(given)

        if self._clock() - received_at > NOW_S:
            plan = [replace(one, received_at=received_at) for one in plan]
        self._submit(plan, conclude)

    def _read_back(self, unit: Unit, request: ReadWrite, caller: Identity) -> bytes:
        start, count = request.read_start, request.read_count
        words = _words(unit, RegisterTable.HOLDING_REGISTER, start, count, caller)
        return words_answer(Function.READ_WRITE, words)

    def _submit(self, plan: Sequence[Request], conclude: Callable[[Outcome], None]) -> None:
        """Submit one request after the other; the outcome is that of the first one that fails, or of the
        last."""
        first, *rest = plan

        def on_outcome(outcome: Outcome) -> None:
            if outcome.ok and rest:
                self._submit(rest, conclude)
            else:
                conclude(outcome)

        self._view.submit(first, on_outcome)


def _words(unit: Unit, table: RegisterTable, start: int, count: int, caller: Identity) -> Sequence[int]:
    """Registers of a unit; holding registers from ``MIRROR`` on are its input registers."""
    if table is RegisterTable.HOLDING_REGISTER and start >= MIRROR:
        return unit.read_words(RegisterTable.INPUT_REGISTER, start - MIRROR, count, caller)
    return unit.read_words(table, start, count, caller)


def _ranges(numbers: Iterable[int]) -> str:
    """Numbers as people write them: 1-4, 7."""
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1][1:] = [number]
        else:
            runs.append([number])
    return ", ".join("-".join(map(str, run)) for run in runs)


def _ascii(text: str) -> bytes:
    """Identification objects are ASCII (§6.21): an umlaut loses its dots."""
    return unicodedata.normalize("NFKD", text).encode("ascii", "ignore")[:_TEXT_MOST]
