"""Shell of the CANopen side: drains the buses, runs every timer, keeps the bursts alive.

All of that happens in ``pump``, and only ``pump`` says that the service is alive: "process alive" and "drives
supervised" cannot come apart (``docs/explanation/dead-man-chain.md``). Between two rounds ``take_in`` takes
frames that bring nothing but values, and lets the buses do their own work: look for frames of others, and
send what the kernel does not send for them.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from functools import partial

from bridge.base.errors import OperationFailed
from bridge.base.guard import Guard
from bridge.base.turns import Turn
from bridge.can import open_all
from bridge.can.interface import Bus, ControllerState
from bridge.command import Event, EventKind, Plant, Reply, Request
from bridge.command.node import Enforcement
from bridge.master.ending import Ending, end, nmt_stops, waits_for
from bridge.master.lateness import Lateness
from bridge.master.line import RENEWALS, BusLine
from bridge.master.network import Network
from bridge.master.standstill import WatchdogTimer
from bridge.master.timer import LoopTimer
from bridge.text import Text

_log = logging.getLogger(__name__)

_REFRESH_S = 0.1
_STOP_DRIVES_S = 0.1
"""Shortest time in seconds for which stopped words are sent before the bursts end, when the service is
stopped."""
_DRIVES_FOLLOW_S = 5.0
"""Longest time for that, while a drive has not said that it follows: a quarter of TimeoutStopSec."""
_LOOK_S = 0.02

_SEVERITIES = {
    ControllerState.OK: 200,
    ControllerState.WARNING: 300,
    ControllerState.PASSIVE: 600,
    ControllerState.BUS_OFF: 900,
    ControllerState.DOWN: 900,
}


class Master:
    """Runs any number of networks on their buses in one event loop. Reports of nodes and buses are passed on
    when the words of a round are on their way.

    ``clock`` gives monotonic seconds; ``alive`` is called at the end of every complete round; ``alarm``
    detects a standstill while frames are handed to the bus; ``slept`` gives the seconds for which the machine
    has been suspended since it was called last, 0 for none.
    """

    def __init__(
        self,
        lines: list[tuple[Bus, Network]],
        plant: Plant,
        clock: Callable[[], float],
        alive: Callable[[float], None] = lambda now: None,
        alarm: WatchdogTimer | None = None,
        slept: Callable[[], float] = lambda: 0.0,
    ) -> None:
        self._alarm = alarm or WatchdogTimer()
        self._lines = [BusLine(bus, network, plant, clock, self._alarm) for bus, network in lines]
        self._plant = plant
        self._clock = clock
        self._alive = alive
        self._slept = slept
        self._lateness = Lateness(plant.image, plant.events)
        self._replies = Guard("outcome")
        self._due: float | None = None
        self._timer: LoopTimer | None = None
        self._set_timer: Callable[[float], None] = lambda at: None
        self._refresh_at = 0.0
        self._last_round: float | None = None
        self._running = False
        self._failure: asyncio.Future[None] | None = None
        self.gaps = 0

    async def start(self) -> None:
        """Open the buses. Raises ``Unavailable`` with all that cannot be opened; none stays open then."""
        try:
            open_all(partial(line.bus.open, self.on_bus) for line in self._lines)
        except BaseException:
            self._close_buses()
            raise
        self._failure = asyncio.get_running_loop().create_future()
        self._timer = LoopTimer(asyncio.get_running_loop(), self._clock, self.on_bus)
        self.attach(self._timer.arm)
        self.wake()

    def attach(self, set_timer: Callable[[float], None]) -> None:
        """Begin to run, by calls of ``take_in`` or ``pump`` at the times given to ``set_timer``."""
        self._set_timer = set_timer
        self._running = True

    def halt(self, now: float) -> None:
        """Take no more commands, and hand stopped words to the buses at once. May be called again."""
        with self._plant.turns.begin(Turn.HALT, now):
            self._plant.close(now)
            self.wake()

    async def stop_drives(self, now: float) -> Ending:
        """Take no more commands and send stopped words until every drive follows, unless the master has
        failed: for a moment at least, and not for ever. Nodes of drives that do not follow get NMT stop."""
        self.halt(now)
        if self._running:
            await asyncio.sleep(_STOP_DRIVES_S)
        for _ in range(round(_DRIVES_FOLLOW_S / _LOOK_S)):
            is_left = not any(line.network.farewell.is_on for line in self._lines)
            has_stopped = is_left and not waits_for(self._plant)
            if not self._running or has_stopped or self._clock() > now + _DRIVES_FOLLOW_S:
                break
            await asyncio.sleep(_LOOK_S)
        ending = self.stop_nodes()
        if ending.nodes_stopped:
            await asyncio.sleep(_STOP_DRIVES_S)
        return ending

    def stop_nodes(self) -> Ending:
        """Send NMT stop to the nodes of drives that do not follow."""
        with self._plant.turns.begin(Turn.STOP_NODES):
            ending = end(self._plant, can_send=self._running)
            for enforcement in nmt_stops(self._plant, ending):
                self._enforce(enforcement, self._clock())
            if ending.nodes_stopped:
                self.wake()
            return ending

    async def close(self) -> None:
        """Stop every drive's process data and close the buses."""
        self._running = False
        self._alarm.set(0.0)
        if self._timer:
            self._timer.close()
        for line in self._lines:
            for can_id in line.running:
                line.bus.end_burst(can_id)
        self._close_buses()

    def _close_buses(self) -> None:
        for line in self._lines:
            line.bus.close()

    def carry_out(self, request: Request, now: float, reply: Reply) -> bool:
        """Carry out a command on a node or a bus, or a request for a parameter; False if there is no such
        target."""
        return any(line.network.carry_out(request, now, reply) for line in self._lines)

    def wake(self) -> None:
        """Run one round, while the master runs. An outcome may call this: it is delivered when the work of a
        round is done."""
        self._carry_on(Turn.PUMP, self.pump)

    def on_bus(self) -> None:
        """Take in frames, and let the buses do their work, or run a round that is due."""
        self._carry_on(Turn.TAKE_IN, self.take_in)

    @property
    def asks(self) -> bool:
        """True while any node is asked for anything by SDO."""
        return any(node.is_asked for line in self._lines for node in line.network.nodes)

    def _carry_on(self, turn: Turn, act: Callable[[], None]) -> None:
        """Do one turn. A fault of our own ends the running: no drive is left to a master that does half of
        its work. Each drive gets a last, stopped word if possible; the bursts end within the dead-man time,
        and ``failed`` says why."""
        if self._running:
            with self._plant.turns.begin(turn):
                self._try(act)

    def _try(self, act: Callable[[], None]) -> None:
        try:
            act()
        except Exception as error:
            self._running = False
            if self._failure and not self._failure.done():
                self._failure.set_exception(OperationFailed(f"the master has failed: {error!r}"))
            self._send_last_words()
            raise

    def _send_last_words(self) -> None:
        """Send stopped words after a fault of our own: what fails for one bus must not keep the others'
        drives running."""
        now = self._clock()
        try:
            self._plant.close(now)
        except Exception:  # noqa: BLE001 - what is wrong is said already, and this is tried all the same
            _log.exception("not every drive could be stopped")
        for line in self._lines:
            try:
                line.network.say_farewell(now)
                line.flush(now)
            except Exception:  # noqa: BLE001 - nor may it keep the next bus from it
                _log.exception("bus %s: no stopped words could be sent", line.bus.name)
        self._plant.tell_events()

    async def failed(self) -> None:
        """Wait for ever, or raise ``OperationFailed`` when a fault of our own has ended the running."""
        if self._failure:
            await self._failure

    def take_in(self) -> None:
        """Take in what has come, and let the buses do what is due; a whole round follows if that has
        consequences, or if one is due.

        Otherwise all stays as the last round has left it: what is repeated, and who is alive.
        """
        now, due = self._clock(), self._due
        if due is None or now >= due:
            self.pump()
            return
        self._check_gap(now)
        self._last_round = now
        now = self._receive(now)
        if self._plant.has_news or self._lines_have_news():
            self.pump()
            return
        # After what a round sends: a SYNC that is due makes it effective.
        for line in self._lines:
            line.do_due(now)
        if self._lines_have_news():
            self.pump()
            return
        self._set_timer_for(due)
        if self._plant.events.waiting:
            self._plant.tell_events()

    def _receive(self, now: float) -> float:
        """Take in what has come; returns the time up to which. The process may have been stopped since it
        looked at the clock: then frames of others came in the gap, in which another bridge may have taken
        over."""
        for line in self._lines:
            if foreign := line.receive(now):
                now = self._clock()
                self._check_gap(now)
                self._last_round = now
                line.network.on_foreign(foreign, now)
        return now

    def _lines_have_news(self) -> bool:
        return any(line.has_news for line in self._lines)

    def pump(self) -> None:
        """Run one round: drain, judge, send, renew; then deliver outcomes."""
        now = self._clock()
        self._check_gap(now)
        if self._due is not None:
            self._lateness.on_round(self._due, now)
            self._due = None
        now = self._receive(now)
        self._run_timers(now)
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
        self._run_timers(now)
        for line in self._lines:
            line.flush(now)
            line.do_due(now)
        stop_due = self._plant.take_stop_due()
        if stop_due is not None:
            self._lateness.on_stop(stop_due, self._clock())
        if self._plant.events.waiting:
            self._plant.tell_events()
        self._last_round = now
        self._alive(now)
        self._arm(now)
        # What this causes is done in a round of its own: the present one is over. A reply is a server's code:
        # one that fails neither ends the master nor keeps another from its outcome.
        while self._plant.has_outcomes:
            with self._replies:
                self._plant.deliver_outcomes()

    def _run_timers(self, now: float) -> None:
        for enforcement in self._plant.enforcements(now):
            self._enforce(enforcement, now)

    def _enforce(self, enforcement: Enforcement, now: float) -> None:
        for line in self._lines:
            line.network.enforce(enforcement, now)

    def _check_gap(self, now: float) -> None:
        """Stop all drives after a pause longer than the dead-man time, or a suspended machine: all bursts
        have ended, and nothing that was moving may go on by itself."""
        slept_s = self._slept()
        if self._last_round is None:
            return
        pause_s = now - self._last_round
        hung = [line for line in self._lines if slept_s or pause_s * 1000 > line.network.bus.deadman_ms]
        if not hung:
            return
        self.gaps += 1
        self._lateness.on_hang(self._last_round, now)
        said = Text.of("bus.bridge_hung", pause_ms=pause_s * 1000)
        if slept_s:
            said = Text.of("bus.machine_suspended", slept_s=slept_s)
        for line in hung:
            self._plant.events.report(Event(now, EventKind.BUS, line.bus.name, 900, said))
            line.network.came_back(now)
            for node in line.network.nodes:
                for one in node.node.commanded:
                    one.channel.on_bridge_gap(now)
                    one.refresh(now)

    def _watch_bus(self, line: BusLine, now: float) -> None:
        status = line.bus.status
        is_up = status.state not in (ControllerState.DOWN, ControllerState.BUS_OFF)
        self._tell_state(line, now)
        self._tell_refusal(line, now)
        if status.outages != line.outages:
            line.outages = status.outages
            if is_up and line.was_up:
                # An outage came and went between two rounds: the bursts are gone anyway.
                line.running.clear()
                line.renew_at = now
                line.network.bus_is_gone(now)
                line.network.bus_is_back(now)
        if is_up == line.was_up:
            return
        line.was_up = is_up
        line.running.clear()
        line.renew_at = now
        if is_up:
            line.network.bus_is_back(now)
        else:
            line.network.bus_is_gone(now)

    def _tell_state(self, line: BusLine, now: float) -> None:
        """Report another state of the controller. A loose plug changes it a hundred times a second: the last
        state is reported in any case, those before it no more often than the limit allows."""
        status = line.bus.status
        if status.state is line.shown or not line.limit.allows(now):
            return
        line.shown = status.state
        state = Text.word("controller_state", status.state.name.lower())
        said = Text.of("bus.state", bus=line.bus.name, state=state)
        if status.state is not ControllerState.OK and status.last_error:
            said = Text.of("bus.state_after", bus=line.bus.name, state=state, error=status.last_error)
        self._plant.events.report(Event(now, EventKind.BUS, line.bus.name, _SEVERITIES[status.state], said))

    def _tell_refusal(self, line: BusLine, now: float) -> None:
        """Report that the kernel no longer takes bursts, or takes them again."""
        refusal = line.bus.status.bursts_refused
        if refusal == line.shown_refusal or not line.limit.allows(now):
            return
        line.shown_refusal = refusal
        said = Text.of("bus.bursts_sent_again")
        if refusal:
            said = Text.of("bus.bursts_refused", refusal=refusal)
        self._plant.events.report(Event(now, EventKind.BUS, line.bus.name, 600 if refusal else 200, said))

    def _arm(self, now: float) -> None:
        times = [self._refresh_at]
        plant = self._plant.next_deadline(now)
        if plant is not None:
            times.append(plant)
        for line in self._lines:
            # Also with the bus down: a round that comes too late means that the process hung.
            renew_at = max(min(line.renew_at, line.hold_at), now)
            times.append(renew_at if line.was_up else now + _REFRESH_S / RENEWALS)
            network = line.network.next_deadline()
            times += [] if network is None else [network]
        self._due = max(min(times), now)
        self._set_timer_for(self._due)

    def _set_timer_for(self, due: float) -> None:
        """Set the timer for the round at ``due``, or for a bus that has something to do before."""
        for line in self._lines:
            at = line.bus.next_deadline()
            if at is not None and at < due:
                due = at
        self._set_timer(due)
