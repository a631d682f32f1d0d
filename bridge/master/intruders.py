"""Frames of others on identifiers that belong to the bridge alone: counted, reported, answered. Sans-IO.

What the bridge sends by its site file is its own: RPDOs, SYNC, TIME, its heartbeat, requests to the SDO
servers of its nodes. Where it sends no SYNC or TIME, somebody else may produce them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, NamedTuple

from bridge.base.nmt_texts import text_of_command, text_of_state
from bridge.base.ratelimit import Pauses
from bridge.base.sdo_texts import text_of_request
from bridge.canopen import cobid, nmt
from bridge.canopen.decode_sdo import SdoListener, SdoSaid
from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.command import Drive, Event, EventKind, EventQueue
from bridge.config import BusTable
from bridge.drive import DriveState
from bridge.master.answers import Answers
from bridge.master.mastership import BusMastership
from bridge.node.node_core import NodeCore
from bridge.node.process.command_frames import CommandFrame, commands_of
from bridge.node.process.process_data import DrivePdos
from bridge.node.wire import Handler
from bridge.text import Said, Text, Words

_AGAIN_S: Final = 10.0
"""Period in seconds of the reports on an intruder that goes on, each with the number of frames since the last
one."""
_STOP_AGAIN_S: Final = 1.0
"""Period in seconds of the stops to a node that is held stopped, for frames that do not bring its drives
back."""
_PATIENCE_S: Final = 1.0
"""Time in seconds for which answers may leave a drive enabled now and then before its node is reset."""
_RESET_AGAIN_S: Final = 2.0
"""Time in seconds that a reset node gets to start."""
_ENDED_S: Final = 2.0
"""Silence in seconds after which an intruder has ended."""
_NMT_BYTES: Final = 2
_SEVERE: Final = 900
_HARMLESS: Final = 500


class NmtStop(NamedTuple):
    """NMT stop of nodes at a monotonic time in seconds, because of an intruder."""

    nodes: Sequence[NodeCore]
    why: Text
    at: float


Taker = Callable[[Frame], Iterator[NmtStop]]
"""Taker of a frame. It gives the stops that are due by it: carry each out before the next is taken."""


class Intruders:
    """Frames of others on identifiers of the bridge. ``count`` is their number since the start; ``last`` the
    latest one reported."""

    def __init__(
        self,
        bus: BusTable,
        nodes: Sequence[NodeCore],
        events: EventQueue,
        mastership: BusMastership,
    ) -> None:
        """``mastership`` tells whether this bridge is in charge: while another one is, nobody is an
        intruder."""
        self.count = 0
        self.last: Said = ""
        self._bus = bus
        self._nodes = nodes
        self._events = events
        self._mastership = mastership
        self._commands: dict[int, tuple[NodeCore, CommandFrame]] = {}
        self._heartbeat_id = cobid.ERROR_CONTROL + bus.master_node_id if bus.heartbeat_ms else None
        self._sdo: dict[int, SdoListener] = {}
        self._pauses = Pauses(_AGAIN_S)
        self._stopped: dict[int, float] = {}
        self._answers = Answers(bus.bitrate)
        self._series: dict[int, _Series] = {}
        """Series of answers, by node id."""
        self._spoken = frozenset(
            tpdo.cob_id for node in nodes for drive in node.table.drive for tpdo in drive.tpdo
        )
        """COB-IDs that the site file gives to TPDOs: they come before the boot-up has ended."""
        self._given = {can_id: node for node in nodes for can_id in node.wire.stop_words.given_ids}
        """Node of each identifier that the site's files give away."""
        self._known: dict[int, tuple[Mapping[str, DrivePdos], dict[int, CommandFrame]]] = {}
        """Command frames of each node, by node id, as long as it has these PDOs."""

    # whose identifiers

    def watched(self, taken: Mapping[int, Handler]) -> frozenset[int]:
        """Identifiers that we repeat and nobody else may use, by the nodes' present state; without those
        ``taken`` by a node of the site for something of its own."""
        self._commands = {
            can_id: (node, command)
            for node in self._nodes
            for can_id, command in self._commands_of(node).items()
            if can_id not in taken and can_id not in self._spoken and self._given.get(can_id, node) is node
        }
        watched = set(self._commands)
        if self._bus.sync_period_ms:
            watched.add(cobid.SYNC)
        if self._heartbeat_id is not None:
            watched.add(self._heartbeat_id)
        return frozenset(watched)

    def _commands_of(self, node: NodeCore) -> dict[int, CommandFrame]:
        connected = node.wire.drives
        known = self._known.get(node.table.id)
        if known is None or known[0] is not connected:
            commands = commands_of(node.node, connected, node.wire.stop_words, node.wire.output_pdos)
            known = self._known[node.table.id] = connected, commands
        return known[1]

    def routes(self, others: Mapping[int, Handler]) -> dict[int, Taker]:
        """Takers of identifiers on which we send single frames, which do not come back to us: NMT, TIME and
        SDO requests."""
        routes: dict[int, Taker] = {cobid.NMT: partial(self._on_nmt, others.get(cobid.NMT))}
        if self._bus.time_period_s:
            routes[cobid.TIME] = self._on_time
        for node in self._nodes:
            for can_id in (channel.request_id for channel in node.wire.sdo):
                routes[can_id] = partial(self._on_sdo, node, others.get(can_id))
        for node in self._nodes:
            # Servers that the node has and the bridge does not use, where nobody else has the identifier.
            for can_id in (server.request + node.table.id for server in node.node.family.sdo):
                if not (can_id in routes or can_id in others or can_id in self._commands):
                    routes[can_id] = partial(self._on_sdo, node, None)
        return routes

    def is_sign(self, frame: Frame, *, acts: bool) -> bool:
        """Whether this frame shows that another bridge is in charge. To a bridge that acts itself, RPDOs
        alone do not: their sender is an intruder."""
        return frame.can_id == self._heartbeat_id or (not acts and frame.can_id in self._commands)

    def name(self, frame: Frame) -> Text:
        """Name of this frame."""
        if frame.can_id == self._heartbeat_id:
            return _named(frame, Text.of("frame.own_heartbeat", id=self._bus.master_node_id))
        if frame.can_id in self._commands:
            return _named(frame, self._commands[frame.can_id][1].label)
        return _named(frame, "SYNC")

    # what comes

    def on_frame(self, frame: Frame) -> Iterator[NmtStop]:
        """Take a frame of somebody else on a watched identifier, as a ``Taker``."""
        if frame.can_id in self._commands:
            node, command = self._commands[frame.can_id]
            enables = command.enables(frame.data)
            said = partial(self._said_command, frame, command)
            return self._meet(frame, [node], said, enables, brings_back=enables)
        if frame.can_id == cobid.SYNC:
            followers = [node for node in self._nodes if _follows_sync(node)]
            return self._meet(frame, followers, lambda: self.name(frame))
        return self._meet(frame, self._nodes, partial(self._said_heartbeat, frame))

    def _said_command(self, frame: Frame, command: CommandFrame) -> Text:
        return Text.of("frame.says", frame=self.name(frame), said=command.said(frame.data))

    def _said_heartbeat(self, frame: Frame) -> Text:
        return Text.of("frame.says", frame=self.name(frame), said=_state_said(frame))

    def _on_nmt(self, then: Handler | None, frame: Frame) -> Iterator[NmtStop]:
        """Take an NMT command of somebody else: our own do not come back. A node in operation loses it by
        some of them, which is noticed; one that is held stopped must not come back."""
        if then:
            then(frame)
        command, addressed = self._addressed(frame.data)
        held = [node for node in addressed if node.is_held]
        if command == NmtCommand.STOP and len(held) == len(addressed):
            # Another bridge that stops what is stopped is not answered: it would answer in its turn.
            return self._meet(frame, None, partial(_nmt_said, frame))
        back = [node for node in held if command in (NmtCommand.START, NmtCommand.ENTER_PRE_OPERATIONAL)]
        return self._meet(frame, back, partial(_nmt_said, frame), bool(back), brings_back=bool(back))

    def _addressed(self, data: bytes) -> tuple[int | None, Sequence[NodeCore]]:
        """NMT command and the nodes that it is for; no nodes where it is none."""
        if len(data) < _NMT_BYTES:
            return None, ()
        command, node_id = data[:_NMT_BYTES]
        return command, [node for node in self._nodes if node_id in (0, node.table.id)]

    def _on_time(self, frame: Frame) -> Iterator[NmtStop]:
        return self._meet(frame, [], lambda: _named(frame, "TIME"))

    def _on_sdo(self, node: NodeCore, then: Handler | None, frame: Frame) -> Iterator[NmtStop]:
        """Take an SDO request of somebody else. Reading has no consequences: a tool may look."""
        if then:
            then(frame)
        said = self._sdo.setdefault(frame.can_id, SdoListener()).request(frame.data)
        writes = ("operation", "write") in said.values
        told = partial(_request_said, frame, node, said)
        return self._meet(frame, [node] if writes else None, told, writes)

    def _meet(
        self,
        frame: Frame,
        affected: Sequence[NodeCore] | None,
        said: Callable[[], Text],
        is_worse: bool = False,
        *,
        brings_back: bool = False,
    ) -> Iterator[NmtStop]:
        """Count a frame, answer it, and report it, though not every one: each that stops a node.
        ``affected``: None if it changes nothing. ``is_worse``: report it even if another one on this
        identifier has just been reported. ``brings_back``: drives of a node that is held stopped may run by
        it."""
        if not self._mastership.acts():
            return
        self.count += 1
        # Frames of others come by a way of their own, and later than the boot-up message of a node that has
        # started meanwhile and has forgotten them.
        stopped = [node for node in self._to_be_stopped(affected) if frame.time > node.started_at]
        since = self._pauses.take(frame.time, (frame.can_id, is_worse))
        if since is None and not all(node.is_held or node.is_out_of_service for node in stopped):
            since = self._pauses.end((frame.can_id, is_worse))
        if since is not None:
            self.last = _answered(_met(said(), since), stopped, self._nodes)
            severity = _HARMLESS if affected is None else _SEVERE
            told = Text.of("intruder.seen", what=self.last)
            self._events.report(Event(frame.time, EventKind.INTRUDER, self._bus.name, severity, told))
        due = [node for node in stopped if self._is_due(node, frame.time, brings_back=brings_back)]
        running = [node for node in due if not node.is_held]
        if running:
            yield NmtStop(running, Text.of("stopped_by.intruder", frame=said()), frame.time)
        for node in due:
            self._stopped[node.table.id] = frame.time + _STOP_AGAIN_S
            if node not in running:
                self._answers.ask(node, self._identifiers(node))
        self.on_time(frame.time)

    def _is_due(self, node: NodeCore, now: float, *, brings_back: bool) -> bool:
        """Whether the node is told to stop: at once if it is not held, or may come back; else once a second,
        which two bridges that take each other for intruders can do for ever."""
        return brings_back or not node.is_held or now >= self._stopped.get(node.table.id, now)

    def _identifiers(self, node: NodeCore) -> int:
        """Number of identifiers on which the node gets stopped words."""
        return sum(one is node for one, _ in self._commands.values())

    def on_time(self, now: float) -> None:
        """Tell the nodes again for which there is room on the bus."""
        for node in self._answers.take(now):
            series = self._series.get(node.table.id)
            if series is None or now > series.last + _ENDED_S:
                series = self._series[node.table.id] = _Series(node, now)
            series.last = now
            series.look_at = now + _PATIENCE_S
            if series.has_to_reset(now):
                self._reset(series, now)
            else:
                node.hold_again(now)
        for series in self._series.values():
            # It has ended: its last word may have been the last.
            if now >= series.look_at:
                series.look_at = float("inf")
                if series.has_to_reset(now):
                    self._reset(series, now)

    def _reset(self, series: _Series, now: float) -> None:
        node, series.reset_at = series.node, now
        node.hold_by_reset(now)
        self._events.report(
            Event(now, EventKind.INTRUDER, node.node.name, _SEVERE, Text.of("intruder.reset"))
        )

    def next_deadline(self) -> float | None:
        if not self._series and not self._answers.are_asked:
            return None
        looks = [series.look_at for series in self._series.values() if series.look_at < float("inf")]
        answer_at = self._answers.next_deadline()
        return min(looks + ([] if answer_at is None else [answer_at]), default=None)

    def bus_is_gone(self) -> None:
        self._answers.clear()
        self._series.clear()

    def _to_be_stopped(self, affected: Sequence[NodeCore] | None) -> Sequence[NodeCore]:
        if affected is None or self._bus.on_intruder == "report":
            return ()
        return self._nodes if self._bus.on_intruder == "stop_all" else affected


