"""Control and status words of a drive family, compiled from its mapping file.

No vendor and no drive is named here: what a bit does is in ``mappings/``.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from bridge.mapping.model import Command, ControlWord, StatusWord, pattern_bits


class DriveState(IntEnum):
    """State of the drive's state machine, numbered as Modbus serves it (input register 10)."""

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


STATES: Final = tuple((state.value, state.label) for state in DriveState)

MOVING: Final = frozenset(
    (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT_REACTION_ACTIVE)
)
FAULTED: Final = frozenset((DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE))


class ControlWords:
    """What a control word of this family means and how one is changed. Words are 16-bit integers."""

    __slots__ = (
        "acknowledge_mask",
        "disable_voltage_",
        "enable_mask",
        "enable_value",
        "forward",
        "quick_stop_",
        "ready",
        "reverse",
        "run",
        "stop_",
        "stopped",
        "valid_mask",
    )

    def __init__(self, model: ControlWord) -> None:
        self.enable_mask = model.enabling.mask
        self.enable_value = model.enabling.value
        self.valid_mask = 0 if model.valid_bit is None else 1 << model.valid_bit
        self.acknowledge_mask = 1 << model.acknowledge_bit
        self.stopped = model.stopped
        self.ready = model.ready
        self.run = model.run
        self.forward = model.forward
        self.reverse = model.reverse
        self.stop_ = model.stop
        self.quick_stop_ = model.quick_stop
        self.disable_voltage_ = model.disable_voltage

    def enables(self, word: int) -> bool:
        return word & self.enable_mask == self.enable_value

    def is_valid(self, word: int) -> bool:
        return word & self.valid_mask == self.valid_mask

    def acknowledges(self, before: int, after: int) -> bool:
        """Whether the acknowledge bit rises from one word to the next."""
        return bool(after & ~before & self.acknowledge_mask)

    def stop(self, word: int) -> int:
        return self._apply(self.stop_, word)

    def quick_stop(self, word: int) -> int:
        return self._apply(self.quick_stop_, word)

    def disable_voltage(self, word: int) -> int:
        return self._apply(self.disable_voltage_, word)

    def _apply(self, command: Command, word: int) -> int:
        """``word`` with the command's bits. What is not about moving stays (parameter set, functions),
        but the acknowledge bit falls: a stop must not acknowledge anything."""
        return (word & ~command.mask | command.value) & ~self.acknowledge_mask & 0xFFFF | self.valid_mask


class StatusWords:
    """Decodes status words of this family."""

    __slots__ = ("_fault_mask", "_fault_value", "_states")

    def __init__(self, model: StatusWord) -> None:
        self._states = tuple(
            (*pattern_bits(state.pattern), DriveState[state.name.upper()]) for state in model.state
        )
        self._fault_mask, self._fault_value = next(
            (mask, value) for mask, value, state in self._states if state is DriveState.FAULT
        )

    def state(self, word: int) -> DriveState:
        for mask, value, state in self._states:
            if word & mask == value:
                return state
        return DriveState.UNKNOWN

    def as_fault(self, word: int) -> int:
        """``word`` showing the state *fault*, all other bits as they are."""
        return word & ~self._fault_mask | self._fault_value
