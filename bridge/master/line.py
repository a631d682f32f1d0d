"""One bus of the master with its network: frames received, repetitions wanted, bursts running."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from math import inf
from typing import Final

from bridge.base.ratelimit import RateLimit
from bridge.can.burstend import MOST_FRAMES, Burst, BurstEnd
from bridge.can.interface import Bus, ControllerState
from bridge.canopen import cobid
from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtState
from bridge.canopen.sync import burst_length, sync_frames
from bridge.command import Plant
from bridge.master.network import Network
from bridge.master.standstill import StoodStill, WatchdogTimer
from bridge.node.node_core import NodeCore
from bridge.node.process.process_data import Repetition, RunningBurst

RENEWALS: Final = 3
"""Number of renewals of a burst within its dead-man time."""
_BUS_EVENTS: Final = 10
_BUS_EVENT_EVERY_S: Final = 5.0
_SEND_LIMIT_S: Final = 0.1
"""Time in seconds after which a frame that could not be sent is stale and is dropped."""

Repetitions = dict[int, Repetition]
"""Repetitions wanted on a bus, by COB-ID."""


class Repeated:
    """Repetitions wanted on the bus of ``network``."""

    def __init__(self, network: Network, plant: Plant) -> None:
        self._network = network
        self._plant = plant
        self._sync = sync_frames(network.bus.sync_counter)
        self._repetitions: Repetitions = {}
        self._of_nodes: dict[str, list[tuple[Repetition, bool]]] = {}
        """Repetitions of each node in order, by node name, each with whether it needs SYNC."""
        self._made_for: tuple[int, NmtState, bool, tuple[NodeCore, ...]] | None = None

    def repetitions(self, *, anew: bool = False) -> Repetitions:
        """Frames to be repeated; the same object while they are the same.

        A change of a drive remakes those of its node; if a node has new PDOs, if our own state has changed,
        or with ``anew``, those of every drive are remade.
        """
        network = self._network
        changed = self._plant.take_changed(network.bus.name)
        made_for = network.routings, network.nmt_state, network.mastership.acts(), network.farewell.awaiting
        anew = anew or made_for != self._made_for
        if anew or changed:
            self._made_for = made_for
            acts = network.mastership.acts()
            self._repetitions = self._make(None if anew else changed) if acts else self._make_last()
        return self._repetitions

    def _make(self, changed: set[str] | None) -> Repetitions:
        """Repetitions, remade for the nodes in ``changed``, or for all if None."""
        repetitions: Repetitions = {}
        bus, state = self._network.bus, self._network.nmt_state
        # Initialising is said once, by the boot-up message.
        if bus.heartbeat_ms and state is not NmtState.INITIALISING:
            frame = Frame(cobid.ERROR_CONTROL + bus.master_node_id, bytes((state,)))
            repetitions[frame.can_id] = Repetition((frame,), bus.heartbeat_ms / 1000)
        hold_at: list[float] = []
        for node in self._network.nodes:
            name = node.node.name
            if changed is None or name in changed:
                self._of_nodes[name] = list(self._of_node(node))
            for wanted, needs_sync in self._of_nodes[name]:
                repetitions[wanted.frames[0].can_id] = wanted
                if needs_sync:
                    hold_at += wanted.hold_at
        # SYNC last: it makes effective what is sent together with it (CiA 301 §7.2.2.2).
        if bus.sync_period_ms:
            repetitions[cobid.SYNC] = Repetition(
                self._sync, bus.sync_period_ms / 1000, hold_at=tuple(hold_at)
            )
        return repetitions

    def _make_last(self) -> Repetitions:
        """Stopped words that nodes have still to take over, though the bus is left to another bridge."""
        wanted = [one for node in self._network.farewell.awaiting for one in self._of_node(node)]
        repetitions = {one.frames[0].can_id: one for one, _ in wanted}
        if self._network.farewell.awaiting and self._network.bus.sync_period_ms:
            repetitions[cobid.SYNC] = Repetition(self._sync, self._network.bus.sync_period_ms / 1000)
        return repetitions

    def _of_node(self, node: NodeCore) -> Iterator[tuple[Repetition, bool]]:
        if node.sends_process_data:
            node.leaving.owed.note()
            for pdos in node.wire.pdos:
                if not pdos.is_silent:
                    for wanted in pdos.repetitions(self._network.bus.rpdo_period_s):
                        yield wanted, pdos.needs_sync


@dataclass(slots=True)
class BusLine:
    """One bus with its network. ``alarm`` detects a standstill while frames are handed to the bus."""

    bus: Bus
    network: Network
    plant: Plant
    clock: Callable[[], float]
    alarm: WatchdogTimer
    repeated: Repeated = field(init=False)
    running: dict[int, RunningBurst] = field(default_factory=dict[int, RunningBurst])
    repetitions: Repetitions | None = None
    renew_at: float = 0.0
    hold_at: float = inf
    """Time at which bursts have to be renewed so that they last as long as a drive needs them."""
    was_up: bool = True
    shown: ControllerState = ControllerState.OK
    shown_refusal: str = ""
    limit: RateLimit = field(default_factory=lambda: RateLimit(_BUS_EVENTS, _BUS_EVENT_EVERY_S))
    outages: int = 0

    def __post_init__(self) -> None:
        self.repeated = Repeated(self.network, self.plant)

    def receive(self, now: float) -> list[Frame]:
        """Take in what has come since the last call; returns the frames of others on identifiers of ours."""
        frames = self.bus.drain(now)
        has_started = bool(frames) and self.network.on_frames(frames, now)
        # They come by a way of their own: what was sent to a node before its boot-up message is taken in with
        # that message, and not later.
        return self.bus.take_foreign(now, at_once=has_started)

    @property
    def has_news(self) -> bool:
        """True if what has been taken in needs a round."""
        status = self.bus.status
        known = self.shown, self.outages, self.shown_refusal
        return (status.state, status.outages, status.bursts_refused) != known or self.network.has_news

    def stood_still(self, since: float) -> bool:
        """Whether the process was stopped after ``since`` for longer than deadman_ms, so that words computed
        before are stale. The next round finds the gap."""
        return (self.clock() - since) * 1000 > self.network.bus.deadman_ms

    def let_bus_work(self, now: float) -> None:
        """Let the bus do what is due, unless the process was stopped: the next round finds the gap."""
        due = self.bus.next_deadline()
        if due is None or due > now:
            if not self.stood_still(now):
                self.bus.on_time(now)
            return
        self.alarm.set(self.burst_s)
        try:
            # As a hand-over: the process may be stopped right after it has read the clock.
            self.alarm.breaks_in = True
            if not (self.stood_still(now) or self.alarm.rang):
                self.bus.on_time(now)
        except StoodStill:
            # What was broken off is handed over anew after the gap.
            self.repetitions = None
        finally:
            self.alarm.breaks_in = False

    def flush(self, now: float) -> None:
        """Hand to the bus what is to be sent and repeated now."""
        bus, network = self.bus, self.network
        routes = network.take_routes()
        if routes is not None:
            bus.accept(routes)
            bus.watch(network.ours)
        renew = now >= self.renew_at
        repetitions = self.repeated.repetitions(anew=renew)
        frames = network.take_frames()
        is_same = repetitions is self.repetitions and not frames
        ended = set[int]() if is_same else self._ended(repetitions, frames)
        # First: the kernel must not repeat an enabling word once more after a stopped one.
        for can_id in ended:
            bus.end_burst(can_id)
            del self.running[can_id]
        for frame in frames:
            bus.send(frame, now, now + _SEND_LIMIT_S)
        if not self.was_up:
            return
        if renew:
            self.renew_at = now + self.renew_s
        if repetitions is self.repetitions and not (renew or ended) and now < self.hold_at:
            return
        due = self._due(repetitions, now, renew=renew)
        self.repetitions = repetitions
        try:
            self._hand_over(due, now)
        except StoodStill:
            self.repetitions = None
            return
        self.hold_at = min(
            (at for wanted in repetitions.values() for at in wanted.hold_at if at > now), default=inf
        )
        if self.plant.unsent_stops:
            network.on_handed_over(self.plant.unsent_stops, self.clock())

    def _hand_over(self, due: list[tuple[Repetition, bool]], now: float) -> None:
        """Hand over the bursts that are due. Raises ``StoodStill`` where the process was stopped for so long
        that the rest is no longer right. What was begun then is handed over anew after the gap."""
        self.alarm.set(self.burst_s)
        try:
            for wanted, changed in due:
                # In this order: the process may be stopped right after it has read the clock, and anywhere
                # on the way to the kernel.
                self.alarm.breaks_in = True
                if self.stood_still(now) or self.alarm.rang:
                    raise StoodStill
                self._burst(wanted, now, at_once=changed)
        finally:
            self.alarm.breaks_in = False

    @property
    def burst_s(self) -> float:
        """Duration in seconds of a burst that is not renewed."""
        return self.network.bus.deadman_ms / 1000

    @property
    def renew_s(self) -> float:
        """Period in seconds in which bursts are renewed. One that has to end in a stop is no longer than the
        longest sequence that the kernel takes."""
        return min(self.burst_s, MOST_FRAMES * self.network.bus.rpdo_period_s) / RENEWALS

    def _ended(self, repetitions: Repetitions, frames: list[Frame]) -> set[int]:
        """COB-IDs of the bursts that end: a frame that is sent once takes a burst's place, too."""
        return self.running.keys() - (repetitions.keys() - {frame.can_id for frame in frames})

    def _due(self, repetitions: Repetitions, now: float, *, renew: bool) -> list[tuple[Repetition, bool]]:
        """Bursts to hand to the bus, each with whether it is new: setpoints before the enabling word.

        Mere renewals go in reverse order: a burst that is handed over later has no more frames left until the
        deadline than one before it, so setpoints end before the stop comes.
        """
        new, kept = list[tuple[Repetition, bool]](), list[tuple[Repetition, bool]]()
        # What was right at the last call is right until one has to be held.
        before = {} if now >= self.hold_at else self.repetitions or {}
        for can_id, wanted in repetitions.items():
            told = self.running.get(can_id)
            if told is None or told.frames != wanted.frames:
                new.append((wanted, True))
            elif renew or (before.get(can_id) is not wanted and not told.ends_as(wanted, now)):
                kept.append((wanted, False))
        return [*new, *reversed(kept)]

    def _burst(self, wanted: Repetition, now: float, *, at_once: bool) -> None:
        """Make the bus repeat this for the dead-man time, then what follows if its own time ends earlier."""
        ending = None
        # A deadline further ahead does not concern this burst, however long the hand-over takes.
        if wanted.until is not None and wanted.until < now + 2 * self.burst_s + wanted.period_s:
            ending = BurstEnd(wanted.until, wanted.then())
        count = burst_length(wanted.period_s, self.network.bus.deadman_ms)
        self.bus.burst(Burst(wanted.frames, wanted.period_s, count, ending), now, at_once=at_once)
        ends = now + self.burst_s + wanted.period_s
        self.running[wanted.frames[0].can_id] = RunningBurst(wanted.frames, wanted.until, ends, now)
