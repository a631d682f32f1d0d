"""One CANopen network: its nodes, its SYNC and TIME, our own heartbeat. Sans-IO.

Gives the frames that are to be sent once; repetitions are made from its nodes (``line.py``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Final

from bridge.can.interface import BusStatus
from bridge.canopen import cobid, nmt
from bridge.canopen.duplicate import DuplicateSign
from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.canopen.sync import SyncWindow
from bridge.canopen.time_stamp import TimeProducer
from bridge.command import Action, BusSide, Code, Commanded, Event, EventKind, Outcome, Reply, Request
from bridge.command.messages.request import NODE_ACTIONS
from bridge.command.node import Enforcement
from bridge.config import BusTable
from bridge.config.download import Download
from bridge.master.bus_points import BusPoints
from bridge.master.farewell import Farewell
from bridge.master.intruders import Intruders, NmtStop, Taker
from bridge.master.mastership import BusMastership
from bridge.master.reach import Reach
from bridge.master.schedule import Schedule
from bridge.master.standby import Standby
from bridge.master.startup import StartGate
from bridge.master.watch import BusWatch
from bridge.node import nmt_commands as node_commands
from bridge.node.identifiers import BusIdentifiers
from bridge.node.neighbours import Neighbour
from bridge.node.node_core import BUS_IS_DOWN, NodeCore
from bridge.node.wire import Handler
from bridge.text import Text

NOTHING: Final[Mapping[str, Sequence[Download]]] = MappingProxyType({})


class Network:
    """All configured nodes of one bus.

    ``epoch_ns`` gives the wall clock in ns at a monotonic time, for TIME; without it none is sent.
    """

    def __init__(
        self,
        bus: BusTable,
        side: BusSide,
        epoch_ns: Callable[[float], int] | None = None,
        downloads: Mapping[str, Sequence[Download]] = NOTHING,
        listening: Standby | None = None,
    ) -> None:
        """``downloads`` has the configurations that files give, by node name. ``listening`` is that of the
        bus, unless given."""
        self.bus = bus
        self._image = side.image
        self._events = side.events
        identifiers = BusIdentifiers()
        self.nodes = [
            NodeCore(node, side, self, identifiers, downloads.get(node.name, ())) for node in side.nodes
        ]
        for node in self.nodes:
            identifiers.add(node.wire)
        self._gate = StartGate(bus.mandatory_missing, self.nodes)
        self._schedule = Schedule(self.nodes)
        own_id = bus.master_node_id if bus.heartbeat_ms else None
        known = {node.table.id: node.node.name for node in self.nodes}
        self.mastership = BusMastership(bus, self.nodes, side.events, listening)
        self.farewell = Farewell(self.nodes)
        self._reach = Reach(self.nodes, self.mastership, self.farewell)
        self._reach.on_bus(side.began)
        self._watch = BusWatch(bus.name, own_id, self.mastership, known, side)
        self._intruders = Intruders(bus, self.nodes, side.events, self.mastership)
        self.ours: frozenset[int] = frozenset()
        """Identifiers of what we repeat, on which nobody else may send; updated by ``take_routes``."""
        self._has_booted = False
        self._has_news = False
        self._has_started = False
        self._nmt_for_all: Frame | None = None
        self._routes_changed = True
        self._routes: dict[int, Handler] = {}
        self.routings = 0
        """Number of times that ``take_routes`` has found other identifiers."""
        self._window = SyncWindow(bus.sync_window_us / 1e6) if bus.sync_window_us else None
        self._time = TimeProducer(bus.time_period_s, epoch_ns) if bus.time_period_s and epoch_ns else None
        self._frames: list[Frame] = []
        self._points = BusPoints(bus, side)

    def on_frames(self, frames: list[Frame], now: float) -> bool:
        """Take all that was received, in order; returns whether a node has restarted by it."""
        self._has_started = False
        routes = self._routes
        for frame in frames:
            handler = routes.get(frame.can_id)
            if handler is not None:
                handler(frame)
        self._pump(now)
        return self._has_started

    def on_foreign(self, frames: list[Frame], now: float) -> None:
        """Take frames of others on identifiers that are ours."""
        self._has_news = True
        for frame in frames:
            if frame.can_id == cobid.ERROR_CONTROL + self.bus.master_node_id:
                self._watch.on_own_id(now)
            if self._intruders.is_sign(frame, acts=self.mastership.acts()):
                self._on_other_bridge(self._intruders.name(frame), now)
            self._stop_nodes(self._intruders.on_frame(frame))
        self._pump(now)

    def _on_other_bridge(self, sign: Text, now: float) -> None:
        if why := self.mastership.heard(sign, now):
            self._give_way(now, why)
            self.mastership.say_passive(now)

    def _pump(self, now: float) -> None:
        """Continue every boot-up that something has happened to, and start nodes that may start."""
        while touched := self._schedule.take_touched():
            self._has_news = True
            for node in touched:
                node.booting.pump(now)
            self._gate.judge()
            for node in self.nodes:
                if node.booting.is_held and self._gate.may_start(node):
                    node.booting.pump(now)
                    self._schedule.touch(node)
            for node in touched:
                self._frames += node.wire.take_frames(only_commands=not self.mastership.acts())
                self._routes_changed |= node.wire.routes_changed
                self._schedule.plan(node)
            self._reach.tell(touched, now)

    def on_time(self, now: float) -> None:
        if not (self.mastership.acts() or self._begins_to_act(now)):
            self.farewell.on_time(now)
            self._touch_all(self.farewell.told)
            self._pump(now)
            return
        if not self._has_booted:
            self._boot_up(now)
        if self._time:
            frame = self._time.on_time(now)
            self._frames += [frame] if frame else []
        for node in self._schedule.take_due(now):
            node.on_time(now)
            self._schedule.touch(node)
        self._intruders.on_time(now)
        self._pump(now)

    def _begins_to_act(self, now: float) -> bool:
        if not self.routings:
            # The bus lets nothing in yet, so its silence proves nothing.
            return False
        was_passive = self.mastership.is_passive
        self.mastership.on_time(now)
        self._reach.on_bus(now)
        if was_passive and self.mastership.acts():
            # The other bridge may have started a node that was to stay stopped.
            self._return(now)
        return self.mastership.acts()

    def next_deadline(self) -> float | None:
        if not self.mastership.acts():
            times = (self.mastership.next_deadline(), self.farewell.next_deadline())
            return min((time for time in times if time is not None), default=None)
        time_at = self._time.next_deadline() if self._time else None
        times = (self._schedule.next_deadline(), time_at, self._intruders.next_deadline())
        return min((time for time in times if time is not None), default=None)

    def came_back(self, now: float) -> None:
        """Note that the bridge was away for longer than its bursts last."""
        self.mastership.came_back(now)

    def _on_single(self, take: Taker, frame: Frame) -> None:
        """Take a frame of somebody else on an identifier on which we send single frames."""
        self._stop_nodes(take(frame))

    def _stop_nodes(self, stops: Iterator[NmtStop]) -> None:
        for nodes, why, at in stops:
            are_all = len(nodes) == len(self.nodes) > 1 and not self._takes_over(nodes)
            for node in nodes:
                node.carry_out_command(Action.STOP_NODE, why, at, send=not are_all)
            if are_all:
                self._nmt_for_all = nmt.command(NmtCommand.STOP, 0)

    @staticmethod
    def _takes_over(nodes: Sequence[NodeCore]) -> bool:
        """Whether a node needs a SYNC for its stopped words before its NMT stop: each waits for its own."""
        return any(node.leaving.takeover_s for node in nodes)

    # NMT

    def _boot_up(self, now: float) -> None:
        """Send our boot-up message (CiA 301 §7.2.8.3.3) on the new bus, and reset nodes that need it."""
        self._has_booted = True
        if self.bus.heartbeat_ms:
            self._frames.append(Frame(cobid.ERROR_CONTROL + self.bus.master_node_id, b"\0"))
        if self.bus.reset_at_start == "none":
            return
        whole = self.bus.reset_at_start == "node"
        action = Action.RESET if whole else Action.RESET_COMMUNICATION
        for node in sorted(self.nodes, key=lambda node: node.table.start_order):
            if node.table.enabled:
                # A reset of the communication waits until the stopped words have been taken over.
                node.carry_out_command(action, Text.of("stopped_by.start"), now, send=not whole)
                self._frames += node.wire.take_frames(only_commands=True)
                if whole:
                    self._frames.append(nmt.command(node_commands.NMT[action], node.table.id))

    @property
    def nmt_state(self) -> NmtState:
        """Our own NMT state: pre-operational while a mandatory node keeps the others waiting (CiA 302-2)."""
        if not self._has_booted:
            return NmtState.INITIALISING
        return NmtState.OPERATIONAL if self._gate.is_open else NmtState.PRE_OPERATIONAL

    # requests

    def carry_out(self, request: Request, now: float, reply: Reply) -> bool:
        """Carry out a command on a node or on all of them, or a request for a parameter; False where its
        target is not on this bus."""
        if request.action not in NODE_ACTIONS:
            return self._ask_drive(request, now, reply)
        is_bus = request.target == f"bus/{self.bus.name}"
        nodes = [node for node in self.nodes if is_bus or node.node.name == request.target]
        if not (nodes or is_bus):
            return False
        if self.mastership.why_not:
            reply(Outcome(Code.NOT_READY, self.mastership.why_not, forwarded=False))
            return True
        name = self.bus.name if is_bus else request.target
        if node_commands.answer(request, name, nodes, self._events, now, reply):
            self._nmt_for_all = nmt.command(node_commands.NMT[request.action], 0)
        self._reach.tell(nodes, now)
        return True

    def _ask_drive(self, request: Request, now: float, reply: Reply) -> bool:
        for node in self.nodes:
            for who in node.node.members:
                if who.name == request.target:
                    node.ask(request, who, now, reply)
                    return True
        return False

    def enforce(self, enforcement: Enforcement, now: float) -> None:
        """Carry out the enforcement on its node, if that is on this bus."""
        for node in self.nodes:
            if node.node.name == enforcement.node:
                node.enforce(enforcement.action, enforcement.why, now)

    # as its nodes see it

    def touched(self, node: Neighbour) -> None:
        self._schedule.touch(node)

    def started_anew(self, node: Neighbour) -> None:
        self._has_started = True

    def may_start(self, node: Neighbour) -> bool:
        self._gate.judge()
        return self._gate.may_start(node)

    def stop_others(self, node: Neighbour, why: Text, now: float) -> None:
        """Stop all nodes, because one is lost without which the others must not go on."""
        self._gate.stopped_by(node)
        said = Text.of("bus.all_stopped", why=why)
        self._events.report(Event(now, EventKind.BUS, self.bus.name, 800, said))
        each = self._takes_over(self.nodes)
        for other in self.nodes:
            # The lost one included, if it still hears us.
            other.was_told(NmtCommand.STOP)
            if other is not node:
                other.hold(why, now)
                self._schedule.touch(other)
            if each:
                other.leaving.send(NmtCommand.STOP, now)
        if not each:
            self._nmt_for_all = nmt.command(NmtCommand.STOP, 0)

    def duplicate(self, node: Neighbour, sign: DuplicateSign, now: float) -> None:
        self._watch.on_duplicate(node.table.id, sign, now)

    # sending

    @property
    def waiting(self) -> int:
        """Number of plans and frames that it holds: bounded, whatever is received."""
        return len(self._schedule) + len(self._frames)

    @property
    def has_news(self) -> bool:
        """True if a node has brought more than signs of life since ``take_frames``."""
        return self._has_news or self._schedule.is_touched

    def take_frames(self) -> list[Frame]:
        """Frames to be sent once, now."""
        self._has_news = False
        frames, self._frames = self._frames, []
        if not self.mastership.acts():
            self._nmt_for_all = None
            frames = frames if self.farewell.is_on else []
            self.farewell.on_sending(has_frames=bool(frames))
            return frames
        if self._nmt_for_all:
            # Last: the stopped words of the drives go before it.
            frames.append(self._nmt_for_all)
            self._nmt_for_all = None
        return frames

    def take_routes(self) -> list[int] | None:
        """Identifiers to be received; None if they have not changed since the last call."""
        if not self._routes_changed:
            return None
        self._routes_changed = False
        self.routings += 1
        self._routes = self._watch.routes()
        for node in self.nodes:
            self._routes.update(node.take_routes())
        self.ours = self._intruders.watched(self._routes)
        singles = self._intruders.routes(self._routes)
        self._routes |= {can_id: partial(self._on_single, take) for can_id, take in singles.items()}
        if self._window:
            self._judge_by_window(self._window)
        return list(self._routes)

    def _judge_by_window(self, window: SyncWindow) -> None:
        """Judge each synchronous TPDO by the SYNC window before its drive gets it; SYNC comes back to us."""

        def judged(handler: Handler) -> Handler:
            def judge(frame: Frame) -> None:
                window.on_tpdo(frame)
                handler(frame)

            return judge

        self._routes[cobid.SYNC] = window.on_sync
        for node in self.nodes:
            for tpdo in (tpdo for pdos in node.wire.pdos for tpdo in pdos.tpdos):
                if tpdo.is_synchronous and tpdo.cob_id in self._routes:
                    self._routes[tpdo.cob_id] = judged(self._routes[tpdo.cob_id])

    def on_handed_over(self, unsent: set[Commanded], now: float) -> None:
        """Begin the time bounds of stops, and have outputs read back: the bus repeats what it is to repeat.
        Those whose stop is sent by that are taken out of ``unsent``."""
        for node in self.nodes:
            for one in node.node.commanded:
                is_sent = node.sends_process_data and node.wire.carries(one)
                if one in unsent and (is_sent or not one.stop_check.awaits_sending):
                    unsent.discard(one)
                    one.on_handed_over(now)
                    self._schedule.plan(node)

    def _give_way(self, now: float, why: Text) -> None:
        """Give way to another bridge: nothing more is sent than what is owed."""
        self._forget_bus(now, why)
        self.say_farewell(now)
        self._reach.on_bus(now)

    def say_farewell(self, now: float) -> None:
        """Send what is owed, if this bridge no longer acts."""
        if not self.mastership.acts():
            self.farewell.begin(now)
            self._touch_all(self.nodes)
            self._pump(now)

    def _touch_all(self, nodes: Sequence[NodeCore]) -> None:
        for node in nodes:
            self._schedule.touch(node)

    def bus_is_gone(self, now: float) -> None:
        self.mastership.bus_is_gone()
        self._intruders.bus_is_gone()
        self.farewell.bus_is_gone()
        self._forget_bus(now)
        self._reach.on_bus(now, is_up=False)

    def _forget_bus(self, now: float, why: Text = BUS_IS_DOWN) -> None:
        self._frames.clear()
        if self._window:
            self._window.reset()
        self._has_booted = False
        self._nmt_for_all = None
        for node in self.nodes:
            node.bus_is_gone(now, why)
        self._touch_all(self.nodes)

    def bus_is_back(self, now: float) -> None:
        """Go on after an outage: what was written while the bus was down must not be sent first."""
        self.mastership.bus_is_back(now)
        if self.mastership.acts():
            self._return(now)
        self.say_farewell(now)
        self._reach.on_bus(now, is_up=True)

    def _return(self, now: float) -> None:
        for node in self.nodes:
            node.bus_is_back(now)
        self._touch_all(self.nodes)

    def refresh(self, status: BusStatus, now: float) -> None:
        """Update the points of the bus and its nodes; called a few times a second."""
        self._points.refresh(status, now)
        top = f"bus/{self.bus.name}"
        self._image.put(f"{top}/sync_window_misses", self._window.misses if self._window else 0, now)
        self._image.put(f"{top}/nmt_state", int(self.nmt_state), now)
        self._image.put(f"{top}/held_by", ", ".join(self._gate.missing), now)
        self._watch.refresh(now)
        self._image.put(f"{top}/intruders", self._intruders.count, now)
        self._image.say(self._image.index[f"{top}/last_intruder"], self._intruders.last, now)
        self._image.put(f"{top}/passive", self.mastership.is_passive, now)
        for node in self.nodes:
            node.wire.refresh(now)
            if node.wire.habits.has_news:
                node.tell_habits(now)
            # Whoever has asked it for something meanwhile: its deadlines are looked at.
            self._schedule.plan(node)
