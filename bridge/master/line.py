"""One bus of the master with its network: what comes from it, what is to be repeated on it, and what it has
been told to repeat."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import Final

from bridge.can.burstend import MOST_FRAMES, Burst, BurstEnd
from bridge.can.interface import Bus, ControllerState
from bridge.canopen import cobid
from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtState
from bridge.canopen.sync import burst_length, sync_frames
from bridge.command import Plant
from bridge.master.network import Network
from bridge.master.standstill import Alarm
from bridge.node.process.process_data import Beat, Told
from bridge.ratelimit import RateLimit

RENEWALS: Final = 3
"""How often a burst is renewed within its dead-man time."""
_BUS_EVENTS: Final = 10
_BUS_EVENT_EVERY_S: Final = 5.0
_SEND_LIMIT_S: Final = 0.1
"""A frame that could not be sent for this long is stale and is dropped."""

Beats = dict[int, Beat]
"""What is to be repeated, by COB-ID."""


class Repeated:
    """What is to be repeated on the bus of ``network``."""

    def __init__(self, network: Network, plant: Plant) -> None:
        self._network = network
        self._plant = plant
        self._sync = sync_frames(network.bus.sync_counter)
        self._beats: Beats = {}
        self._made_for: tuple[int, int, NmtState, bool] | None = None

    def beats(self, *, anew: bool = False) -> Beats:
        """The frames to be repeated: the same object while they are the same.

        A drive's settling, a node's new PDOs and our own state change them; asked ``anew``, every drive is
        looked at.
        """
        network = self._network
        made_for = self._plant.settled, network.routings, network.nmt_state, network.charge.acts()
        if anew or made_for != self._made_for:
            self._made_for = made_for
            self._beats = self._make() if network.charge.acts() else {}
        return self._beats

    def _make(self) -> Beats:
        beats: Beats = {}
        bus, state = self._network.bus, self._network.nmt_state
        # Initialising is said once, by the boot-up message.
        if bus.heartbeat_ms and state is not NmtState.INITIALISING:
            frame = Frame(cobid.ERROR_CONTROL + bus.master_node_id, bytes((state,)))
            beats[frame.can_id] = Beat((frame,), bus.heartbeat_ms / 1000)
        hold_at: list[float] = []
        for node in self._network.nodes:
            if node.sends_process_data:
                for pdos in node.wire.drives.values():
                    if not pdos.is_silent:
                        for beat in pdos.beats(bus.rpdo_period_s):
                            beats[beat.frames[0].can_id] = beat
                            if pdos.needs_sync:
                                hold_at += beat.hold_at
        # SYNC last: it makes effective what is sent together with it (CiA 301 §7.2.2.2).
        if bus.sync_period_ms:
            beats[cobid.SYNC] = Beat(self._sync, bus.sync_period_ms / 1000, hold_at=tuple(hold_at))
        return beats


@dataclass(slots=True)
class Line:
    """One bus with its network. ``alarm`` notices a standstill while frames are handed to the bus."""

    bus: Bus
    network: Network
    plant: Plant
    clock: Callable[[], float]
    alarm: Alarm
    repeated: Repeated = field(init=False)
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

    def __post_init__(self) -> None:
        self.repeated = Repeated(self.network, self.plant)

    def receive(self, now: float) -> None:
        """Take in what has come since the last call."""
        frames = self.bus.drain(now)
        if frames:
            self.network.on_frames(frames, now)
            self.plant.on_readings()
        foreign = self.bus.take_foreign(now)
        if foreign:
            self.network.on_foreign(foreign, now)

    def stood_still(self, since: float) -> bool:
        """The process was stopped after ``since`` for longer than deadman_ms, so words computed before are
        stale. The next round finds the gap."""
        return (self.clock() - since) * 1000 > self.network.bus.deadman_ms

    def flush(self, now: float) -> None:
        """Hand to the bus what is to be sent and repeated now."""
        bus, network = self.bus, self.network
        routes = network.take_routes()
        if routes is not None:
            bus.accept(routes)
            bus.watch(network.ours)
        renew = now >= self.renew_at
        beats = self.repeated.beats(anew=renew)
        frames = network.take_frames()
        is_same = beats is self.beats and not frames
        ended = set[int]() if is_same else self._ended(beats, frames)
        # First: the kernel must not repeat an enabling word once more after a stopped one.
        for can_id in ended:
            bus.end_burst(can_id)
            del self.beating[can_id]
        for frame in frames:
            bus.send(frame, now, now + _SEND_LIMIT_S)
        if not self.was_up:
            return
        if renew:
            self.renew_at = now + self.renew_s
        if beats is self.beats and not (renew or ended) and now < self.hold_at:
            return
        self.beats = beats
        self.alarm.set(self.burst_s)
        for beat, changed in self._due(beats, now, renew=renew):
            # In this order: the process may be stopped right after it has read the clock.
            if self.stood_still(now) or self.alarm.rang:
                self.beats = None
                return
            self._beat(beat, now, at_once=changed)
        self.hold_at = min((at for beat in beats.values() for at in beat.hold_at if at > now), default=inf)
        if self.plant.unsent:
            network.on_handed_over(self.clock())

    @property
    def burst_s(self) -> float:
        """How long a burst goes on without being renewed."""
        return self.network.bus.deadman_ms / 1000

    @property
    def renew_s(self) -> float:
        """How often bursts are renewed. One that has to end in a stop is no longer than the longest sequence
        that the kernel takes."""
        return min(self.burst_s, MOST_FRAMES * self.network.bus.rpdo_period_s) / RENEWALS

    def _ended(self, beats: Beats, frames: list[Frame]) -> set[int]:
        """The bursts that end: what is sent once takes their place, too."""
        return self.beating.keys() - (beats.keys() - {frame.can_id for frame in frames})

    def _due(self, beats: Beats, now: float, *, renew: bool) -> list[tuple[Beat, bool]]:
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

    def _beat(self, beat: Beat, now: float, *, at_once: bool) -> None:
        """Make the bus repeat this for the dead-man time, then what follows if its own time ends earlier."""
        ending = None
        # A deadline further ahead does not concern this burst, however long the hand-over takes.
        if beat.until is not None and beat.until < now + 2 * self.burst_s + beat.period_s:
            ending = BurstEnd(beat.until, beat.then())
        count = burst_length(beat.period_s, self.network.bus.deadman_ms)
        self.bus.burst(Burst(beat.frames, beat.period_s, count, ending), now, at_once=at_once)
        ends = now + self.burst_s + beat.period_s
        self.beating[beat.frames[0].can_id] = Told(beat.frames, beat.until, ends, now)
