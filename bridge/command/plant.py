"""The plant: every drive of the site with its channel and its points, and the image they share.

Northbounds read the image and submit requests; the master feeds it. Neither knows the other.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from typing import Final, TypeVar

from bridge.base.guard import Guard
from bridge.base.ratelimit import RateLimit
from bridge.base.turns import Turn, Turns
from bridge.catalogue import Catalogue, DeviceSpec, NodeSpec
from bridge.catalogue.points import CONNECTION_COUNTS
from bridge.command.audit import AuditTrail, Rejection
from bridge.command.commanded import Commanded
from bridge.command.deadlines import Deadlines
from bridge.command.device import Device
from bridge.command.drive import Drive
from bridge.command.effects import Effects
from bridge.command.ignored_stop import concluded
from bridge.command.messages.event import Event, EventGate, EventKind, EventQueue
from bridge.command.messages.request import (
    NODE_ACTIONS,
    PARAMETER_ACTIONS,
    STOP_ACTIONS,
    Action,
    Code,
    Identity,
    Outcome,
    Reply,
    Request,
)
from bridge.command.node import BusSide, Enforcement, Node
from bridge.command.outputs import Outputs
from bridge.command.refusals import Refusals
from bridge.command.stop_check.state import StopVerdict
from bridge.config import BusTable, Site
from bridge.image import Image, Quality, Value
from bridge.parameter import Ledger
from bridge.text import Said, Text

CarryOut = Callable[[Request, float, Reply], bool]
"""Executor of a command on a node or a bus, or of a parameter request; False where there is none."""


def on_no_bus(request: Request, now: float, reply: Reply) -> bool:
    """Refuse a command on a node or a bus where the plant is on no bus."""
    return False


One = TypeVar("One", bound=Commanded)
_SEVERITY_MISSED, _MISSED_EVENTS, _MISSED_EVERY_S = 700, 3, 60.0
_BRINGS_TIMERS_FORWARD: Final = (Action.SET_TIMEOUT, Action.TAKE_CONTROL)


class Plant:
    """All drives of a site.

    ``began`` is the monotonic time of what is known from the start, such as the version. ``on_event``
    callbacks get the events. ``turns`` has each change of it.
    """

    def __init__(
        self, catalogue: Catalogue, version: str, began: float = 0.0, turns: Turns | None = None
    ) -> None:
        self.catalogue, self.began, self.turns = catalogue, began, turns or Turns()
        self.image = Image(catalogue.points)
        self.audit = AuditTrail(self.image)
        self.eeprom_writes = Ledger()
        """Count of writes of each parameter; whoever keeps it across restarts fills it first."""
        self.events = EventQueue()
        """Events of nodes and buses that nobody has been told of yet."""
        self.unsent_stops: set[Commanded] = set()
        """Drives and outputs with a stop that has not been handed to the bus yet."""
        self.because: Callable[[Event], Said] = lambda event: ""
        """Finder of an event's cause; empty where none is known."""
        self._effects = Effects(self.events)
        self._changed: dict[str, set[str]] = {bus.name: set() for bus in catalogue.site.bus}
        self._deadlines = Deadlines[Commanded]()
        self._missed_limit = RateLimit(_MISSED_EVENTS, _MISSED_EVERY_S)
        self._listeners: list[Callable[[Event], None]] = []
        self._outcomes: deque[tuple[Reply, Outcome]] = deque()
        self._gate, self._guard = EventGate(), Guard("event")
        self._refusals = Refusals(catalogue, self.events)
        self._is_closing = False
        self._commanded: dict[str, Commanded] = {}
        """All drives, and the outputs of devices by their nodes."""
        self.nodes = {name: self._node(spec) for name, spec in catalogue.nodes.items()}
        self.drives = {drive.name: drive for node in self.nodes.values() for drive in node.drives}
        self.members = {one.name: one for node in self.nodes.values() for one in node.members}
        """Drives and devices, by their names."""
        self._begin(version)

    def _node(self, spec: NodeSpec) -> Node:
        """A node with its drives, or its device."""
        drives = [self._added(Drive(one, self.image, self._effects)) for one in spec.drives]
        devices = [Device(one, self.image, self._outputs(one)) for one in spec.devices]
        return Node(spec, drives, devices, self.image)

    def _outputs(self, spec: DeviceSpec) -> Sequence[Outputs]:
        """Outputs of a device, as one that is commanded; empty where it has none."""
        return [self._added(Outputs(spec, self.image, self._effects))] if spec.is_commanded else []

    def _begin(self, version: str) -> None:
        """Show what is known from the start."""
        began = self.began
        for node in self.nodes.values():
            node.begin(began)
            self._effects.settled |= dict.fromkeys((one.name for one in node.commanded), began)
        self.settle()
        self.set("bridge/version", version, began)
        self.set("bridge/drives_configured", len(self.drives), began)
        for leaf in CONNECTION_COUNTS:
            self.count(leaf, began, 0)

    @property
    def site(self) -> Site:
        return self.catalogue.site

    def _added(self, one: One) -> One:
        self._deadlines.add(one)
        self._commanded[one.name] = one
        return one

    @property
    def commanded(self) -> Collection[Commanded]:
        """All drives, and the outputs of devices."""
        return self._commanded.values()

    def close(self, now: float) -> None:
        """Stop everything, and take no command any more but stops."""
        self._is_closing = True
        for one in self._commanded.values():
            one.channel.on_bridge_gap(now)
        self._conclude()

    def side_of(self, bus: BusTable) -> BusSide:
        """The plant as the nodes of this bus see it."""
        nodes = [node for node in self.nodes.values() if node.bus is bus]
        return BusSide(nodes, self.image, self.events, self.eeprom_writes, self.began)

    def take_stop_due(self) -> float | None:
        """Earliest due time of the stops that were handed to a bus since the last call, of drives that had
        tripped; None where there was none."""
        due, self._effects.stop_due = self._effects.stop_due, None
        return due

    def on_event(self, listener: Callable[[Event], None]) -> None:
        self._listeners.append(listener)

    def forget(self, listener: Callable[[Event], None]) -> None:
        """Tell ``listener`` no more."""
        if listener in self._listeners:
            self._listeners.remove(listener)

    def report(self, event: Event) -> None:
        """Tell the listeners of an event, after those that wait."""
        with self.turns.begin(Turn.REPORT, event):
            self._report(event)

    def _report(self, event: Event) -> None:
        if self.events.waiting:
            self.tell_events()
        self._tell(event)

    def tell_events(self) -> None:
        """Tell the listeners what nodes and buses have reported since the last call."""
        while self.events.waiting:
            for event in self.events.take():
                self._tell(event)

    def _tell(self, event: Event) -> None:
        if not self._gate.admits(event):
            return
        with self._guard:
            event = replace(event, because=self.because(event))
        for listener in tuple(self._listeners):
            with self._guard:
                listener(event)

    def set(
        self, name: str, value: Value, now: float, quality: Quality = Quality.GOOD, why: Said = ""
    ) -> None:
        """Set a point by its full name."""
        self.image.put(name, value, now, quality, why)

    def submit(self, request: Request, now: float, reply: Reply, carry_out: CarryOut = on_no_bus) -> bool:
        """Carry out ``request``; ``reply`` is called exactly once, now or later. ``carry_out`` takes what is
        not done by a drive's channel.

        Returns True if a round must run now.
        """
        is_urgent = self._submit(request, now, reply, carry_out)
        self._conclude()
        return is_urgent

    def _submit(self, request: Request, now: float, reply: Reply, carry_out: CarryOut) -> bool:
        reply = self.audit.follow(request, now, reply)
        if self._is_closing and request.action not in STOP_ACTIONS:
            reply(Outcome(Code.NOT_READY, Text.of("request.bridge_ends"), forwarded=False))
            return False
        if request.action in NODE_ACTIONS:
            reply = self._refusals.counted(request, now, reply)
            is_taken = carry_out(request, now, reply)
            if not is_taken:
                reply(Outcome(Code.UNKNOWN_TARGET, Text.of("request.no_node", node=request.target)))
            return is_taken
        one = self._commanded.get(request.target)
        if request.target not in self.members:
            reply = self._refusals.counted(request, now, reply)
            reply(Outcome(Code.UNKNOWN_TARGET, Text.of("request.no_drive", drive=request.target)))
            return False
        if request.action in PARAMETER_ACTIONS:
            is_taken = carry_out(request, now, reply)
            if not is_taken:
                reply = self._refusals.counted(request, now, reply)
                said = Text.of("request.on_no_bus", target=request.target)
                reply(Outcome(Code.NOT_READY, said, forwarded=False))
            return is_taken
        if one is None:
            reply = self._refusals.counted(request, now, reply)
            said = Text.of("request.no_outputs", target=request.target)
            reply(Outcome(Code.READ_ONLY, said, forwarded=False))
            return False
        before, until = one.channel.wired, one.channel.until
        one.channel.handle(request, now, reply)
        is_changed = one.channel.wired != before or request.action in _BRINGS_TIMERS_FORWARD
        # The bus may have been told to stop the drive by itself: not any more, its owner is there.
        return is_changed or (until is not None and until < now + one.burst_s)

    def reply_later(self, reply: Reply) -> Reply:
        """Reply that waits for ``deliver_outcomes``: what an outcome causes does not happen in the midst of
        what has brought it about."""
        return lambda outcome: self._outcomes.append((reply, outcome))

    @property
    def has_outcomes(self) -> bool:
        """An outcome waits to be delivered."""
        return bool(self._outcomes)

    def deliver_outcomes(self) -> None:
        """Give each waiting outcome to whoever asked, and those that come of it. Raises what a reply raises:
        the others are still there to be delivered."""
        while self._outcomes:
            reply, outcome = self._outcomes.popleft()
            reply(outcome)

    def on_connection(
        self, identity: Identity, now: float, *, is_there: bool, has_others: bool = False
    ) -> None:
        """Note that a connection of ``identity`` has begun or ended, and whether the same user has others: no
        telegram, and no end of control. Told where a protocol knows it."""
        for one in self._commanded.values():
            one.channel.on_connection(identity, now, is_there=is_there, has_others=has_others)

    def rejected(self, rejection: Rejection, now: float, count: int = 1) -> None:
        """Take over ``count`` refusals by a protocol itself: counted, told and logged as a drive's."""
        self.audit.rejected(rejection, now, count)
        self._refusals.report(
            rejection.action, rejection.identity, rejection.target, rejection.said, now, count
        )
        self._conclude()

    def count(self, leaf: str, now: float, by: int) -> None:
        """Count up a point of the bridge's own, such as ``modbus_refused_connections``."""
        index = self.image.index[f"bridge/{leaf}"]
        self.image.set(index, int(self.image[index].value) + by, now)

    def enforcements(self, now: float) -> Iterator[Enforcement]:
        """Enforcements on the nodes of those that ignore their stops. All channels' timers run while it is
        iterated: carry each out before the next is taken, for it decides what becomes of another drive of
        that node."""
        self.settle()
        for one in self._deadlines.take_due(now):
            verdicts = one.on_time(now)
            self.settle()
            for verdict in verdicts:
                action = self._stop_ended(one, verdict, now)
                if action is not None:
                    yield Enforcement(one.node_name, action, Text.of("stopped_by.plant", name=one.name))

    def _stop_ended(self, one: Commanded, verdict: StopVerdict, now: float) -> Action | None:
        """Report how a stop has ended. Returns the action to be taken on the node."""
        conclusion = concluded(self.nodes[one.node_name], one, verdict, now)
        self.audit.stop_ended(one.name, verdict.outcome.label, conclusion.logged, now)
        if conclusion.event is not None:
            self.events.report(conclusion.event)
        return conclusion.action

    def refresh(self, now: float) -> None:
        """Bring ages, counters and qualities up to date: the slow part, called a few times a second."""
        self.settle()
        for one in self._deadlines.sweep(now):
            if self._missed_limit.allows(now):
                said = Text.of("watchdog.deadline_missed")
                self._report(Event(now, EventKind.WATCHDOG, one.name, _SEVERITY_MISSED, said))
        self.set("bridge/missed_deadlines", self._deadlines.missed, now)
        for member in self.members.values():
            member.look(now)
        self.image.tell_kept()
        good = sum(drive.quality is Quality.GOOD for drive in self.drives.values())
        self.set("bridge/drives_good", good, now)
        refused = sum(member.refused_writes for member in self.members.values())
        self.set("bridge/refused_writes", refused + self._refusals.count, now)

    def _conclude(self) -> None:
        """Apply the effects of a call, and tell its events."""
        self.settle()
        self.tell_events()

    def settle(self) -> None:
        """Apply the effects of drives and outputs since the last call."""
        effects = self._effects
        if not (effects.settled or effects.due):
            return
        settled, due = effects.settled, effects.due
        effects.settled, effects.due = {}, {}
        for name, at in settled.items():
            one = self._commanded[name]
            node = self.nodes[one.node_name]
            self._changed[node.bus.name].add(node.name)
            if one.stop_check.awaits_sending:
                self.unsent_stops.add(one)
            node.show(at)
        for name in due:
            self._deadlines.touch(self._commanded[name])

    def next_deadline(self, now: float) -> float | None:
        self.settle()
        return self._deadlines.next(now)

    @property
    def has_news(self) -> bool:
        """Something beside the values of drives has changed since the last round."""
        effects = self._effects
        if effects.settled or effects.due or self._outcomes:
            return True
        return self._deadlines.is_touched or any(self._changed.values())

    def take_changed(self, bus: str) -> set[str]:
        """Names of the nodes of this bus with a drive that may be sent other words since the last call."""
        self.settle()
        changed = self._changed[bus]
        if changed:
            self._changed[bus] = set()
        return changed


