"""The controller leg of the watchdog: the twin of P151 (BU 2500 §7.1.1), as a table and one timer."""

from __future__ import annotations

from enum import Enum, IntEnum
from typing import Final


class WatchdogState(IntEnum):
    """Numbered as Modbus serves it (input register 14)."""

    OFF = 0
    IDLE = 1
    RUNNING = 2
    TRIPPED = 3

    @property
    def label(self) -> str:
        return self.name.lower()


STATES: Final = tuple((state.value, state.label) for state in WatchdogState)


class Stimulus(Enum):
    TELEGRAM = "valid telegram"
    INVALID = "invalid telegram"
    EXPIRED = "timer expires"
    ACKNOWLEDGED = "acknowledge"
    RELEASED = "owner releases"
    OWNER_CHANGED = "owner changes"
    STARTED = "bridge starts"


class Effect(Enum):
    NOTHING = "nothing"
    FORWARD = "forward the telegram"
    TAKE = "take the telegram, do not forward it"
    REFUSE = "refuse the telegram"
    REACT = "reaction, fault"
    CLEAR = "clear the drive's fault, keep it stopped"
    STOP = "stop the drive"


_OFF, _IDLE, _RUN, _TRIP = WatchdogState

TABLE: Final[dict[tuple[WatchdogState, Stimulus], tuple[WatchdogState, Effect]]] = {
    (_OFF, Stimulus.TELEGRAM): (_OFF, Effect.FORWARD),
    (_OFF, Stimulus.INVALID): (_OFF, Effect.REFUSE),
    (_OFF, Stimulus.EXPIRED): (_OFF, Effect.NOTHING),
    (_OFF, Stimulus.ACKNOWLEDGED): (_OFF, Effect.CLEAR),
    (_OFF, Stimulus.RELEASED): (_OFF, Effect.STOP),
    (_OFF, Stimulus.OWNER_CHANGED): (_OFF, Effect.STOP),
    (_OFF, Stimulus.STARTED): (_OFF, Effect.STOP),
    (_IDLE, Stimulus.TELEGRAM): (_RUN, Effect.FORWARD),
    (_IDLE, Stimulus.INVALID): (_IDLE, Effect.REFUSE),
    (_IDLE, Stimulus.EXPIRED): (_IDLE, Effect.NOTHING),
    (_IDLE, Stimulus.ACKNOWLEDGED): (_RUN, Effect.CLEAR),
    (_IDLE, Stimulus.RELEASED): (_IDLE, Effect.STOP),
    (_IDLE, Stimulus.OWNER_CHANGED): (_IDLE, Effect.STOP),
    (_IDLE, Stimulus.STARTED): (_IDLE, Effect.STOP),
    (_RUN, Stimulus.TELEGRAM): (_RUN, Effect.FORWARD),
    (_RUN, Stimulus.INVALID): (_RUN, Effect.REFUSE),
    (_RUN, Stimulus.EXPIRED): (_TRIP, Effect.REACT),
    (_RUN, Stimulus.ACKNOWLEDGED): (_RUN, Effect.CLEAR),
    (_RUN, Stimulus.RELEASED): (_IDLE, Effect.STOP),
    (_RUN, Stimulus.OWNER_CHANGED): (_IDLE, Effect.STOP),
    (_RUN, Stimulus.STARTED): (_IDLE, Effect.STOP),
    (_TRIP, Stimulus.TELEGRAM): (_TRIP, Effect.TAKE),
    (_TRIP, Stimulus.INVALID): (_TRIP, Effect.REFUSE),
    (_TRIP, Stimulus.EXPIRED): (_TRIP, Effect.NOTHING),
    (_TRIP, Stimulus.ACKNOWLEDGED): (_RUN, Effect.CLEAR),
    # Who gives control back or takes it over does not take the fault away with it (docs/adr/0009).
    (_TRIP, Stimulus.RELEASED): (_TRIP, Effect.STOP),
    (_TRIP, Stimulus.OWNER_CHANGED): (_TRIP, Effect.STOP),
    (_TRIP, Stimulus.STARTED): (_IDLE, Effect.STOP),
}


class Watchdog:
    """One drive's controller leg.

    ``timeout_ms`` is ``fieldbus_timeout_ms`` (0 is off). With ``report_only`` (telegram downtime
    -0.1) the state stays OFF and an expiry is told once by ``on_time`` and does nothing else.
    """

    __slots__ = ("_deadline", "_heard_at", "_report_only", "_silent", "state", "telegrams", "timeout_ms")

    def __init__(self, timeout_ms: int, *, report_only: bool = False) -> None:
        self.timeout_ms = timeout_ms
        self._report_only = report_only
        self._deadline: float | None = None
        self._heard_at: float | None = None
        self._silent = False
        self.telegrams = 0
        """Number of the last valid telegram, modulo 2¹⁶: a witness outside sees by it that one came."""
        self.state = WatchdogState.IDLE if self._can_trip else WatchdogState.OFF

    @property
    def _can_trip(self) -> bool:
        return self.timeout_ms > 0 and not self._report_only

    @property
    def controller_is_silent(self) -> bool:
        """No valid telegram for longer than the time-out, after there had been one."""
        return self._silent

    def set_timeout(self, timeout_ms: int) -> None:
        """Another time, counted from the owner's last telegram: setting it is none. A trip stays a trip."""
        was_told = self._silent
        self.timeout_ms = timeout_ms
        self._deadline = None
        if timeout_ms and self._heard_at is not None and not was_told:
            self._deadline = self._heard_at + timeout_ms / 1000
        self._settle()

    def _settle(self) -> None:
        """What cannot trip is OFF, what can is not."""
        if self.state is WatchdogState.TRIPPED:
            return
        if not self._can_trip:
            self.state = WatchdogState.OFF
        elif self.state is WatchdogState.OFF:
            # Who commanded the drive while nobody watched is watched from now on.
            self.state = WatchdogState.IDLE if self._heard_at is None else WatchdogState.RUNNING

    def left_ms(self, now: float) -> int:
        """Time until the trip; 0 when the timer does not run."""
        if self._deadline is None or self.state is not WatchdogState.RUNNING:
            return 0
        return max(0, round((self._deadline - now) * 1000))

    def next_deadline(self) -> float | None:
        return self._deadline

    @property
    def trips_at(self) -> float | None:
        """When the drive is stopped unless its owner is heard; None where no time does that."""
        return self._deadline if self.state is WatchdogState.RUNNING else None

    def apply(self, stimulus: Stimulus, heard_at: float) -> Effect:
        """Let ``stimulus`` happen and say what is to be done about it. ``heard_at`` is when a telegram came,
        which may be a while ago: its time is up that much earlier. It takes none from a newer one."""
        self.state, effect = TABLE[self.state, stimulus]
        if stimulus in (Stimulus.TELEGRAM, Stimulus.ACKNOWLEDGED):
            self._silent = False
            self.telegrams = (self.telegrams + 1) & 0xFFFF
            self._heard_at = heard_at if self._heard_at is None else max(heard_at, self._heard_at)
            self._deadline = self._heard_at + self.timeout_ms / 1000 if self.timeout_ms else None
        elif stimulus in (Stimulus.RELEASED, Stimulus.OWNER_CHANGED, Stimulus.STARTED):
            self._silent = False
            self._heard_at = None
            self._deadline = None
        self._settle()
        return effect

    def on_time(self, now: float) -> Effect | None:
        """The effect of the timer if it has expired by ``now``, told once per silence, or None."""
        if self._deadline is None or now < self._deadline:
            return None
        self._deadline = None
        self._silent = True
        return self.apply(Stimulus.EXPIRED, now)
