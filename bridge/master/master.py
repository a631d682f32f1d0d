"""The shell of the CANopen side: drains the buses, runs every timer, keeps the bursts alive.

All of that happens in ``pump`` and nowhere else, and only ``pump`` says that the service is alive:
"process alive" and "drives supervised" cannot come apart (``docs/explanation/dead-man-chain.md``).
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from math import inf

from bridge.can import open_all
from bridge.can.burstend import MOST_FRAMES, BurstEnd
from bridge.can.interface import Bus, ControllerState
from bridge.canopen.frame import Frame
from bridge.canopen.sync import burst_length
from bridge.command import Event, Kind, Plant
from bridge.errors import OperationFailed
from bridge.master.ending import Ending, end, waits_for
from bridge.master.lateness import Lateness
from bridge.master.network import Beats, Network
from bridge.master.standstill import Alarm
from bridge.master.suspend import SuspendWatch
from bridge.master.timer import LoopTimer
from bridge.node.process.process_data import Beat, Told
from bridge.ratelimit import RateLimit

_log = logging.getLogger(__name__)

_REFRESH_S = 0.1
_SEND_LIMIT_S = 0.1
"""A frame that could not be sent for this long is stale and is dropped."""
_STOP_DRIVES_S = 0.1
"""How long stopped words are sent at least before the bursts end, when the service is stopped."""
_DRIVES_FOLLOW_S = 5.0
"""How long they are sent at most, while a drive has not said that it follows: a quarter of TimeoutStopSec."""
_LOOK_S = 0.02
_RENEWALS = 3
"""How often a burst is renewed within its dead-man time."""

_BUS_EVENTS = 10
_BUS_EVENT_EVERY_S = 5.0
_SEVERITIES = {
    ControllerState.OK: 200,
    ControllerState.WARNING: 300,
    ControllerState.PASSIVE: 600,
    ControllerState.BUS_OFF: 900,
    ControllerState.DOWN: 900,
}


@dataclass(slots=True)
class _Line:
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
        return min(self.burst_s, MOST_FRAMES * self.network.bus.rpdo_period_s) / _RENEWALS

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
        self.bus.burst(beat.frames, now, beat.period_s, count, at_once=at_once, ending=ending)
        ends = now + self.burst_s + beat.period_s
        self.beating[beat.frames[0].can_id] = Told(beat.frames, beat.until, ends, now)


class Master:
    """Runs any number of networks on their buses in one event loop.

    ``clock`` gives monotonic seconds; ``alive`` is called at the end of every complete round; ``alarm``
    notices a standstill while frames are handed to the bus; ``suspended`` gives bounds for how long the
    machine has been suspended.
    """

    def __init__(
        self,
        lines: list[tuple[Bus, Network]],
        plant: Plant,
        clock: Callable[[], float],
        alive: Callable[[float], None] = lambda now: None,
        alarm: Alarm | None = None,
        suspended: Callable[[], tuple[float, float]] = lambda: (0.0, 0.0),
    ) -> None:
        self._lines = [_Line(bus, network) for bus, network in lines]
        self._plant = plant
        self._clock = clock
        self._alive = alive
        self._alarm = alarm or Alarm()
        self._suspend = SuspendWatch(suspended)
        self._lateness = Lateness(plant)
        self._due: float | None = None
        self._timer: LoopTimer | None = None
        self._set_timer: Callable[[float], None] = lambda at: None
        self._refresh_at = 0.0
        self._last_round: float | None = None
        self._running = False
        self._in_round = False
        self._again = False
        self._failure: asyncio.Future[None] | None = None
        self.gaps = 0

    async def start(self) -> None:
        """Open the buses. Raises ``Unavailable`` with all that cannot be opened; none stays open then."""
        try:
            open_all(partial(line.bus.open, self._wake) for line in self._lines)
        except BaseException:
            self._close_buses()
            raise
        self._failure = asyncio.get_running_loop().create_future()
        self._timer = LoopTimer(asyncio.get_running_loop(), self._clock, self._wake)
        self.attach(self._timer.arm)
        self._wake()

    def attach(self, set_timer: Callable[[float], None]) -> None:
        """Run by whoever calls ``pump`` at the times given to ``set_timer``."""
        self._set_timer = set_timer
        # A changed output goes out at once, but like everything else in a complete round.
        self._plant.outputs_changed = self._wake
        self._running = True

    def halt(self, now: float) -> None:
        """Take no more commands, and hand stopped words to the buses at once. May be called again."""
        self._plant.close(now)
        self._wake()

    async def stop_drives(self, now: float) -> Ending:
        """Take no more commands and send stopped words until every drive follows, unless the master has
        failed: for a moment at least, and not for ever. Nodes of drives that do not follow get NMT stop."""
        self.halt(now)
        if self._running:
            await asyncio.sleep(_STOP_DRIVES_S)
        for _ in range(round(_DRIVES_FOLLOW_S / _LOOK_S)):
            if not self._running or not waits_for(self._plant) or self._clock() > now + _DRIVES_FOLLOW_S:
                break
            await asyncio.sleep(_LOOK_S)
        ending = end(self._plant, self._clock(), can_send=self._running)
        if ending.nodes_stopped:
            self._wake()
            await asyncio.sleep(_STOP_DRIVES_S)
        return ending

    async def close(self) -> None:
        """Stop every drive's process data and close the buses."""
        self._running = False
        self._alarm.set(0.0)
        self._plant.outputs_changed = lambda: None
        if self._timer:
            self._timer.close()
        for line in self._lines:
            for can_id in line.beating:
                line.bus.end_burst(can_id)
        self._close_buses()

    def _close_buses(self) -> None:
        for line in self._lines:
            line.bus.close()

    def _wake(self) -> None:
        """One round, while running. A fault of our own ends it: no drive is left to a master that does half
        of its work. Each drive gets a last, stopped word if possible; the bursts end within the dead-man
        time, and ``failed`` says why."""
        if not self._running:
            return
        if self._in_round:
            # Asked for by something that this round has caused: there is one more, not one within.
            self._again = True
            return
        self._in_round = True
        try:
            self.pump()
            while self._again:
                self._again = False
                self.pump()
        except Exception as error:
            self._running = False
            if self._failure and not self._failure.done():
                self._failure.set_exception(OperationFailed(f"the master has failed: {error!r}"))
            self._send_last_words()
            raise
        finally:
            self._in_round = False

    def _send_last_words(self) -> None:
        """After a fault of our own: what fails for one bus must not keep the others' drives running."""
        now = self._clock()
        try:
            self._plant.close(now)
        except Exception:  # noqa: BLE001 - what is wrong is said already, and this is tried all the same
            _log.exception("not every drive could be stopped")
        for line in self._lines:
            try:
                self._flush(line, now)
            except Exception:  # noqa: BLE001 - nor may it keep the next bus from it
                _log.exception("bus %s: no stopped words could be sent", line.bus.name)

    async def failed(self) -> None:
        """Wait for ever, or raise ``OperationFailed`` when a fault of our own has ended the running."""
        if self._failure:
            await self._failure

    def pump(self) -> None:
        """One round: drain, judge, send, renew."""
        now = self._clock()
        self._check_gap(now)
        if self._due is not None:
            self._lateness.on_round(self._due, now)
            self._due = None
        for line in self._lines:
            frames = line.bus.drain(now)
            if frames:
                line.network.on_frames(frames, now)
                self._plant.on_readings()
            foreign = line.bus.take_foreign(now)
            if foreign:
                line.network.on_foreign(foreign, now)
        self._plant.on_time(now)
        for line in self._lines:
            line.network.on_time(now)
            self._watch_bus(line, now)
        if now >= self._refresh_at:
            self._refresh_at = now + _REFRESH_S
            self._plant.refresh(now)
            self._lateness.refresh(now)
            for line in self._lines:
                line.network.refresh(line.bus.status, now)
        # A process that was stopped since the round began must not send what was right before.
        self._last_round = now
        now = self._clock()
        self._check_gap(now)
        self._plant.on_time(now)
        for line in self._lines:
            self._flush(line, now)
            if not self._stood_still(line, now):
                line.bus.on_time(now)
        if self._plant.stop_due is not None:
            self._lateness.on_stop(self._plant.stop_due, self._clock())
            self._plant.stop_due = None
        self._last_round = now
        self._alive(now)
        self._arm(now)

    def _stood_still(self, line: _Line, since: float) -> bool:
        """The process was stopped after ``since`` for longer than deadman_ms, so words computed before are
        stale. The next round finds the gap."""
        return (self._clock() - since) * 1000 > line.network.bus.deadman_ms

    def _check_gap(self, now: float) -> None:
        """After a pause longer than the dead-man time, or a suspended machine, all bursts have ended: nothing
        that was moving may go on by itself."""
        slept_s = self._suspend.take()
        if self._last_round is None:
            return
        pause_s = now - self._last_round
        hung = [line for line in self._lines if slept_s or pause_s * 1000 > line.network.bus.deadman_ms]
        if not hung:
            return
        self.gaps += 1
        message = f"the bridge hung for {pause_s * 1000:.0f} ms; all drives were left without commands"
        if slept_s:
            message = f"the machine was suspended for {slept_s:.1f} s; all drives were left without commands"
        for line in hung:
            self._plant.report(Event(now, Kind.BUS, line.bus.name, 900, message))
            line.network.came_back(now)
            for node in line.network.nodes:
                for drive in node.node.drives:
                    drive.channel.on_bridge_gap(now)
                    drive.refresh(now)

    def _watch_bus(self, line: _Line, now: float) -> None:
        status = line.bus.status
        is_up = status.state not in (ControllerState.DOWN, ControllerState.BUS_OFF)
        self._tell_state(line, now)
        self._tell_refusal(line, now)
        if status.outages != line.outages:
            line.outages = status.outages
            if is_up and line.was_up:
                # An outage came and went between two rounds: the bursts are gone anyway.
                line.beating.clear()
                line.renew_at = now
                line.network.bus_is_gone(now)
                line.network.bus_is_back(now)
        if is_up == line.was_up:
            return
        line.was_up = is_up
        line.beating.clear()
        line.renew_at = now
        if is_up:
            line.network.bus_is_back(now)
        else:
            line.network.bus_is_gone(now)

    def _tell_state(self, line: _Line, now: float) -> None:
        """The controller is in another state. A loose plug changes it a hundred times a second: the last
        one is told in any case, those before it no more often than the limit allows."""
        status = line.bus.status
        if status.state is line.shown or not line.limit.allows(now):
            return
        line.shown = status.state
        state = status.state.name.lower().replace("_", "-")
        message = f"bus {line.bus.name} is {state}"
        if status.state is not ControllerState.OK and status.last_error:
            message += f": {status.last_error}"
        self._plant.report(Event(now, Kind.BUS, line.bus.name, _SEVERITIES[status.state], message))

    def _tell_refusal(self, line: _Line, now: float) -> None:
        """The kernel no longer takes bursts, or takes them again."""
        refusal = line.bus.status.bursts_refused
        if refusal == line.shown_refusal or not line.limit.allows(now):
            return
        line.shown_refusal = refusal
        message = "the kernel sends the bursts again"
        if refusal:
            message = f"the kernel takes no bursts ({refusal}): the bridge sends them itself, less evenly"
        self._plant.report(Event(now, Kind.BUS, line.bus.name, 600 if refusal else 200, message))

    def _flush(self, line: _Line, now: float) -> None:
        bus, network = line.bus, line.network
        routes = network.take_routes()
        if routes is not None:
            bus.accept(routes)
            bus.watch(network.ours)
        renew = now >= line.renew_at
        beats = network.beats(anew=renew)
        frames = network.take_frames()
        is_same = beats is line.beats and not frames
        ended = set[int]() if is_same else line.ended(beats, frames)
        # First: the kernel must not repeat an enabling word once more after a stopped one.
        for can_id in ended:
            bus.end_burst(can_id)
            del line.beating[can_id]
        for frame in frames:
            bus.send(frame, now, now + _SEND_LIMIT_S)
        if not line.was_up:
            return
        if renew:
            line.renew_at = now + line.renew_s
        if beats is line.beats and not (renew or ended) and now < line.hold_at:
            return
        line.beats = beats
        self._alarm.set(line.burst_s)
        for beat, changed in line.due(beats, now, renew=renew):
            # In this order: the process may be stopped right after it has read the clock.
            if self._stood_still(line, now) or self._alarm.rang:
                line.beats = None
                return
            line.beat(beat, now, at_once=changed)
        line.hold_at = min((at for beat in beats.values() for at in beat.hold_at if at > now), default=inf)
        if self._plant.unsent:
            network.on_handed_over(self._clock())

    def _arm(self, now: float) -> None:
        times = [self._refresh_at]
        plant = self._plant.next_deadline(now)
        if plant is not None:
            times.append(plant)
        for line in self._lines:
            # Also with the bus down: a round that comes too late means that the process hung.
            renew_at = max(min(line.renew_at, line.hold_at), now)
            times.append(renew_at if line.was_up else now + _REFRESH_S / _RENEWALS)
            times += [t for t in (line.network.next_deadline(), line.bus.next_deadline()) if t is not None]
        self._due = max(min(times), now)
        self._set_timer(self._due)