@dataclass(slots=True)
class _Series:
    """Series of answers to an intruder that goes on."""

    node: NodeCore
    since: float
    last: float = float("-inf")
    reset_at: float = float("-inf")
    look_at: float = float("inf")
    """Time at which the series is judged even if nobody is answered."""

    def has_to_reset(self, now: float) -> bool:
        """Whether the node has to be reset: its family's drives run on in Stopped, and one last said that it
        is enabled."""
        node = self.node
        begun = max(self.since, self.reset_at)
        if node.leaving.is_stopped_by_nmt or now < self.reset_at + _RESET_AGAIN_S:
            return False
        return now >= begun + _PATIENCE_S and any(_said_enabled_at(one) > begun for one in node.node.drives)


def _said_enabled_at(drive: Drive) -> float:
    """Time at which the drive last said that it is enabled; -inf if that is not the last thing it has
    said."""
    heard = drive.channel.link.last_pdo
    is_enabled = drive.channel.state is DriveState.OPERATION_ENABLED
    return heard if is_enabled and heard is not None else float("-inf")


def _follows_sync(node: NodeCore) -> bool:
    return any(pdo.is_synchronous for pdos in node.wire.pdos for pdo in (*pdos.rpdos, *pdos.tpdos))


def _met(frame: Text, since: int) -> Text:
    """Text of a frame; ``since`` is the number of frames before it that were not reported."""
    if since:
        return Text.of("intruder.met_again", frame=frame, frames=since + 1)
    return Text.of("intruder.met", frame=frame)


