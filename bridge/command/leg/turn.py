"""One step of the leg while it is made: the state, taken apart, what has come of it, and what is sent."""

from __future__ import annotations

from operator import attrgetter
from typing import Final

from bridge.command.leg import order
from bridge.command.leg.effect import Effect, Heard, Ignored, LetGo, StartEnded, Tell, Tripped
from bridge.command.leg.forwarded import Asked
from bridge.command.leg.settings import LegSettings
from bridge.command.leg.state import (
    BLOCKED,
    MAY_FOLLOW_LATE,
    MUTE,
    REACTING,
    RESTS,
    STARTING,
    LegState,
    Motion,
    Output,
    Owner,
    Stage,
    Timer,
    Trip,
)
from bridge.command.leg.table import TABLE, Deed, Stimulus
from bridge.command.messages.event import Kind
from bridge.command.messages.request import Code, Outcome
from bridge.config import Reaction
from bridge.drive import FAULTED, MOVING, ControlWords, DriveState
from bridge.text import Text

_ACKNOWLEDGE_PULSE_S: Final = 0.1
"""How long a generated acknowledge edge stays on the bus: longer than any cycle we send with."""
_BURST_S: Final = 0.1
"""How long a stop breaks the silence: as long, so that the drive has it for certain; then the drive's own
supervision goes on."""
_RAMP_LIMIT_S: Final = 10.0
"""After that a quick stop by the watchdog is followed by disable voltage in any case: Lenze's holds the motor
for ever, and so does CiA 402's with 605Ah = 5 … 8."""
_EXPIRED: Final[dict[Reaction, Stimulus]] = {
    "disable_voltage": Stimulus.EXPIRED_DISABLE,
    "stop": Stimulus.EXPIRED_DISABLE,
    "quick_stop": Stimulus.EXPIRED_QUICK_STOP,
    "silence": Stimulus.EXPIRED_SILENCE,
    "hold": Stimulus.EXPIRED_HOLD,
}

_values = attrgetter(*LegState._fields)


