"""What goes to the drive: the owner's words, or a stop in their place.

The one gate between the controllers and the bus. Nothing that enables a drive gets past it while the
watchdog has tripped, the restart interlock is set or the drive's node is not there. A stop always does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from bridge.config import Reaction
from bridge.drive import FAULTED, MOVING, ControlWords, DriveState, Handshake

_ACKNOWLEDGE_PULSE_S: Final = 0.1
"""How long a generated acknowledge edge stays on the bus: longer than any cycle we send with."""
_QUICK_STOP_LIMIT_S: Final = 10.0
"""After that a quick stop by the watchdog is followed by disable voltage in any case: Lenze's holds the motor
for ever, and so does CiA 402's with 605Ah = 5 … 8."""


class Output(NamedTuple):
    """Words of the RPDO, the control word first; ``silent``: send nothing at all."""

    words: tuple[int, ...]
    silent: bool = False


class Gate:
    """One drive's way out. Times are monotonic seconds; one that lies back counts as the latest known.

    ``follows`` has the places of setpoints that are the drive's actual words, and those of these words, as
    long as nothing is commanded: enabling moves nothing then. ``handshake`` takes over positions.
    """

    def __init__(
        self,
        words: ControlWords,
        setpoints: int,
        reaction: Reaction,
        then_silence_ms: int,
        follows: Sequence[tuple[int, int]] = (),
        handshake: Handshake | None = None,
    ) -> None:
        self._words = words
        self._reaction: Reaction = reaction
        self._then_silence_s = then_silence_ms / 1000
        self.silence_stops = True
        """The drive stops by itself without its RPDOs. Where it does not, or nobody knows, it gets disable
        voltage in place of silence."""
        self._follows = tuple(follows)
        self._followed = frozenset(source for _, source in self._follows)
        self._handshake = handshake
        self._is_enabled = False
        self._is_in_fault = False
        self._has_moved = True
        """The drive has said that it follows the last word that enabled it: what it said before that does not
        say that it rests."""
        self._rests = False
        """After that it has said that it is not enabled, and nothing that enables was sent anew since."""
        self._is_ours = True
        """The control word is a stop by the bridge, not the owner's."""
        self._is_asked = False
        """The stop in force is one that somebody has asked for: it stays as it is."""
        self._status_word = 0
        self.rest: tuple[int, ...] = (0,) * setpoints
        """The setpoints of a drive that nobody commands."""
        self._now = float("-inf")
        self._tripped_at: float | None = None
        self._held: Output | None = None
        """With the reaction "hold": what goes on being sent after a trip, until somebody stops the drive."""
        self._acknowledge_until: float | None = None
        self._rest_limit: float | None = None
        """Tripped, and a quick stop is on its way: by then at the latest disable voltage follows."""
        self.control_word = words.stopped
        """The owner's control word, as it would like it."""
        self.setpoints = self.rest
        self.interlocked = True
        self.sent = Output((words.stopped, *self.rest))

    @property
    def reaction(self) -> Reaction:
        """What a trip leads to at first."""
        in_vain = self._reaction == "silence" and not self.silence_stops
        return "disable_voltage" if in_vain else self._reaction

    @property
    def _silence_at(self) -> float | None:
        """When a tripped drive is no longer addressed, or None."""
        if self._tripped_at is None or self._reaction == "hold":
            return None
        if self._reaction == "silence":
            return self._tripped_at
        return self._tripped_at + self._then_silence_s if self._then_silence_s else None

    @property
    def awaits_rest(self) -> bool:
        """The drive is to come to rest, and gets disable voltage then."""
        return self._rest_limit is not None

    @property
    def is_stopping(self) -> bool:
        """What is sent, or is about to be, does not enable the drive."""
        return self.interlocked or not self._words.enables(self.sent.words[0])

    @property
    def may_follow_late(self) -> bool:
        """The drive has not said yet that it follows the last word that enabled it."""
        return not self._has_moved

    @property
    def _is_commanded(self) -> bool:
        """The drive is enabled, and what it gets does not stop it."""
        return self._is_enabled and self._words.enables(self.sent.words[0])

    @property
    def awaits_actual(self) -> frozenset[int]:
        """The actual words without which the drive must not be enabled now: its setpoints follow them."""
        return frozenset() if self._is_commanded else self._followed

    def follow(self, actual: Sequence[int]) -> bool:
        """The drive's actual words, the status word first. True where that changes what is to be sent."""
        if not self._follows:
            return False
        rest = list(self.rest)
        for place, source in self._follows:
            rest[place] = actual[source]
        self.rest = tuple(rest)
        before = self.setpoints
        self._keep_at_rest()
        return self.setpoints != before

    def _keep_at_rest(self) -> None:
        """What was written for a drive that is not enabled yet must not make it jump when it is."""
        if self._follows and not self._is_commanded:
            setpoints = list(self.setpoints)
            for place, _ in self._follows:
                setpoints[place] = self.rest[place]
            self.setpoints = tuple(setpoints)

    def take(
        self,
        control_word: int | None,
        setpoints: tuple[int, ...],
        *,
        may_enable: bool,
        position: bool = False,
    ) -> bool:
        """A telegram of the owner; True if it goes to the drive as it is. ``position``: it has the value
        that is handed over with a handshake.

        A control word that does not enable opens the interlock, or ends a "hold". What was ordered before
        it is not gone to any more, nor what comes with a stop of a running drive.
        """
        self.setpoints = setpoints
        self._keep_at_rest()
        is_stop = control_word is not None and not self._words.enables(control_word)
        if self._handshake is not None:
            if is_stop:
                self._handshake.reset()
            if position and not (is_stop and self._is_enabled):
                self._handshake.order(setpoints)
        if control_word is not None:
            self.control_word = control_word
            self._is_ours = False
        if self._tripped_at is not None:
            if is_stop:
                self._held = None
            return is_stop and self._reaction == "hold"
        if is_stop and may_enable:
            self.interlocked = False
        return is_stop or (may_enable and not self.interlocked)

    def lead(self, control_word: int) -> None:
        """The next word of a start, for a drive that may be enabled; what the owner has ordered stays."""
        self.control_word = control_word
        self._is_ours = False
        self._keep_at_rest()
        if not self._words.enables(control_word):
            self.interlocked = False

    def stop_as_asked(self, control_word: int) -> None:
        """A stop by a command, made from the word that is sent. A reaction of the watchdog goes on from it,
        too: after a ramp was begun, somebody may still disable the voltage."""
        self.stop(control_word, is_asked=True)
        self.sent = Output((control_word, *self.rest), self.sent.silent)

    def stop(self, control_word: int, *, is_asked: bool = False) -> None:
        """Stop with this word in place of the owner's, and wait for a fresh enable. ``is_asked``: by a
        command, and not because the bridge has to."""
        self.control_word = control_word
        self._is_ours = True
        self._is_asked = is_asked
        self._drop_setpoints()
        self.interlocked = True
        self._held = None

    def _drop_setpoints(self) -> None:
        self.setpoints = self.rest
        if self._handshake is not None:
            self._handshake.reset()

    def trip(self, now: float) -> None:
        self._tripped_at = now
        self._rest_limit = now + _QUICK_STOP_LIMIT_S if self._reaction == "quick_stop" else None
        if self._reaction == "hold":
            self._held = self.sent
        else:
            self._drop_setpoints()

    def clear(self, now: float, state: DriveState, *, pulse: bool) -> None:
        """Acknowledge: leave the trip, and stop what would go on after a fault of the drive itself. With
        ``pulse`` an acknowledge edge is sent to the drive."""
        is_tripped = self._tripped_at is not None
        self._tripped_at = self._rest_limit = None
        if is_tripped or (pulse and state in FAULTED):
            self.stop(self.word_at_rest)
        if pulse:
            self._acknowledge_until = now + _ACKNOWLEDGE_PULSE_S

    @property
    def word_at_rest(self) -> int:
        """What is sent if it is a stop of some kind: an acknowledge turns no ramp into coasting."""
        word = self.sent.words[0]
        return self._words.stop(word) if self._words.enables(word) else word & ~self._words.acknowledge_mask

    def on_state(self, state: DriveState) -> None:
        """The drive reported this state."""
        was_enabled, self._is_enabled = self._is_enabled, state is DriveState.OPERATION_ENABLED
        if self._handshake is not None and (state in FAULTED or (was_enabled and not self._is_enabled)):
            self._handshake.reset()
        self._is_in_fault = state is DriveState.FAULT
        if state in MOVING:
            self._has_moved = True
            # Said late, of a drive that has nothing to move it any more, it does not count.
            self._rests &= not self._words.enables(self.sent.words[0])
        elif state is not DriveState.UNKNOWN:
            self._rest_limit = None
            self._rests |= self._has_moved or self._is_in_fault

    def forget(self) -> None:
        """What the drive says from now on is from after all that it was told: its node has restarted, or the
        bus was gone."""
        self._has_moved = True

    def on_status_word(self, word: int) -> bool:
        """The drive's status word, before the state it says. True where one of its bits is waited for."""
        if self._handshake is None or word == self._status_word:
            return False
        self._status_word = word
        return True

    def take_untaken(self) -> bool:
        """Whether the drive has not taken a position in time; asked and forgotten."""
        return self._handshake is not None and self._handshake.take_untaken()

    def next_deadline(self) -> float | None:
        """When what is sent changes by itself, beyond what ``compute`` has seen."""
        times = [self._silence_at, self._acknowledge_until, self._rest_limit]
        if self._handshake is not None:
            times += self._handshake.next_deadlines()
        times = [time for time in times if time is not None and time > self._now]
        return min(times) if times else None

    def compute(self, now: float, *, may_enable: bool) -> Output:
        """What the drive gets from now on; also kept as ``sent``."""
        self._now = max(now, self._now)
        if self._handshake is not None and not may_enable:
            self._handshake.reset()
        if self._rest_limit is not None and self._now >= self._rest_limit:
            self._rest_limit = None
        was_enabling = self._words.enables(self.sent.words[0])
        self.sent = self._compute(may_enable)
        if self._handshake is not None:
            self._handshake.step(self.setpoints, self._status_word, self._now, enabled=self._is_commanded)
            self.sent = self._compute(may_enable)
        if self._words.enables(self.sent.words[0]):
            if not was_enabling:
                self._has_moved = self._is_enabled
                self._rests = False
            self._is_asked = False
        return self.sent

    def _compute(self, may_enable: bool) -> Output:
        if self._tripped_at is not None and self._reaction != "hold":
            silence_at = self._silence_at
            silent = silence_at is not None and self._now >= silence_at
            word = self._reaction_word(awaits_rest=self.awaits_rest)
            if silent and not self.silence_stops:
                return Output((self._words.disable_voltage(word), *self.rest))
            return Output((word, *self.rest), silent)
        if self._held is not None:
            if may_enable or not self._words.enables(self._held.words[0]):
                return self._held
            self._held = None
        word = self.control_word
        blocked = not may_enable or self.interlocked or self._tripped_at is not None
        is_ours = self._is_ours
        if blocked and self._words.enables(word):
            # The stop that is in force, by whomever: what the owner goes on writing does not weaken it.
            word = self.word_at_rest | word & self._words.acknowledge_mask
            is_ours = True
        if self._is_in_fault and word & self._words.acknowledge_mask:
            # It ends with the fault: what was asked for then would hold the motor after it.
            self._is_asked = False
        if is_ours and self._rests and not self._is_asked:
            word = self._words.withhold(word) | word & self._words.acknowledge_mask
        if self._acknowledge_until is not None and self._now < self._acknowledge_until:
            word |= self._words.acknowledge_mask
        if self._handshake is not None and self._words.enables(word):
            word |= self._handshake.bits
        return Output((word, *(self.rest if blocked else self.setpoints)))

    def if_tripped(self) -> Output | None:
        """What the drive would get if the watchdog tripped now; None where it goes on with what it has."""
        if self._reaction == "hold":
            return None
        word = self._reaction_word(awaits_rest=self._reaction == "quick_stop")
        return Output((word, *self.rest), silent=self.reaction == "silence")

    def if_left(self) -> Output:
        """What the drive would get if its owner went now."""
        return Output((self._words.stop(self.sent.words[0]), *self.rest))

    def _reaction_word(self, *, awaits_rest: bool) -> int:
        word = self.sent.words[0]
        if self._reaction != "stop" and not awaits_rest:
            return self._words.disable_voltage(word)
        stop = self._words.stop if self._reaction == "stop" else self._words.quick_stop
        return self._words.withhold(stop(word)) if self._rests else stop(word)