def _answered(met: Text, stopped: Sequence[NodeCore], nodes: Sequence[NodeCore]) -> Text:
    if not stopped:
        return met
    answer = Text.of("intruder.some_stop", nodes=", ".join(node.node.name for node in stopped))
    if len(stopped) == len(nodes) > 1:
        answer = Text.of("intruder.all_stop")
    return Text.of("intruder.answered", what=met, answer=answer)


def _named(frame: Frame, what: Words) -> Text:
    return Text.of("frame.named", what=what, can_id=frame.can_id)


def _nmt_said(frame: Frame) -> Text:
    return _named(frame, Text.of("frame.nmt", command=text_of_command(frame.data)))


def _request_said(frame: Frame, node: NodeCore, said: SdoSaid) -> Text:
    name = _named(frame, Text.of("frame.sdo_request", node=node.node.name))
    return Text.of("frame.says", frame=name, said=text_of_request(said))


def _state_said(frame: Frame) -> Text:
    state = nmt.state_of(frame.data[0]) if len(frame.data) == 1 else None
    if state is None:
        return Text.of("frame.id_used_twice", said=Text.of("frame.nonsense"))
    said = Text.of("frame.starts") if state is NmtState.INITIALISING else text_of_state(state)
    return Text.of("frame.id_used_twice", said=said)