class Turn:
    """Made from a state, changed, and made a state again. The attributes are those of ``LegState``."""

    __slots__ = ("asked", "effects", "now", "settings", *LegState._fields)

    def __init__(self, settings: LegSettings, state: LegState, now: float) -> None:
        self.settings = settings
        self.now = now
        self.effects: list[Effect] = []
        self.asked: Asked | None = None
        """What a request asks of the bus: its answer is judged by that."""
        (
            self.way,
            self.timer,
            self.word,
            self.sent,
            self.setpoints,
            self.rest,
            self.stage,
            self.owner,
            self.edges,
            self.is_ours,
            self.is_asked,
            self.drive,
            self.is_taken,
            self.motion,
            self.start,
            self.trip,
            self.order,
            self.pulse_until,
            self.silence_stops,
        ) = state

    def end(self) -> LegState:
        return LegState._make(_values(self))

    # the table

    def happens(self, stimulus: Stimulus, of_start: Outcome | None = None) -> Deed:
        """Go on as the table says. ``of_start``: how a start ends that is going on, where it ends by this."""
        before = self.stage
        self.stage, deed = TABLE[before, stimulus]
        if before in STARTING and self.stage not in STARTING:
            self.start = None
            self.effects.append(StartEnded(of_start or Outcome(Code.CANCELLED)))
        return deed

    # what is known

    @property
    def is_tripped(self) -> bool:
        return self.stage.is_tripped

    @property
    def is_enabling(self) -> bool:
        """What is sent enables the drive."""
        return self.settings.words.enables(self.sent.words[0])

    @property
    def is_enabled(self) -> bool:
        """The drive has said so. What it said before its node restarted does not count."""
        return self.drive is DriveState.OPERATION_ENABLED and self.way.is_heard

    @property
    def is_commanded(self) -> bool:
        """The drive is enabled, and what it gets does not stop it."""
        return self.is_enabled and self.is_enabling

    @property
    def may_enable(self) -> bool:
        """Whether enabling words may go to the drive, or go on. A target that is to follow the drive until it
        is enabled must know where that is: without the actual value it would be 0 or an old one, and the
        drive would go there. A drive that is enabled already needs nothing to follow."""
        return self.way.is_open and (not self.way.why_unplaced or self.is_commanded)

    @property
    def why_blocked(self) -> Text:
        if self.is_tripped:
            return Text.of("request.tripped")
        if self.way.why:
            return Text.plain(self.way.why)
        if self.way.why_unplaced and not self.is_commanded:
            return Text.plain(self.way.why_unplaced)
        return Text.of("request.interlocked")

    @property
    def word_at_rest(self) -> int:
        """What is sent if it is a stop of some kind: an acknowledge turns no ramp into coasting."""
        return at_rest(self.settings.words, self.sent.words[0])

    # what is done

    def tell(self, kind: Kind, severity: int, said: Text) -> None:
        self.effects.append(Tell(kind, severity, said))

    def keep_at_rest(self) -> None:
        """What was written for a drive that is not enabled yet must not make it jump when it is."""
        follows = self.settings.follows
        if follows and not self.is_commanded:
            setpoints = list(self.setpoints)
            for place, _ in follows:
                setpoints[place] = self.rest[place]
            self.setpoints = tuple(setpoints)

    def lead(self, word: int) -> None:
        """The next word of a start, in the parameter set that was commanded; what the owner has ordered
        stays."""
        self.word = self.settings.words.in_set_of(self.word, word)
        self.is_ours = False
        self.keep_at_rest()

    def stop(self, word: int, *, is_asked: bool = False) -> None:
        """Stop with this word in place of the owner's. ``is_asked``: by a command, and not because the bridge
        has to."""
        self.word = word
        self.is_ours = True
        # Where an acknowledge resumes, nothing but the owner's own word ends a stop that somebody asked for.
        self.is_asked = is_asked or (self.is_asked and self.settings.acknowledge_resumes)
        self.drop_setpoints()

    def stop_as_asked(self, word: int) -> None:
        """A stop by a command, made from the word that is sent. A reaction of the watchdog goes on from it,
        too: after a ramp was begun, somebody may still disable the voltage. Silence is broken for it, once
        for each stop: whoever asks for the same again and again must not keep the drive's own supervision
        from tripping."""
        is_new = word != self.trip.burst
        self.stop(word, is_asked=True)
        self.sent = Output((word, *self.rest), self.sent.silent)
        self.effects.append(LetGo())
        if self.stage is Stage.BURST and (is_new or self.trip.burst_until is None):
            self.trip = self.trip._replace(burst_until=self.now + _BURST_S)

    def has_been_sent(self, word: int) -> bool:
        """This stop has broken the silence before, and nothing is sent any more."""
        is_silent = self.stage is Stage.SILENCED and self.silence_stops
        return is_silent and word == self.trip.burst

    def drop_setpoints(self) -> None:
        self.setpoints = self.rest
        self.order = order.dropped(self.order)

    def hear(self, at: float, names: tuple[str, ...] = ()) -> None:
        """A valid telegram, with these commands. ``at`` is when it came, which may be a while ago: its time
        is up that much earlier. It takes none from a newer one."""
        timeout_ms, heard_at, _, _ = self.timer
        heard_at = at if heard_at is None else max(at, heard_at)
        deadline = heard_at + timeout_ms / 1000 if timeout_ms else None
        alive_until = self.owner.alive_until
        if deadline is not None and alive_until is not None:
            deadline = min(deadline, alive_until)
        self.timer = Timer(timeout_ms, heard_at, deadline)
        self.effects.append(Heard(names))

    def leave(self) -> None:
        """The owner goes; the drive is stopped first."""
        site_ms = self.settings.timeout_ms
        if self.timer.timeout_ms != site_ms:
            self.tell(Kind.CONFIGURATION, 400, Text.of("owner.timeout_of_site", timeout_ms=site_ms))
        self.timer = Timer(site_ms)
        self.stop(self.settings.words.stop(self.sent.words[0]))
        self.owner = Owner(lease_s=self.owner.lease_s)
        self.edges = self.edges._replace(bit=None)
        self.happens(Stimulus.LEFT, Outcome(Code.CANCELLED, Text.of("start.owner_changed")))

    # time

    def judge(self) -> None:
        """Is the controller still there?"""
        timer = self.timer
        if timer.deadline is not None and self.now >= timer.deadline:
            self.timer = timer._replace(deadline=None, is_overdue=True)
            if self.settings.ignores_errors:
                self.effects.append(Ignored())
            elif not self.is_tripped:
                self._trip(timer.deadline)
        lease_until = self.owner.lease_until
        if lease_until is not None and self.now >= lease_until:
            self.tell(Kind.OWNER, 300, Text.of("owner.lease_ran_out", who=str(self.owner.identity)))
            self.leave()

    def _trip(self, due: float) -> None:
        reaction, then_silence_s = self.settings.reaction, self.settings.then_silence_s
        self.happens(_EXPIRED[reaction], Outcome(Code.CANCELLED, Text.of("start.watchdog_tripped")))
        if reaction != "hold":
            self.drop_setpoints()
            self.trip = Trip(
                self.now + _RAMP_LIMIT_S if reaction == "quick_stop" else None,
                self.now + then_silence_s if then_silence_s and reaction != "silence" else None,
            )
        self.effects.append(Tripped(due, self.owner.identity, self.timer.timeout_ms))

    def clear(self, *, pulse: bool) -> None:
        """Acknowledge: leave the trip, and stop what would go on after a fault of the drive itself. With
        ``pulse`` an acknowledge edge is sent to the drive."""
        is_reset = pulse and self.drive in FAULTED
        word = self.word_at_rest
        if self.settings.reaction == "silence" and self.is_tripped and self.trip.burst is None:
            # Nobody has asked for a ramp.
            word = self.settings.words.disable_voltage(word)
        deed = self.happens(Stimulus.ACKNOWLEDGE_FAULT if is_reset else Stimulus.ACKNOWLEDGE)
        self.trip = Trip()
        if deed is Deed.CLEAR_STOP:
            self.stop(word)
        if self.settings.acknowledge_resumes and self.stage is Stage.INTERLOCKED and not self.is_asked:
            # Whoever acknowledges means to go on: nothing is active by that.
            self.happens(Stimulus.STOP_WORD)
        if pulse:
            self.pulse_until = self.now + _ACKNOWLEDGE_PULSE_S

    # the drive

    def reported(self, state: DriveState) -> None:
        """The drive says that it is in this state."""
        was_enabled = self.is_enabled
        self.drive = state
        if state in FAULTED or (was_enabled and not self.is_enabled):
            self.order = order.dropped(self.order)
            self.keep_at_rest()
        motion = self.motion
        if state is DriveState.FAULT_REACTION_ACTIVE and motion in MAY_FOLLOW_LATE:
            # The fault may have come before the word that enables.
            return
        if state in MOVING:
            # Ignore a late "moving" report when the word being sent does not enable.
            if motion is Motion.EXPECTED or self.is_enabling:
                self.motion = Motion.SEEN
            elif motion is Motion.FAULTED:
                self.motion = Motion.ENDED
        elif state is not DriveState.UNKNOWN:
            if self.stage is Stage.RAMPING:
                self.happens(Stimulus.SAYS_FAULT if state in FAULTED else Stimulus.SAYS_AT_REST)
            self.trip = self.trip._replace(ramps_until=None) if self.trip.ramps_until else self.trip
            if motion is Motion.SEEN:
                self.motion = Motion.ENDED
            elif motion is Motion.EXPECTED and state is DriveState.FAULT:
                self.motion = Motion.FAULTED

    # the end of each step

    def look_at_way(self) -> None:
        """Go on as the way to the drive is now. What was sent last may have closed it: a drive that is
        stopped needs a known position before it is enabled anew."""
        if self.may_enable:
            self.happens(Stimulus.WAY_OPEN)
            return
        self.happens(Stimulus.WAY_CLOSED, Outcome(Code.NOT_READY, self.why_blocked))
        self.order = order.dropped(self.order)

    def settle(self) -> None:
        """Bring the way to the drive and what is sent up to date."""
        self.look_at_way()
        self.run_out()
        was_enabling = self.is_enabling
        _send(self)
        if self.stage is Stage.BURST:
            self.trip = self.trip._replace(burst=self.sent.words[0])
        handshake = self.settings.handshake
        if handshake is not None:
            self.order, is_untaken = order.went_on(
                self.order,
                tuple(self.setpoints[place] for place in handshake.places),
                self.now,
                is_taken=self.is_taken,
                commanded=self.is_commanded,
            )
            _send(self)
            if is_untaken:
                self.tell(Kind.REFUSED, 500, Text.of("start.position_not_taken"))
        if self.is_enabling:
            if not was_enabling:
                self.motion = Motion.SEEN if self.is_enabled else Motion.EXPECTED
            self.is_asked = False

    def run_out(self) -> None:
        """What has its time only: the ramp of a reaction, the time before its silence, a burst, a pulse."""
        now = self.now
        ramps_until, silent_from, burst_until, _ = self.trip
        if ramps_until is not None and now >= ramps_until:
            self.happens(Stimulus.RAMP_OVERDUE)
            self.trip = self.trip._replace(ramps_until=None)
        if silent_from is not None and now >= silent_from:
            self.happens(Stimulus.SILENCE_DUE)
            self.trip = self.trip._replace(silent_from=None)
        if burst_until is not None and now >= burst_until:
            self.happens(Stimulus.BURST_OVER)
            self.trip = self.trip._replace(burst_until=None)
        if self.pulse_until is not None and now >= self.pulse_until:
            self.pulse_until = None


