"""A drive's state machine as its family declares it, without a motor."""

from __future__ import annotations

from collections.abc import Callable

from bridge.mapping.model import Command, pattern_bits
from bridge.sim.generic.generic_plan import AxisPlan

_ENABLED = "operation_enabled"


class GenericAxis:
    """Takes control words and shows status words. Without inertia: every state is reached at once."""

    def __init__(self, plan: AxisPlan, report: Callable[[int], None]) -> None:
        self.plan = plan
        self._report = report
        self._words = {
            state.name: pattern_bits(state.pattern)[1] for state in reversed(plan.status_word.state)
        }
        """The lowest word of each state."""
        self.state = self._rest
        self.control_word = 0
        self._written: int | None = None

    @property
    def is_enabled(self) -> bool:
        return self.state == _ENABLED

    @property
    def status_word(self) -> int:
        word = self._words[self.state]
        handshake = self.plan.control_word.handshake
        if handshake and self.is_enabled and self.control_word >> handshake.bit & 1:
            word |= 1 << handshake.acknowledge_bit
        return word

    def power_on(self) -> None:
        self.state, self.control_word, self._written = self._rest, 0, None

    def fail(self, code: int) -> None:
        self.state = "fault"
        self._report(code)

    def master_lost(self) -> None:
        """No word comes any more: no voltage."""
        if self.state != "fault":
            self.state = self._rest
            self.control_word = 0

    def write(self, part: int, shift: int, mask: int) -> None:
        """A part of the control word has come. It takes effect with ``obey``, after the rest of its PDO."""
        before = self.control_word if self._written is None else self._written
        self._written = before & ~(mask << shift) | (part & mask) << shift

    def obey(self) -> bool:
        """The PDO or the SDO request has been processed. Whether there was a control word in it."""
        word, self._written = self._written, None
        if word is not None:
            self._on_control_word(word)
        return word is not None

    def _on_control_word(self, word: int) -> None:
        control = self.plan.control_word
        if control.valid_bit is not None and not word >> control.valid_bit & 1:
            return
        rising, self.control_word = word & ~self.control_word, word
        if self.state == "fault":
            if rising >> control.acknowledge_bit & 1:
                self.state = self._rest
                self._report(0)
            return
        self.state = self._next(word)

    @property
    def _rest(self) -> str:
        """The state without voltage."""
        states = ("switch_on_inhibited", "ready", "not_ready", "switched_on")
        return next((state for state in states if state in self._words), _ENABLED)

    def _next(self, word: int) -> str:
        control, words = self.plan.control_word, self._words
        if word & control.enabling.mask == control.enabling.value:
            may = self.is_enabled or self.state != "switch_on_inhibited" or "ready" not in words
            return _ENABLED if may else self.state
        if _asks(word, control.disable_voltage) or _asks(word, control.quick_stop):
            return self._rest
        stopped = control.run & ~control.stop.mask | control.stop.value
        if "switched_on" in words and self.state != "switch_on_inhibited":
            mask = control.enabling.mask
            if (word ^ stopped) & mask == 0 and (stopped ^ control.ready) & mask:
                return "switched_on"
        return "ready" if "ready" in words and (word ^ control.stopped) else self._rest


def _asks(word: int, command: Command) -> bool:
    return word & command.mask == command.value
