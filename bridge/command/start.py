"""``Start``: one request that leads a drive through its states to *operation enabled*."""

from __future__ import annotations

from typing import Final

from bridge.command.output import Gate
from bridge.command.request import DONE, Code, Outcome, Reply
from bridge.drive import FAULTED, ControlWords, DriveState

_LIMIT_S: Final = 3.0
_QUICK_STOP_S: Final = 1.0
"""How long a quick stop may still take. A drive that stays in it afterwards (605Ah = 5 … 8) leaves it with
disable voltage only; at once, that would let a motor coast that is still being stopped."""
_SETTLE_S: Final = 0.2
"""How long what a drive says may be from before a stop. One that says "enabled" later than that is on its
ramp, or is held."""
_BELIEVED_S: Final = 1.0
"""Without a word from a drive that sends only changes, what it said last is believed after this time."""
_CAN_BE_ENABLED: Final = (DriveState.READY, DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED)


class StartSequence:
    """At most one start at a time; each one's outcome is handed to ``conclude`` exactly once."""

    __slots__ = (
        "_believed_at",
        "_believes_from",
        "_control_word",
        "_deadline",
        "_gate",
        "_is_known",
        "_is_late",
        "_is_leaving",
        "_is_led",
        "_leaves_at",
        "_outcomes",
        "_reply",
        "_words",
    )

    def __init__(self, words: ControlWords, gate: Gate, outcomes: list[tuple[Reply, Outcome]]) -> None:
        self._words = words
        self._gate = gate
        self._outcomes = outcomes
        self._reply: Reply | None = None
        self._control_word = 0
        self._deadline = 0.0
        self._leaves_at: float | None = None
        """While the drive is in its quick stop: when it is led out of it."""
        self._believes_from: float | None = None
        """While what the drive has said may be out of date: from when on its reports are believed."""
        self._believed_at: float | None = None
        """When its last one is, though nothing came."""
        self._is_known = True
        """The drive has said something since its node is operational."""
        self._is_led = False
        """One that has not is made ready."""
        self._is_late = False
        """It may follow the last word that enabled it, after the stop that came since."""
        self._is_leaving = False
        """It is being led out of it."""

    @property
    def is_going_on(self) -> bool:
        return self._reply is not None

    @property
    def awaits_report(self) -> bool:
        """What the drive says next counts, also where it says nothing new."""
        return self._believes_from is not None

    def begin(
        self, direction_bits: int, state: DriveState, now: float, reply: Reply, *, is_known: bool = True
    ) -> None:
        """Start; the drive may be enabled and has no fault. ``is_known``: it has said so since its node is
        operational."""
        before = self._believes_from, self._believed_at, self._leaves_at, self._is_led
        self.end(Outcome(Code.CANCELLED, "started anew"))
        believes_from, believed_at, leaves_at, is_led = before
        self._reply = reply
        self._control_word = self._words.run | direction_bits
        self._deadline = now + _LIMIT_S
        self._is_leaving = False
        self._is_known = is_known
        self._is_led = is_led and not is_known
        self._is_late = self._gate.may_follow_late
        is_enabled = state is DriveState.OPERATION_ENABLED
        is_stopped = self._gate.is_stopping and (is_enabled or self._is_late)
        if is_stopped or not is_known:
            self._believes_from = believes_from or now + (_SETTLE_S if is_known else 0.0)
            self._believed_at = believed_at or now + _BELIEVED_S
        if self.awaits_report or state is DriveState.QUICK_STOP_ACTIVE:
            # What stops it goes on until it is known to be over: to become ready may mean to coast.
            self._leaves_at = leaves_at or now + _QUICK_STOP_S
            self._gate.lead(self._gate.word_at_rest)
            return
        if not is_enabled:
            self._gate.lead(self._words.ready)
        self.on_state(state, now)

    def on_report(self, state: DriveState, now: float) -> None:
        """A report of the drive, while one is awaited: it is in this state, as it was before."""
        if self._believes_from is not None and now >= self._believes_from:
            self._believe(state)

    def on_state(self, state: DriveState, now: float, fault_text: str = "") -> None:
        """The drive is in this state now: take the next step."""
        if self._reply is None or state is DriveState.UNKNOWN:
            return
        if state in FAULTED:
            self._give_up(Code.NOT_READY, f"the drive went into fault: {fault_text}")
        elif self._believes_from is None:
            self._go_on(state)
        elif not self._may_be_old(state, now):
            self._believe(state)

    def _may_be_old(self, state: DriveState, now: float) -> bool:
        """While a stop is on its way: what the drive says now may still come from the enable before it."""
        if not self._is_known:
            return False
        is_early = self._believes_from is not None and now < self._believes_from
        return state is DriveState.OPERATION_ENABLED or (
            self._is_late and is_early and state in _CAN_BE_ENABLED
        )

    def _believe(self, state: DriveState) -> None:
        if state is DriveState.UNKNOWN:
            return
        self._believes_from = self._believed_at = None
        if state is not DriveState.QUICK_STOP_ACTIVE:
            self._leaves_at = None
            self._gate.lead(self._words.ready)
        self._go_on(state)

    def _believe_without_report(self, state: DriveState, now: float) -> None:
        """The drive has said nothing in time. Of one that has said nothing since its node is operational
        nothing is believed: it is made ready and then enabled, and has to say that it is."""
        self._believed_at = None
        if self._is_known:
            self._believe(state)
        elif not self._is_led:
            self._is_led = True
            self._leaves_at = None
            self._gate.lead(self._words.ready)
            self._believed_at = now + _BELIEVED_S
        else:
            self._gate.lead(self._control_word)

    def _go_on(self, state: DriveState) -> None:
        if state is not DriveState.QUICK_STOP_ACTIVE and (self._is_leaving or self._leaves_at is not None):
            self._is_leaving = False
            self._leaves_at = None
            self._gate.lead(self._words.ready)
        if state in _CAN_BE_ENABLED:
            self._gate.lead(self._control_word)
        elif state is DriveState.SWITCH_ON_INHIBITED:
            # Where a stop was on its way, what was known of the drive was out of date.
            self._gate.lead(self._words.ready)
        if state is DriveState.OPERATION_ENABLED:
            if self._words.begin:
                self._gate.lead(self._control_word | self._words.begin)
            self.end(DONE)

    def on_time(self, state: DriveState, now: float) -> None:
        if self._reply is None:
            return
        if now >= self._deadline:
            label = state.label.replace("_", " ")
            self._give_up(Code.TIMED_OUT, f"the drive did not start, it is {label}")
            return
        if self._believed_at is not None and now >= self._believed_at:
            self._believe_without_report(state, now)
        if self._leaves_at is not None and now >= self._leaves_at:
            self._leaves_at = None
            if state is DriveState.QUICK_STOP_ACTIVE:
                self._is_leaving = True
                self._gate.lead(self._words.disable_voltage(self._words.ready))

    def next_deadline(self) -> float | None:
        """When ``on_time`` is to be called."""
        if self._reply is None:
            return None
        times = (self._believed_at, self._leaves_at, self._deadline)
        return min(time for time in times if time is not None)

    def _give_up(self, code: Code, message: str) -> None:
        self._gate.stop(self._gate.word_at_rest)
        self.end(Outcome(code, message))

    def end(self, outcome: Outcome) -> None:
        """End a start that is going on with this outcome; the words stay as they are."""
        reply, self._reply = self._reply, None
        self._believes_from = self._believed_at = self._leaves_at = None
        self._is_known, self._is_led, self._is_late = True, False, False
        if reply is not None:
            self._outcomes.append((reply, outcome))