class PlantView:
    """The plant of this process as its servers see it (``bridge.northbound.view``).

    ``clock`` is the plant's, ``epoch_ns`` the wall clock at one of its times. ``carry_out`` is the
    master's, and ``wake`` has it send at once what has changed."""

    def __init__(
        self,
        plant: Plant,
        clock: Callable[[], float],
        epoch_ns: Callable[[float], int],
        carry_out: CarryOut = on_no_bus,
        wake: Callable[[], None] = lambda: None,
    ) -> None:
        self._plant = plant
        self._clock = clock
        self._carry_out = carry_out
        self._wake = wake
        self._turns = plant.turns
        self.image: Image = plant.image
        self.epoch_ns = epoch_ns
        self.on_event, self.forget = plant.on_event, plant.forget

    def hurry(self, *, is_wanted: bool) -> None:
        """Do nothing: changes are here at once anyway."""

    def look(self, drive: str) -> None:
        with self._turns.begin(Turn.LOOK, drive):
            self._plant.members[drive].look(self._clock())

    def submit(self, request: Request, reply: Reply) -> None:
        with self._turns.begin(Turn.SUBMIT, request):
            is_changed = True
            try:
                later = self._plant.reply_later(self._turns.heard(reply))
                is_changed = self._plant.submit(request, self._clock(), later, self._carry_out)
                # Of one telegram that is several requests, the bus gets what the last of them has left.
                self._plant.deliver_outcomes()
            finally:
                if is_changed:
                    self._wake()

    def rejected(self, rejection: Rejection, at: float | None = None, count: int = 1) -> None:
        """Pass on ``count`` rejections of this kind, the last ``at`` a time of the plant's, or now."""
        with self._turns.begin(Turn.REJECTED, rejection, at, count):
            self._plant.rejected(rejection, self._clock() if at is None else at, count)

    def count(self, leaf: str, by: int = 1) -> None:
        with self._turns.begin(Turn.COUNT, leaf, by):
            self._plant.count(leaf, self._clock(), by)

    def on_connection(self, identity: Identity, *, is_there: bool, has_others: bool = False) -> None:
        with self._turns.begin(Turn.CONNECTION, identity, is_there, has_others):
            now = self._clock()
            self._plant.on_connection(identity, now, is_there=is_there, has_others=has_others)