# What goes to the drive: the owner's words, or a stop in their place. Nothing that enables a drive gets past
# this while the watchdog has tripped, the restart interlock is set or the way to the drive is closed. A stop
# always does.


def at_rest(words: ControlWords, word: int) -> int:
    """``word`` if it is a stop of some kind, else a stop made from it."""
    return words.stop(word) if words.enables(word) else word & ~words.acknowledge_mask


def control_word(words: ControlWords, state: Turn | LegState) -> int:
    """The owner's control word, or what was led or stopped with since; the acknowledge bit is always as the
    owner wrote it, so that whoever changes a bit beside it makes no edge of it."""
    return state.word | (words.acknowledge_mask if state.edges.bit else 0)


def _send(turn: Turn) -> None:
    """Make what the drive gets from now on."""
    stage = turn.stage
    if stage in REACTING:
        turn.sent = _reaction(turn)
    elif stage is not Stage.HELD:
        turn.sent = _owners(turn)


def _reaction(turn: Turn) -> Output:
    word = _reaction_word(turn)
    if turn.stage in MUTE and not turn.silence_stops:
        return Output((turn.settings.words.disable_voltage(word), *turn.rest))
    is_silent = turn.stage is Stage.SILENCED
    return Output((word, *turn.rest), is_silent)


