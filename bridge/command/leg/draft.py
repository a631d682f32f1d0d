"""Working copy of a leg's state for one step, with the effects of the step so far."""

from __future__ import annotations

from operator import attrgetter

from bridge.command.leg import order
from bridge.command.leg.effect import Answer, Effect, Heard, Tell
from bridge.command.leg.forwarded import Asked
from bridge.command.leg.settings import LegSettings
from bridge.command.leg.state import LegState, Timer
from bridge.command.messages.event import EventKind
from bridge.command.messages.request import Outcome
from bridge.drive import DriveState
from bridge.text import Text

_values = attrgetter(*LegState._fields)


class Draft:
    """Working copy of a state: changed, and made a state again. The attributes are those of ``LegState``."""

    __slots__ = ("_before", "asked", "effects", "now", "settings", *LegState._fields)

    def __init__(self, settings: LegSettings, state: LegState, now: float) -> None:
        self.settings = settings
        self.now = now
        self._before = state
        self.effects: list[Effect] = []
        self.asked: Asked | None = None
        """Words, stop or edge that a request asks for: its answer is judged by that."""
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
            self.is_acknowledged,
            self.motion,
            self.start,
            self.trip,
            self.order,
            self.pulse_until,
            self.silence_stops,
        ) = state

    def begin_anew(self) -> None:
        """Go back to the beginning of the step: nothing that was done since counts."""
        Draft.__init__(self, self.settings, self._before, self.now)

    def end(self) -> LegState:
        return LegState._make(_values(self))

    # what is known

    @property
    def is_tripped(self) -> bool:
        return self.stage.is_tripped

    @property
    def is_enabling(self) -> bool:
        """True if the words that are sent enable the drive."""
        return self.settings.words.enables(self.sent.words[0])

    @property
    def is_enabled(self) -> bool:
        """The drive reports *operation enabled*. A report from before its node restarted does not count."""
        return self.drive is DriveState.OPERATION_ENABLED and self.way.is_heard

    @property
    def is_commanded(self) -> bool:
        """The drive is enabled, and the words that are sent do not stop it."""
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
            return self.way.why
        if self.way.why_unplaced and not self.is_commanded:
            return self.way.why_unplaced
        return Text.of("request.interlocked")

    # what several deeds do

    def tell(self, kind: EventKind, severity: int, said: Text) -> None:
        self.effects.append(Tell(kind, severity, said))

    def answer(self, outcome: Outcome) -> None:
        self.effects.append(Answer(outcome))

    def keep_at_rest(self) -> None:
        """Keep setpoints at rest that must not make a drive jump when it is enabled, as long as it is not."""
        follows = self.settings.follows
        if follows and not self.is_commanded:
            setpoints = list(self.setpoints)
            for place, _ in follows:
                setpoints[place] = self.rest[place]
            self.setpoints = tuple(setpoints)

    def lead(self, word: int) -> None:
        """Take the next word of a start, in the parameter set that was commanded; the owner's orders stay."""
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

    def drop_setpoints(self) -> None:
        self.setpoints = self.rest
        self.order = order.dropped(self.order)

    def hear(self, at: float, names: tuple[str, ...] = ()) -> None:
        """Note a valid telegram with these commands. ``at`` is when it came, which may be a while ago: its
        time is up that much earlier. It takes none from a newer one."""
        timeout_ms, heard_at, _, _ = self.timer
        heard_at = at if heard_at is None else max(at, heard_at)
        deadline = heard_at + timeout_ms / 1000 if timeout_ms else None
        alive_until = self.owner.alive_until
        if deadline is not None and alive_until is not None:
            deadline = min(deadline, alive_until)
        self.timer = Timer(timeout_ms, heard_at, deadline)
        self.effects.append(Heard(names))
