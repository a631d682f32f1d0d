"""State of an alarm condition, and what each event and method makes of it (OPC 10000-9 §5.5 to §5.8).
Sans-IO.

There are no branches: an alarm that comes again before it was acknowledged is to be acknowledged anew, once
(Annex B.1.2). Times are in ms since 1970.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final, NamedTuple

from bridge.uaserver.library import StatusCodes

MAX_TIME_SHELVED_MS: Final = 12 * 3_600_000.0
"""Longest time for which an alarm stays shelved: a shift and what it may run over."""
MOST_EVENT_IDS: Final = 10
"""Notifications of one occurrence by which it can be acknowledged; of more the newest count."""


class Shelving(StrEnum):
    """State of the ShelvedStateMachineType (§5.8.17)."""

    UNSHELVED = "unshelved"
    TIMED = "timed_shelved"
    ONE_SHOT = "one_shot_shelved"


@dataclass(frozen=True, slots=True)
class Comment:
    """Latest comment. ``user`` is who has called a method last, with a comment or without one."""

    text: str = ""
    locale: str = ""
    user: str = ""
    time_ms: float = 0.0

    def by(self, user: str, given: Comment) -> Comment:
        """This one after a call of ``user`` with ``given``: without text and locale it stays as it is
        (§5.5.6), without a text it is taken back."""
        return replace(given, user=user) if given.text or given.locale else replace(self, user=user)


class Act(NamedTuple):
    """Call of a method of a condition. Times of ``comment`` are that of the call."""

    event_id: bytes = b""
    comment: Comment = Comment()
    user: str = ""


class Step(NamedTuple):
    """``code`` is the status code of the call. ``tells``: an event is to be sent of what ``state`` says."""

    state: ConditionState
    code: int = StatusCodes.Good
    tells: bool = False


@dataclass(frozen=True, slots=True)
class ConditionState:
    """AlarmConditionType with its optional ConfirmedState and ShelvingState.

    ``event_ids`` are those of the present occurrence, by which it can be acknowledged and confirmed. The
    times are those of the last change, 0 where there was none; ``unshelve_at_ms`` is 0 while it is not
    shelved.
    """

    enabled: bool = True
    active: bool = False
    acked: bool = True
    confirmed: bool = True
    shelving: Shelving = Shelving.UNSHELVED
    unshelve_at_ms: float = 0.0
    severity: int = 1
    last_severity: int = 1
    comment: Comment = Comment()
    event_ids: tuple[bytes, ...] = ()
    enabled_ms: float = 0.0
    active_ms: float = 0.0
    acked_ms: float = 0.0
    confirmed_ms: float = 0.0
    severity_ms: float = 0.0

    @property
    def retain(self) -> bool:
        """Something is left for a client to see or to do (§5.5.2)."""
        return self.enabled and (self.active or not self.acked or not self.confirmed)

    @property
    def shelved(self) -> bool:
        return self.shelving is not Shelving.UNSHELVED

    def told(self, event_id: bytes) -> ConditionState:
        """The state once this event has been sent of it."""
        return replace(self, event_ids=(*self.event_ids, event_id)[-MOST_EVENT_IDS:])

    # what happens to what it watches

    def raised(self, severity: int, now_ms: float, *, anew: bool) -> Step:
        """It is active with this severity; ``anew``: for another reason than before."""
        state = self
        if anew or not self.active:
            state = replace(
                state,
                active=True,
                active_ms=state.active_ms if self.active else now_ms,
                acked=False,
                acked_ms=now_ms,
                confirmed=True,
                event_ids=(),
            )
        if severity != self.severity:
            state = replace(state, severity=severity, last_severity=self.severity, severity_ms=now_ms)
        return Step(state, tells=self.enabled and state is not self)

    def cleared(self, now_ms: float) -> Step:
        """It is not active any more, which ends what was shelved for once."""
        if not self.active:
            return Step(self)
        state = replace(self, active=False, active_ms=now_ms)
        if state.shelving is Shelving.ONE_SHOT:
            state = _unshelved(state)
        return Step(state, tells=self.enabled)

    def on_time(self, now_ms: float) -> Step:
        """It may have been shelved for long enough."""
        if not self.shelved or now_ms < self.unshelve_at_ms:
            return Step(self)
        return Step(_unshelved(self), tells=self.enabled)

    # methods of ConditionType and AcknowledgeableConditionType

    def enable(self, act: Act, now_ms: float) -> Step:
        if self.enabled:
            return Step(self, StatusCodes.BadConditionAlreadyEnabled)
        return Step(replace(self._by(act), enabled=True, enabled_ms=now_ms), tells=True)

    def disable(self, act: Act, now_ms: float) -> Step:
        if not self.enabled:
            return Step(self, StatusCodes.BadConditionAlreadyDisabled)
        return Step(replace(self._by(act), enabled=False, enabled_ms=now_ms), tells=True)

    def add_comment(self, act: Act, now_ms: float) -> Step:
        fault = self._fault(act)
        return Step(self, fault) if fault else Step(self._by(act), tells=True)

    def acknowledge(self, act: Act, now_ms: float) -> Step:
        fault = self._fault(act)
        if not fault and self.acked:
            fault = StatusCodes.BadConditionBranchAlreadyAcked
        if fault:
            return Step(self, fault)
        times = {"acked_ms": now_ms, "confirmed_ms": now_ms}
        return Step(replace(self._by(act), acked=True, confirmed=False, **times), tells=True)

    def confirm(self, act: Act, now_ms: float) -> Step:
        fault = self._fault(act)
        if not fault and self.confirmed:
            fault = StatusCodes.BadConditionBranchAlreadyConfirmed
        if fault:
            return Step(self, fault)
        return Step(replace(self._by(act), confirmed=True, confirmed_ms=now_ms), tells=True)

    # methods of ShelvedStateMachineType

    def timed_shelve(self, act: Act, duration_ms: float, now_ms: float) -> Step:
        # `not <` refuses NaN, too.
        if not 0 < duration_ms <= MAX_TIME_SHELVED_MS:
            return Step(self, StatusCodes.BadShelvingTimeOutOfRange)
        return self._shelved(Shelving.TIMED, act, now_ms + duration_ms)

    def one_shot_shelve(self, act: Act, now_ms: float) -> Step:
        """§5.8.17: MaxTimeShelved ends this one, too."""
        return self._shelved(Shelving.ONE_SHOT, act, now_ms + MAX_TIME_SHELVED_MS)

    def unshelve(self, act: Act, now_ms: float) -> Step:
        if not self.enabled:
            return Step(self, StatusCodes.BadConditionDisabled)
        if not self.shelved:
            return Step(self, StatusCodes.BadConditionNotShelved)
        return Step(_unshelved(self._by(act)), tells=True)

    def _shelved(self, how: Shelving, act: Act, until_ms: float) -> Step:
        if not self.enabled:
            return Step(self, StatusCodes.BadConditionDisabled)
        if self.shelving is how:
            return Step(self, StatusCodes.BadConditionAlreadyShelved)
        return Step(replace(self._by(act), shelving=how, unshelve_at_ms=until_ms), tells=True)

    def _fault(self, act: Act) -> int:
        """Status code of a call about an event; Good where it can be meant."""
        if not self.enabled:
            return StatusCodes.BadConditionDisabled
        return StatusCodes.Good if act.event_id in self.event_ids else StatusCodes.BadEventIdUnknown

    def _by(self, act: Act) -> ConditionState:
        return replace(self, comment=self.comment.by(act.user, act.comment))


NORMAL: Final = ConditionState()
"""State of a condition that nothing has happened to."""


def _unshelved(state: ConditionState) -> ConditionState:
    return replace(state, shelving=Shelving.UNSHELVED, unshelve_at_ms=0.0)
