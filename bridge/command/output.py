"""What goes to the drive: the owner's words, or a stop in their place.

The one gate between the controllers and the bus. Nothing that enables a drive gets past it while the
watchdog has tripped, the restart interlock is set or the drive's node is not there. A stop always does.
"""

from __future__ import annotations

from typing import NamedTuple

from bridge.config import Reaction
from bridge.drive import MOVING, ControlWords, DriveState

_ACKNOWLEDGE_PULSE_S = 0.1
"""How long a generated acknowledge edge stays on the bus: longer than any cycle we send with."""


class Output(NamedTuple):
    """Words of the RPDO, the control word first; ``silent``: send nothing at all."""

    words: tuple[int, ...]
    silent: bool = False


class Gate:
    """One drive's way out. Times are monotonic seconds; one that lies back counts as the latest known."""

    def __init__(self, words: ControlWords, setpoints: int, reaction: Reaction, then_silence_ms: int) -> None:
        self._words = words
        self._reaction: Reaction = reaction
        self._then_silence_s = then_silence_ms / 1000
        self._zero = (0,) * setpoints
        self._now = float("-inf")
        self._tripped_at: float | None = None
        self._held: Output | None = None
        """With the reaction "hold": what goes on being sent after a trip, until somebody stops the drive."""
        self._acknowledge_until: float | None = None
        self.awaits_rest = False
        """Tripped, and a quick stop is on its way that is followed by disable voltage."""
        self.control_word = words.stopped
        """The owner's control word, as it would like it."""
        self.setpoints = self._zero
        self.interlocked = True
        self.sent = Output((words.stopped, *self._zero))

    @property
    def _silence_at(self) -> float | None:
        """When a tripped drive is no longer addressed, or None."""
        if self._tripped_at is None or self._reaction == "hold":
            return None
        if self._reaction == "silence":
            return self._tripped_at
        return self._tripped_at + self._then_silence_s if self._then_silence_s else None

    def take(self, control_word: int | None, setpoints: tuple[int, ...], *, may_enable: bool) -> bool:
        """A telegram of the owner; True if it goes to the drive as it is.

        A control word that does not enable opens the interlock, or ends a "hold".
        """
        self.setpoints = setpoints
        if control_word is not None:
            self.control_word = control_word
        is_stop = control_word is not None and not self._words.enables(control_word)
        if self._tripped_at is not None:
            if is_stop:
                self._held = None
            return is_stop and self._reaction == "hold"
        if is_stop and may_enable:
            self.interlocked = False
        return is_stop or (may_enable and not self.interlocked)

    def stop(self, control_word: int) -> None:
        """Stop with this word in place of the owner's, and wait for a fresh enable."""
        self.control_word = control_word
        self.setpoints = self._zero
        self.interlocked = True
        self._held = None

    def trip(self, now: float) -> None:
        self._tripped_at = now
        self.awaits_rest = self._reaction == "quick_stop"
        if self._reaction == "hold":
            self._held = self.sent
        else:
            self.setpoints = self._zero

    def clear(self, now: float, *, pulse: bool) -> None:
        """Leave the trip, stopped. With ``pulse`` an acknowledge edge is sent to the drive."""
        if self._tripped_at is not None:
            self._tripped_at = None
            self.awaits_rest = False
            self.stop(self._at_rest(self.sent.words[0]))
        if pulse:
            self._acknowledge_until = now + _ACKNOWLEDGE_PULSE_S

    def _at_rest(self, word: int) -> int:
        """``word`` if it is a stop of some kind: an acknowledge turns no ramp into coasting."""
        return self._words.stop(word) if self._words.enables(word) else word & ~self._words.acknowledge_mask

    def on_state(self, state: DriveState) -> None:
        """The drive reported this state."""
        if state not in MOVING and state is not DriveState.UNKNOWN:
            self.awaits_rest = False

    def next_deadline(self) -> float | None:
        """When what is sent changes by itself, beyond what ``compute`` has seen."""
        times = [t for t in (self._silence_at, self._acknowledge_until) if t is not None and t > self._now]
        return min(times) if times else None

    def compute(self, now: float, *, may_enable: bool) -> Output:
        """What the drive gets from now on; also kept as ``sent``."""
        self._now = max(now, self._now)
        self.sent = self._compute(may_enable)
        return self.sent

    def _compute(self, may_enable: bool) -> Output:
        if self._tripped_at is not None and self._reaction != "hold":
            silence_at = self._silence_at
            silent = silence_at is not None and self._now >= silence_at
            return Output((self._reaction_word(), *self._zero), silent)
        if self._held is not None:
            if may_enable or not self._words.enables(self._held.words[0]):
                return self._held
            self._held = None
        word = self.control_word
        blocked = not may_enable or self.interlocked or self._tripped_at is not None
        if blocked and self._words.enables(word):
            word = self._words.stop(word) | word & self._words.acknowledge_mask
        if self._acknowledge_until is not None and self._now < self._acknowledge_until:
            word |= self._words.acknowledge_mask
        return Output((word, *(self._zero if blocked else self.setpoints)))

    def _reaction_word(self) -> int:
        word = self.sent.words[0]
        if self._reaction == "stop":
            return self._words.stop(word)
        if self.awaits_rest:
            return self._words.quick_stop(word)
        return self._words.disable_voltage(word)
