"""One bus of the master with its network, and what the bus has been told to repeat."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf
from typing import Final

from bridge.can.burstend import MOST_FRAMES, Burst, BurstEnd
from bridge.can.interface import Bus, ControllerState
from bridge.canopen.frame import Frame
from bridge.canopen.sync import burst_length
from bridge.master.network import Beats, Network
from bridge.node.process.process_data import Beat, Told
from bridge.ratelimit import RateLimit

RENEWALS: Final = 3
"""How often a burst is renewed within its dead-man time."""
_BUS_EVENTS: Final = 10
_BUS_EVENT_EVERY_S: Final = 5.0


@dataclass(slots=True)
class Line:
    """One bus with its network, and what the bus has been told to repeat."""

    bus: Bus
    network: Network
    beating: dict[int, Told] = field(default_factory=dict[int, Told])
    beats: Beats | None = None
    renew_at: float = 0.0
    hold_at: float = inf
    """When bursts have to be renewed so that they last as long as a drive needs them."""
    was_up: bool = True
    shown: ControllerState = ControllerState.OK
    shown_refusal: str = ""
    limit: RateLimit = field(default_factory=lambda: RateLimit(_BUS_EVENTS, _BUS_EVENT_EVERY_S))
    outages: int = 0

    @property
    def burst_s(self) -> float:
        """How long a burst goes on without being renewed."""
        return self.network.bus.deadman_ms / 1000

    @property
    def renew_s(self) -> float:
        """How often bursts are renewed. One that has to end in a stop is no longer than the longest sequence
        that the kernel takes."""
        return min(self.burst_s, MOST_FRAMES * self.network.bus.rpdo_period_s) / RENEWALS

    def ended(self, beats: Beats, frames: list[Frame]) -> set[int]:
        """The bursts that end: what is sent once takes their place, too."""
        return self.beating.keys() - (beats.keys() - {frame.can_id for frame in frames})

    def due(self, beats: Beats, now: float, *, renew: bool) -> list[tuple[Beat, bool]]:
        """What to hand to the bus, and whether it is new: setpoints before the enabling word.

        Mere renewals go in reverse order: what is handed over later has no more frames left until the
        deadline than what went before it, so setpoints end before the stop comes.
        """
        new, kept = list[tuple[Beat, bool]](), list[tuple[Beat, bool]]()
        for can_id, beat in beats.items():
            told = self.beating.get(can_id)
            if told is None or told.frames != beat.frames:
                new.append((beat, True))
            elif renew or not told.ends_as(beat, now):
                kept.append((beat, False))
        return [*new, *reversed(kept)]

    def beat(self, beat: Beat, now: float, *, at_once: bool) -> None:
        """Make the bus repeat this for the dead-man time, then what follows if its own time ends earlier."""
        ending = None
        # A deadline further ahead does not concern this burst, however long the hand-over takes.
        if beat.until is not None and beat.until < now + 2 * self.burst_s + beat.period_s:
            ending = BurstEnd(beat.until, beat.then())
        count = burst_length(beat.period_s, self.network.bus.deadman_ms)
        self.bus.burst(Burst(beat.frames, beat.period_s, count, ending), now, at_once=at_once)
        ends = now + self.burst_s + beat.period_s
        self.beating[beat.frames[0].can_id] = Told(beat.frames, beat.until, ends, now)
