"""Control and status words of a drive family, compiled from its mapping file.

No vendor and no drive is named here: what a bit does is in ``mappings/``.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from bridge.mapping.model import Command, ControlWord, StatusWord, pattern_bits


class DriveState(IntEnum):
    """State of the drive's state machine, numbered as Modbus serves it (input register 10)."""

    __hash__ = int.__hash__  # in C: it is looked up with every report

    NOT_READY = 0
    SWITCH_ON_INHIBITED = 1
    READY = 2
    SWITCHED_ON = 3
    OPERATION_ENABLED = 4
    QUICK_STOP_ACTIVE = 5
    FAULT_REACTION_ACTIVE = 6
    FAULT = 7
    UNKNOWN = 255

    @property
    def label(self) -> str:
        return self.name.lower()


DRIVE_STATES: Final = tuple((state.value, state.label) for state in DriveState)

MOVING: Final = frozenset(
    (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT_REACTION_ACTIVE)
)
FAULTED: Final = frozenset((DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE))


class ControlWords:
    """Control words of one family: their meaning, and how one is changed. Words are 16-bit integers."""

    def __init__(self, model: ControlWord) -> None:
        self._enable_mask = model.enabling.mask
        self._enable_value = model.enabling.value
        self._valid_mask = 0 if model.valid_bit is None else 1 << model.valid_bit
        self.acknowledge_mask = 1 << model.acknowledge_bit
        self._set_mask = sum(1 << bit for bit in model.parameter_set_bits)
        self.stopped = model.stopped
        self.ready = model.ready
        self.run = model.run
        self.forward = model.forward
        self.reverse = model.reverse
        self.begin = model.begin
        self._stop = self._bits(model.stop)
        self._quick_stop = self._bits(model.quick_stop)
        self._disable_voltage = self._bits(model.disable_voltage)
        enabling = model.enabling.mask
        self._takes_voltage = (
            (model.disable_voltage.mask, model.disable_voltage.value),
            (enabling, model.stopped & enabling),
        )
        self._withhold = self._bits(Command(mask=self._enable_mask, value=model.ready & self._enable_mask))

    def _bits(self, command: Command) -> tuple[int, int]:
        """Mask and value of a command, without the bits that it would bring to where enabling needs
        them: a stop lifts no stronger stop that is in force already."""
        towards = self._enable_mask & ~(command.value ^ self._enable_value)
        mask = command.mask & ~towards
        return mask, command.value & mask

    def enables(self, word: int) -> bool:
        return word & self._enable_mask == self._enable_value

    def takes_voltage(self, word: int) -> bool:
        """Whether this word switches the drive off at once: any other stop may be a ramp."""
        return any(word & mask == value for mask, value in self._takes_voltage)

    def is_valid(self, word: int) -> bool:
        return word & self._valid_mask == self._valid_mask

    def in_set_of(self, like: int, word: int) -> int:
        """``word`` in the parameter set of the control word ``like``."""
        return word & ~self._set_mask | like & self._set_mask

    def stop(self, word: int) -> int:
        return self._changed(word, self._stop)

    def quick_stop(self, word: int) -> int:
        return self._changed(word, self._quick_stop)

    def disable_voltage(self, word: int) -> int:
        return self._changed(word, self._disable_voltage)

    def withhold(self, word: int) -> int:
        """A stop for a drive that is not enabled: ``word`` without its enabling bits. A family's stop that
        holds the motor (Lenze's quick stop) would energise it."""
        return self._changed(word, self._withhold)

    def _changed(self, word: int, bits: tuple[int, int]) -> int:
        """``word`` with these bits. Bits that do not concern movement stay (parameter set, functions), but
        the acknowledge bit is cleared: a stop must not acknowledge anything."""
        mask, value = bits
        return (word & ~mask | value) & ~self.acknowledge_mask & 0xFFFF | self._valid_mask


class StatusWords:
    """Decoder of one family's status words."""

    def __init__(self, model: StatusWord) -> None:
        self._states = tuple(
            (*pattern_bits(state.pattern), DriveState[state.name.upper()]) for state in model.state
        )
        self._fault_mask, self._fault_value = next(
            (mask, value) for mask, value, state in self._states if state is DriveState.FAULT
        )
        self._relevant = 0
        for mask, _, _ in self._states:
            self._relevant |= mask
        self._holding = None if model.holding is None else pattern_bits(model.holding)
        self._decoded: dict[int, DriveState] = {}

    def state(self, word: int) -> DriveState:
        """The first state whose pattern ``word`` matches. Each combination is looked up once."""
        bits = word & self._relevant
        state = self._decoded.get(bits)
        if state is None:
            state = self._decoded[bits] = self._look_up(bits)
        return state

    def _look_up(self, bits: int) -> DriveState:
        for mask, value, state in self._states:
            if bits & mask == value:
                return state
        return DriveState.UNKNOWN

    def holds(self, word: int) -> bool:
        """Whether a drive that reports *operation enabled* is at standstill and may be holding its motor."""
        return self._holding is not None and word & self._holding[0] == self._holding[1]

    def as_fault(self, word: int) -> int:
        """``word`` showing the state *fault*, all other bits as they are."""
        return word & ~self._fault_mask | self._fault_value
