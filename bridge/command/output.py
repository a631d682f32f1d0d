"""What goes to the drive: the owner's words, or a stop in their place.

The one gate between the controllers and the bus. Nothing that enables a drive gets past it while the
watchdog has tripped, the restart interlock is set or the drive's node is not there.
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
    """One drive's way out. Times are monotonic seconds."""

    def __init__(self, words: ControlWords, setpoints: int, reaction: Reaction, then_silence_ms: int) -> None:
        self._words = words
        self._reaction: Reaction = reaction
        self._then_silence_s = then_silence_ms / 1000
        self._setpoints = setpoints
        self._tripped_at: float | None = None
        self._acknowledge_until: float | None = None
        self._quick_stop_done = False
        self.control_word = words.stopped
        """The owner's control word, as it would like it."""
        self.setpoints: tuple[int, ...] = (0,) * setpoints
        self.interlocked = True
        self.sent = Output((words.stopped, *self.setpoints))

    @property
    def silence_at(self) -> float | None:
        """When a tripped drive is no longer addressed, or None."""
        if self._tripped_at is None or self._reaction == "hold":
            return None
        if self._reaction == "silence":
            return self._tripped_at
        return self._tripped_at + self._then_silence_s if self._then_silence_s else None

    def take(self, control_word: int | None, setpoints: tuple[int, ...], *, may_enable: bool) -> None:
        """A telegram of the owner. A control word that does not enable opens the interlock."""
        self.setpoints = setpoints
        if control_word is None:
            return
        self._acknowledge_until = None
        self.control_word = control_word
        if not self._words.enables(control_word) and may_enable and self._tripped_at is None:
            self.interlocked = False

    def stop(self, control_word: int) -> None:
        """Stop with this word in place of the owner's, and wait for a fresh enable."""
        self.control_word = control_word
        self.setpoints = (0,) * self._setpoints
        self.interlocked = True

    def trip(self, now: float) -> None:
        self._tripped_at = now
        self._quick_stop_done = False
        if self._reaction != "hold":
            self.setpoints = (0,) * self._setpoints

    def clear(self, now: float, *, pulse: bool) -> None:
        """Leave the trip, stopped. With ``pulse`` an acknowledge edge is sent to the drive."""
        if self._tripped_at is not None:
            self._tripped_at = None
            self.stop(self._words.stopped)
        if pulse:
            self._acknowledge_until = now + _ACKNOWLEDGE_PULSE_S

    def on_state(self, state: DriveState) -> None:
        """The drive reported this state; a quick stop that has ended is followed by disable voltage."""
        if self._tripped_at is not None and state not in MOVING and state is not DriveState.UNKNOWN:
            self._quick_stop_done = True

    def next_deadline(self, now: float) -> float | None:
        times = [t for t in (self.silence_at, self._acknowledge_until) if t is not None and t > now]
        return min(times) if times else None

    def compute(self, now: float, *, may_enable: bool) -> Output:
        """What the drive gets from now on; also kept as ``sent``."""
        self.sent = self._compute(now, may_enable)
        return self.sent

    def _compute(self, now: float, may_enable: bool) -> Output:
        zero = (0,) * self._setpoints
        if self._tripped_at is not None and self._reaction != "hold":
            silence_at = self.silence_at
            silent = silence_at is not None and now >= silence_at
            return Output((self._reaction_word(), *zero), silent)
        if self._tripped_at is not None:  # "hold": go on as before, unless the drive itself is gone
            word = self.sent.words[0]
            if may_enable or not self._words.enables(word):
                return self.sent
            return Output((self._words.stop(word), *zero))
        word = self.control_word
        blocked = not may_enable or self.interlocked
        if blocked and self._words.enables(word):
            word = self._words.stop(word) | word & self._words.acknowledge_mask
        if self._acknowledge_until is not None and now < self._acknowledge_until:
            word |= self._words.acknowledge_mask
        return Output((word, *(zero if blocked else self.setpoints)))

    def _reaction_word(self) -> int:
        word = self.sent.words[0]
        if self._reaction == "stop":
            return self._words.stop(word)
        if self._reaction == "quick_stop" and not self._quick_stop_done:
            return self._words.quick_stop(word)
        return self._words.disable_voltage(word)