def _reaction_word(turn: Turn) -> int:
    reaction, words, word = turn.settings.reaction, turn.settings.words, turn.sent.words[0]
    if reaction == "disable_voltage" or (reaction == "quick_stop" and turn.trip.ramps_until is None):
        return words.disable_voltage(word)
    stopped = words.quick_stop(word) if reaction == "quick_stop" else words.stop(word)
    return words.withhold(stopped) if turn.motion in RESTS else stopped


def _owners(turn: Turn) -> Output:
    words, word, is_ours = turn.settings.words, turn.word, turn.is_ours
    acknowledge = words.acknowledge_mask
    is_blocked = turn.stage in BLOCKED
    if is_blocked and words.enables(word):
        # The stop that is in force, by whomever: what the owner goes on writing does not weaken it.
        word = at_rest(words, turn.sent.words[0]) | word & acknowledge
        is_ours = True
    if turn.drive is DriveState.FAULT and word & acknowledge:
        # It ends with the fault: what was asked for then would hold the motor after it.
        turn.is_asked = False
    if is_ours and turn.motion in RESTS and not turn.is_asked:
        word = words.withhold(word) | word & acknowledge
    if turn.pulse_until is not None:
        word |= acknowledge
    handshake = turn.settings.handshake
    if handshake is not None and turn.order.is_raised and words.enables(word):
        word |= handshake.mask
    return Output((word, *(turn.rest if is_blocked else turn.setpoints)))
