"""State machine of a NORD inverter as a table (BU 2500 §6.5.3)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final


class NordState(Enum):
    """States A…H; the value is what they put into bits 6 and 3…0 of the status word."""

    NOT_READY = "A"
    SWITCH_ON_INHIBITED = "B"
    READY = "C"
    SWITCHED_ON = "D"
    ENABLED = "E"
    QUICK_STOP = "F"
    FAULT_REACTION = "G"
    FAULT = "H"


STATE_BITS: Final = {
    NordState.NOT_READY: 0x00,
    NordState.SWITCH_ON_INHIBITED: 0x40,
    NordState.READY: 0x01,
    NordState.SWITCHED_ON: 0x03,
    NordState.ENABLED: 0x07,
    NordState.QUICK_STOP: 0x07,
    NordState.FAULT_REACTION: 0x0F,
    NordState.FAULT: 0x08,
}


@dataclass(frozen=True, slots=True)
class NordCommand:
    """A steering command: the control word bits in ``mask`` must be those of ``pattern``."""

    mask: int
    pattern: int

    def matches(self, control_word: int) -> bool:
        return control_word & self.mask == self.pattern


SHUT_DOWN: Final = NordCommand(0x07, 0x06)
SWITCH_ON: Final = NordCommand(0x07, 0x07)
ENABLE: Final = NordCommand(0x7F, 0x7F)
DISABLE_OPERATION: Final = NordCommand(0x0F, 0x07)
DISABLE_VOLTAGE: Final = NordCommand(0x02, 0x00)
QUICK_STOP: Final = NordCommand(0x06, 0x02)


@dataclass(frozen=True, slots=True)
class Transition:
    """One commanded transition. ``at_standstill``: the drive ramps down first, in the state it is in."""

    number: int
    source: NordState
    target: NordState
    command: NordCommand
    at_standstill: bool = False


# The patterns of one state exclude each other, so the priorities of §6.5.1 (disable voltage, quick stop,
# bit 0 = 0, enable, bit 3 = 0) need no order here. 1, 13 and 14 happen by themselves; 15 needs an edge.
TRANSITIONS: Final = (
    Transition(2, NordState.SWITCH_ON_INHIBITED, NordState.READY, SHUT_DOWN),
    Transition(3, NordState.READY, NordState.SWITCHED_ON, SWITCH_ON),
    Transition(4, NordState.SWITCHED_ON, NordState.ENABLED, ENABLE),
    Transition(5, NordState.ENABLED, NordState.SWITCHED_ON, DISABLE_OPERATION),
    Transition(6, NordState.SWITCHED_ON, NordState.READY, SHUT_DOWN),
    Transition(7, NordState.READY, NordState.SWITCH_ON_INHIBITED, DISABLE_VOLTAGE),
    Transition(7, NordState.READY, NordState.SWITCH_ON_INHIBITED, QUICK_STOP),
    Transition(8, NordState.ENABLED, NordState.READY, SHUT_DOWN, at_standstill=True),
    Transition(9, NordState.ENABLED, NordState.SWITCH_ON_INHIBITED, DISABLE_VOLTAGE),
    Transition(10, NordState.SWITCHED_ON, NordState.SWITCH_ON_INHIBITED, DISABLE_VOLTAGE),
    Transition(10, NordState.SWITCHED_ON, NordState.SWITCH_ON_INHIBITED, QUICK_STOP),
    Transition(11, NordState.ENABLED, NordState.QUICK_STOP, QUICK_STOP),
    Transition(12, NordState.QUICK_STOP, NordState.SWITCH_ON_INHIBITED, DISABLE_VOLTAGE),
)


_FROM: Final = {state: tuple(one for one in TRANSITIONS if one.source is state) for state in NordState}


def commanded(state: NordState, control_word: int) -> Transition | None:
    """The transition that this control word asks for in this state."""
    for transition in _FROM[state]:
        if transition.command.matches(control_word):
            return transition
    return None
