"""Supervision of the bus by an 8400 motec, and its reports (EDS84DMOTCAN 3.0, §10)."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import Final

from bridge.sim.core.emcy_producer import EmcyProducer

SUPPLY_FAILED: Final = 0x3100
CAN_WARNING: Final = 0x8100
HEARTBEAT_LOST: Final = 0x8130
COB_ID_COLLISION: Final = 0x8150
PDO_TOO_SHORT: Final = 0x8210
PDO_TOO_LONG: Final = 0x8220
DEVICE_ERROR: Final = 0xF000


class LenzeError(IntEnum):
    """Errors of the CAN unit, as numbers of C00168.

    The manual prints one number only, 01.0127.00002 (§6.5), and not how its parts lie in the 32 bits:
    module 127 in the high word and these errors are the simulation's own.
    """

    RPDO1_LATE = 0x007F_0101
    RPDO2_LATE = 0x007F_0102
    FAULTY_TELEGRAM = 0x007F_0111
    BUS_OFF = 0x007F_0112
    CAN_WARNING = 0x007F_0113
    COMMUNICATION_STOPPED = 0x007F_0114
    HEARTBEAT = 0x007F_0115


class ErrorReporter:
    """One EMCY for each error that comes, and one when it goes (§10.4)."""

    def __init__(self, emcy: EmcyProducer) -> None:
        self._emcy = emcy
        self._communication: set[int] = set()
        self._device: set[int] = set()

    def reset(self) -> None:
        self._communication.clear()
        self._device.clear()
        self._emcy.error_register = 0

    def communication_error(self, code: int, *, is_there: bool) -> None:
        """A communication error or the supply has come or gone; ``code`` is its EMCY code."""
        if is_there is (code in self._communication):
            return
        self._communication ^= {code}
        self._emcy.report(code if is_there else 0, self._register())

    def device_errors(self, numbers: Sequence[int]) -> bool:
        """The drive's present errors: F000h with the Lenze number in bytes 4…7. True if anything is new."""
        come = [number for number in numbers if number not in self._device]
        gone = self._device.difference(numbers)
        self._device = set(numbers)
        for number in come:
            self._emcy.report(DEVICE_ERROR, self._register(), b"\0" + number.to_bytes(4, "little"))
        for _ in gone:
            self._emcy.report(0, self._register())
        return bool(come or gone)

    def _register(self) -> int:
        """1001h: 11h is a communication error, 01h an error of the device (§13)."""
        register = 0x01 if self._device else 0
        for code in self._communication:
            register |= 0x01 if code == SUPPLY_FAILED else 0x11
        return register
