"""The finite state automaton of a drive with CiA 402 (IEC 61800-7-201): states, commands, transitions.

Transitions are numbered as the standard does. If an option code lets the drive stop first, the transition is
taken at standstill; ``Automaton.leaving`` is true until then.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import Enum, IntEnum
from typing import Final

SWITCH_ON: Final = 0x0001
ENABLE_VOLTAGE: Final = 0x0002
QUICK_STOP: Final = 0x0004
ENABLE_OPERATION: Final = 0x0008
FAULT_RESET: Final = 0x0080
HALT: Final = 0x0100

QUICK_STOP_OPTION: Final = 0x605A
SHUTDOWN_OPTION: Final = 0x605B
DISABLE_OPTION: Final = 0x605C
HALT_OPTION: Final = 0x605D
FAULT_OPTION: Final = 0x605E


class Cia402State(IntEnum):
    """The value is that of bits 0 … 3, 5 and 6 of the status word."""

    NOT_READY = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY = 0x21
    SWITCHED_ON = 0x23
    ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION = 0x0F
    FAULT = 0x08


class Cia402Command(Enum):
    """Commands in bits 0 … 3 of the control word."""

    SHUTDOWN = "shutdown"
    SWITCH_ON = "switch on, disable operation"
    ENABLE_OPERATION = "enable operation"
    DISABLE_VOLTAGE = "disable voltage"
    QUICK_STOP = "quick stop"


class StopRamp(Enum):
    """Ways in which the motor comes to a standstill."""

    COAST = "coast"
    SLOW_DOWN = "slow down"
    QUICK = "quick stop"


TRANSITIONS: Final = {
    (Cia402State.SWITCH_ON_DISABLED, Cia402Command.SHUTDOWN): (2, Cia402State.READY),
    (Cia402State.READY, Cia402Command.SWITCH_ON): (3, Cia402State.SWITCHED_ON),
    # "Enable operation" in "ready" takes transition 3 and then 4.
    (Cia402State.READY, Cia402Command.ENABLE_OPERATION): (3, Cia402State.SWITCHED_ON),
    (Cia402State.READY, Cia402Command.QUICK_STOP): (7, Cia402State.SWITCH_ON_DISABLED),
    (Cia402State.READY, Cia402Command.DISABLE_VOLTAGE): (7, Cia402State.SWITCH_ON_DISABLED),
    (Cia402State.SWITCHED_ON, Cia402Command.ENABLE_OPERATION): (4, Cia402State.ENABLED),
    (Cia402State.SWITCHED_ON, Cia402Command.SHUTDOWN): (6, Cia402State.READY),
    (Cia402State.SWITCHED_ON, Cia402Command.DISABLE_VOLTAGE): (10, Cia402State.SWITCH_ON_DISABLED),
    (Cia402State.SWITCHED_ON, Cia402Command.QUICK_STOP): (10, Cia402State.SWITCH_ON_DISABLED),
    (Cia402State.ENABLED, Cia402Command.SWITCH_ON): (5, Cia402State.SWITCHED_ON),
    (Cia402State.ENABLED, Cia402Command.SHUTDOWN): (8, Cia402State.READY),
    (Cia402State.ENABLED, Cia402Command.DISABLE_VOLTAGE): (9, Cia402State.SWITCH_ON_DISABLED),
    (Cia402State.ENABLED, Cia402Command.QUICK_STOP): (11, Cia402State.QUICK_STOP_ACTIVE),
    (Cia402State.QUICK_STOP_ACTIVE, Cia402Command.DISABLE_VOLTAGE): (12, Cia402State.SWITCH_ON_DISABLED),
    (Cia402State.QUICK_STOP_ACTIVE, Cia402Command.ENABLE_OPERATION): (16, Cia402State.ENABLED),
}
"""Transitions by state and command. 0, 1, 13, 14 and 15 depend on no command."""


def command_of(control_word: int) -> Cia402Command:
    """The command in a control word (disable voltage: xx0x; quick stop: x01x)."""
    if not control_word & ENABLE_VOLTAGE:
        return Cia402Command.DISABLE_VOLTAGE
    if not control_word & QUICK_STOP:
        return Cia402Command.QUICK_STOP
    if not control_word & SWITCH_ON:
        return Cia402Command.SHUTDOWN
    return Cia402Command.ENABLE_OPERATION if control_word & ENABLE_OPERATION else Cia402Command.SWITCH_ON


def ramp_of(option: int) -> StopRamp:
    """The ramp for an option code of 605Ah … 605Eh. 3 and 4 (at the current or voltage limit) brake like the
    quick stop."""
    if option == 0:
        return StopRamp.COAST
    return StopRamp.SLOW_DOWN if option in (1, 5) else StopRamp.QUICK


class Automaton:
    """The state of one drive. ``options`` are 605Ah … 605Eh by their index."""

    def __init__(self, options: Callable[[], Mapping[int, int]]) -> None:
        self._options = options
        self.state = Cia402State.NOT_READY
        self.control_word = 0
        self.leaving: Cia402Command | None = None
        self.taken: list[int] = []
        """Numbers of the last transitions, the newest last."""
        self._lasting = False

    @property
    def _stays_in_quick_stop(self) -> bool:
        """605Ah = 5 … 8: the drive stands still in "quick stop active"."""
        return self._options()[QUICK_STOP_OPTION] >= 5

    @property
    def ramp(self) -> StopRamp | None:
        """Ramp on which the motor is being stopped; None while it follows its mode."""
        options = self._options()
        match self.state:
            case Cia402State.ENABLED:
                if self.leaving is Cia402Command.SHUTDOWN:
                    return ramp_of(options[SHUTDOWN_OPTION])
                if self.leaving is Cia402Command.SWITCH_ON:
                    return ramp_of(options[DISABLE_OPTION])
                return ramp_of(options[HALT_OPTION]) if self.control_word & HALT else None
            case Cia402State.QUICK_STOP_ACTIVE:
                return ramp_of(options[QUICK_STOP_OPTION])
            case Cia402State.FAULT_REACTION:
                return ramp_of(options[FAULT_OPTION])
            case _:
                return StopRamp.COAST

    def power_on(self) -> None:
        """Transition 0."""
        self.state, self.control_word, self.leaving, self._lasting = Cia402State.NOT_READY, 0, None, False
        self.taken = [0]

    def initialised(self) -> None:
        """Transition 1."""
        if self.state is Cia402State.NOT_READY:
            self._go(1, Cia402State.SWITCH_ON_DISABLED)

    def on_control_word(self, word: int, *, standstill: bool) -> bool:
        """A control word came. True if its edge resets a fault (transition 15)."""
        rising = word & ~self.control_word
        self.control_word = word
        is_reset = bool(rising & FAULT_RESET) and self.state is Cia402State.FAULT and not self._lasting
        if is_reset:
            self._go(15, Cia402State.SWITCH_ON_DISABLED)
        self.settle(standstill=standstill)
        return is_reset

    def fault(self, *, lasting: bool) -> None:
        """Transition 13. A ``lasting`` cause blocks the reset until ``cause_gone``."""
        self._lasting = self._lasting or lasting
        if self.state not in (Cia402State.FAULT, Cia402State.FAULT_REACTION):
            self._go(13, Cia402State.FAULT_REACTION)

    def cause_gone(self) -> None:
        self._lasting = False

    def settle(self, *, standstill: bool) -> None:
        """Take every transition that is due; called with each control word and while the motor stops."""
        if self.state is Cia402State.FAULT_REACTION and (standstill or self.ramp is StopRamp.COAST):
            self._go(14, Cia402State.FAULT)
        if self.state is Cia402State.QUICK_STOP_ACTIVE and not self._stays_in_quick_stop:
            if standstill or command_of(self.control_word) is Cia402Command.DISABLE_VOLTAGE:
                self._go(12, Cia402State.SWITCH_ON_DISABLED)
            return
        for _ in range(2):  # "enable operation" may take two steps
            self._obey(command_of(self.control_word), standstill=standstill)
        if self.state is Cia402State.QUICK_STOP_ACTIVE and self.ramp is StopRamp.COAST:
            self._go(12, Cia402State.SWITCH_ON_DISABLED)

    def _obey(self, command: Cia402Command, *, standstill: bool) -> None:
        found = TRANSITIONS.get((self.state, command))
        self.leaving = None
        if found is None:
            return
        number, target = found
        if number == 16 and not self._stays_in_quick_stop:
            return
        if number in (5, 8):
            self.leaving = command
            if not standstill and self.ramp is not StopRamp.COAST:
                return
        self._go(number, target)

    def _go(self, number: int, target: Cia402State) -> None:
        self.state, self.leaving = target, None
        self.taken = [*self.taken[-31:], number]
