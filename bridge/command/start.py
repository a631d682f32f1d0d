"""``Start``: one request that leads a drive through its states to *operation enabled*."""

from __future__ import annotations

from typing import Final

from bridge.command.output import Gate
from bridge.command.request import DONE, Code, Outcome, Reply
from bridge.drive import FAULTED, ControlWords, DriveState

_LIMIT_S: Final = 3.0
_CAN_BE_ENABLED: Final = (DriveState.READY, DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED)


class StartSequence:
    """At most one start at a time; each one's outcome is handed to ``conclude`` exactly once."""

    __slots__ = ("_control_word", "_deadline", "_gate", "_outcomes", "_reply", "_words")

    def __init__(self, words: ControlWords, gate: Gate, outcomes: list[tuple[Reply, Outcome]]) -> None:
        self._words = words
        self._gate = gate
        self._outcomes = outcomes
        self._reply: Reply | None = None
        self._control_word = 0
        self._deadline = 0.0

    @property
    def is_going_on(self) -> bool:
        return self._reply is not None

    def begin(self, direction_bits: int, state: DriveState, now: float, reply: Reply) -> None:
        """Start; the drive may be enabled and has no fault."""
        self.end(Outcome(Code.CANCELLED, "started anew"))
        self._reply = reply
        self._control_word = self._words.run | direction_bits
        self._deadline = now + _LIMIT_S
        if state is not DriveState.OPERATION_ENABLED or self._gate.interlocked:
            self._gate.take(self._words.ready, self._gate.setpoints, may_enable=True)
        self.on_state(state)

    def on_state(self, state: DriveState, fault_text: str = "") -> None:
        """The drive is in this state: take the next step."""
        if self._reply is None:
            return
        if state in FAULTED:
            self._give_up(Code.NOT_READY, f"the drive went into fault: {fault_text}")
            return
        if state in _CAN_BE_ENABLED:
            self._gate.take(self._control_word, self._gate.setpoints, may_enable=True)
        if state is DriveState.OPERATION_ENABLED:
            if self._words.begin:
                word = self._control_word | self._words.begin
                self._gate.take(word, self._gate.setpoints, may_enable=True)
            self.end(DONE)

    def on_time(self, state: DriveState, now: float) -> None:
        if self._reply is not None and now >= self._deadline:
            label = state.label.replace("_", " ")
            self._give_up(Code.TIMED_OUT, f"the drive did not start, it is {label}")

    def next_deadline(self) -> float | None:
        return None if self._reply is None else self._deadline

    def _give_up(self, code: Code, message: str) -> None:
        self._gate.stop(self._words.ready)
        self.end(Outcome(code, message))

    def end(self, outcome: Outcome) -> None:
        """End a start that is going on with this outcome; the words stay as they are."""
        reply, self._reply = self._reply, None
        if reply is not None:
            self._outcomes.append((reply, outcome))
