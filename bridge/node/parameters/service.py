"""Parameters of one node's drives: requests, and the points that show them. Sans-IO.

Each drive's parameters use the SDO channel that reaches it. Requests of clients come before polls; clients
that read the same parameter at the same time share one answer, and only one client at a time writes a
parameter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final

from bridge.canopen.sdo import Priority, SdoChannel
from bridge.command import (
    Action,
    BusSide,
    Code,
    Event,
    EventKind,
    Identity,
    Outcome,
    ParameterHolder,
    ReadParameter,
    Reply,
    Request,
    Role,
    WriteParameter,
)
from bridge.command.drive_link import NodeState
from bridge.command.messages.request import refused
from bridge.command.node import Node
from bridge.node.parameters.own_watch import OwnWatch
from bridge.node.parameters.parameter_polling import Came, ParameterPolling, PointRead
from bridge.node.parameters.parameter_view import NO_CHANNEL, ParameterView
from bridge.node.parameters.run import Procedure, run
from bridge.node.places.sdo_channels import FIRST, SdoChannels
from bridge.parameter import (
    DriveParameters,
    ObjectRef,
    ParameterEntry,
    ParameterError,
    ParameterReading,
    ParameterWritten,
    Transfer,
    Why,
)
from bridge.parameter.codec import check_raw, decode, shown
from bridge.parameter.protection import Gate
from bridge.text import Said, Text

_CODES: Final = {
    Why.UNKNOWN_NAME: Code.UNKNOWN_PARAMETER,
    Why.READ_ONLY: Code.READ_ONLY,
    Why.WRITE_ONLY: Code.WRITE_ONLY,
    Why.OUT_OF_RANGE: Code.OUT_OF_RANGE,
    Why.PROTECTED: Code.NOT_ALLOWED,
    Why.TOO_OFTEN: Code.TOO_OFTEN,
    Why.REFUSED: Code.REFUSED_BY_DRIVE,
    Why.NO_ANSWER: Code.TIMED_OUT,
    Why.NOT_TAKEN: Code.REFUSED_BY_DRIVE,
    Why.OTHER_VALUE: Code.OTHER_VALUE,
    Why.NOT_CONFIGURED: Code.NOT_CONFIGURED,
}
_ANSWERS: Final = frozenset((NodeState.OPERATIONAL, NodeState.STOPPED, NodeState.CONFIG_ERROR))
"""States in which a node can be asked: it is heard, and its boot-up does not need the channel. One in
Pre-operational answers (CiA 301 §7.3.2.2.2), one in Stopped does not."""
Waiting = list[Callable[[ParameterReading | ParameterError], None]]


class NodeParameters:
    """Parameter access for one node."""

    def __init__(self, node: Node, side: BusSide, sdo: SdoChannels) -> None:
        self._node = node
        self._events = side.events
        self._sdo = sdo
        self._now = side.began
        self._state = NodeState.ABSENT
        self._access = {
            one.name: DriveParameters(
                one.name,
                node.name,
                node.family,
                one.spec.names,
                side.eeprom_writes,
                on_first=one.spec.is_on_first,
            )
            for one in node.members
        }
        self._channels = {one.name: one.spec.sdo_channel for one in node.members}
        self._own_watch = OwnWatch(node)
        self._view = ParameterView(node, side.image)
        self._polling = ParameterPolling(node, len(side.nodes))
        self._deciding = {
            name
            for value in node.family.value
            for name in (*value.scaled_by, *value.when, *node.family.steady_of(value))
        }
        self._reading: dict[tuple[str, ObjectRef], Waiting] = {}
        self._writing: set[tuple[str, ObjectRef]] = set()

    # the node

    def on_node(self, state: NodeState, now: float) -> None:
        """Take over the node's state."""
        self._now = max(now, self._now)
        before, self._state = self._state, state
        if state is before:
            return
        self._view.on_node(state, now)
        self._polling.stop()
        if state is NodeState.OPERATIONAL:
            for access in self._access.values():
                access.forget()
            members = self._node.members
            self._view.unreached([one for one in members if not one.spec.sdo_channel], now)
            self._polling.start([one for one in members if one.spec.sdo_channel], now)

    def on_time(self, now: float) -> None:
        self._now = max(now, self._now)
        due = self._polling.take_due(now)
        if due is not None:
            self._poll(due)
        self._view.on_time(now)

    def next_deadline(self) -> float | None:
        times = (self._polling.next_deadline(), self._view.next_deadline())
        return min((time for time in times if time is not None), default=None)

    # requests

    def submit(self, request: Request, drive: ParameterHolder, now: float, reply: Reply) -> None:
        """Carry out a request for a parameter; ``reply`` is called once, when the drive has answered."""
        self._now = max(now, self._now)
        refusal = self._refusal(request, drive)
        if refusal:
            self._conclude(request, drive, reply, refusal)
            return
        try:
            self._begin(request, drive, now, reply)
        except ParameterError as error:
            self._conclude(request, drive, reply, _failed(error))

    def _refusal(self, request: Request, drive: ParameterHolder) -> Outcome | None:
        """Outcome of a request that is not even forwarded to the drive; None if it is."""
        why = None if request.action is Action.READ_PARAMETER else _why_not_set(request.identity, drive)
        if why:
            return _no(Code.NOT_ALLOWED, why)
        is_there = request.action is Action.READ_PARAMETER and self._state in _ANSWERS
        if not (is_there or self._state is NodeState.OPERATIONAL):
            state = Text.word("node_state", self._state.value)
            return _no(Code.NOT_READY, Text.of("node.state_of_drives", state=state))
        if request.action is not Action.SAVE_PARAMETERS and self._channels[drive.name] is None:
            return _no(Code.NOT_CONFIGURED, Text.of("parameter.of", owner=drive.name, what=NO_CHANNEL))
        return None

    def _begin(self, request: Request, drive: ParameterHolder, now: float, reply: Reply) -> None:
        """Begin a request. Raises ``ParameterError`` where the request itself is wrong."""
        access = self._access[drive.name]
        conclude = partial(self._conclude, request, drive, reply)
        command = request.command
        if isinstance(command, ReadParameter):
            entry = access.names.resolve(command.parameter)
            done = partial(self._on_read, drive, entry if command.raw else None, conclude)
            self._read(drive, entry, command.max_age_ms / 1000, done)
            return
        if not isinstance(command, WriteParameter):
            self._save(access, request.identity, drive, now, conclude)
            return
        entry = access.names.resolve(command.parameter)
        if command.raw:
            check_raw(entry, command.value)
            entry = entry.as_bytes
        access.check_writable(entry)
        gate = self._gate(request.identity, drive, entry)
        if refusal := access.names.protection.why_not(entry, gate):
            conclude(_no(Code.NOT_ALLOWED, refusal))
            return
        key = (drive.name, entry.address)
        if why := self._own_watch.why_kept(drive, entry, command.value):
            conclude(_no(Code.NOT_ALLOWED, why))
        elif key in self._writing:
            why = Text.of("parameter.busy", parameter=entry.name, owner=drive.name)
            conclude(_no(Code.BUSY, why))
        else:
            self._writing.add(key)
            steps = access.write(entry, command.value, now, gate, command.expected)
            self._run(steps, drive, partial(self._on_written, request, drive, entry, conclude))

    def _save(
        self, access: DriveParameters, identity: Identity, drive: ParameterHolder, now: float, conclude: Reply
    ) -> None:
        gate = Gate(identity.role >= Role.ENGINEER, lambda: drive.is_enabled)
        self._run(access.save(now, gate), drive, partial(self._on_saved, conclude))

    def _gate(self, identity: Identity, drive: ParameterHolder, entry: ParameterEntry) -> Gate:
        """Gate of a write: an object outside the drive's own axis may move every drive that the same channel
        reaches."""
        channel = self._channels[drive.name]
        sharing = [one for one in self._node.members if one.spec.sdo_channel == channel]
        moved = [drive] if self._node.is_of(drive, entry.address) else sharing
        return Gate(identity.role >= Role.ENGINEER, lambda: any(one.is_enabled for one in moved))

    def _read(
        self,
        drive: ParameterHolder,
        entry: ParameterEntry,
        max_age_s: float,
        done: Callable[[ParameterReading | ParameterError], None],
        priority: Priority = Priority.COMMAND,
    ) -> None:
        key = (drive.name, entry.address)
        shares = priority is Priority.COMMAND
        if shares and key in self._reading:
            self._reading[key].append(done)
            return
        if shares:
            self._reading[key] = [done]

        def on_result(result: ParameterReading | ParameterError) -> None:
            self._show(drive, entry, result)
            for one in self._reading.pop(key) if shares else [done]:
                one(result)

        steps = self._access[drive.name].read(entry, self._now, max_age_s)
        self._run(steps, drive, on_result, priority)

    def _run(
        self,
        procedure: Procedure[object],
        drive: ParameterHolder,
        done: Callable[..., None],
        priority: Priority = Priority.COMMAND,
    ) -> None:
        def channel_for(transfer: Transfer) -> SdoChannel:
            number = None if transfer.of_node else self._channels[drive.name]
            return self._sdo[number or FIRST]

        run(procedure, channel_for, lambda: self._now, done, priority=priority)

    # results

    def _on_read(
        self,
        drive: ParameterHolder,
        raw: ParameterEntry | None,
        conclude: Reply,
        result: ParameterReading | ParameterError,
    ) -> None:
        """Conclude a read; ``raw`` is the object whose bytes are asked for."""
        if isinstance(result, ParameterError):
            conclude(_failed(result))
            return
        held = self._access[drive.name].held(raw) if raw else None
        value = result.value if held is None else held.hex(" ").upper()
        conclude(Outcome(Code.OK, value=value, time=result.time))

    def _on_written(
        self,
        request: Request,
        drive: ParameterHolder,
        entry: ParameterEntry,
        conclude: Reply,
        result: ParameterWritten | ParameterError,
    ) -> None:
        self._writing.discard((drive.name, entry.address))
        if isinstance(result, ParameterError):
            if result.why in (Why.NO_ANSWER, Why.NOT_TAKEN):
                self._own_watch.forget(drive, entry, self._now, is_certain=False)
            conclude(_failed(result))
            return
        reading = result.reading
        self._show(drive, entry, self._as_listed(drive, entry, reading))
        if result.changed:
            self._own_watch.forget(drive, entry, self._now)
            told, who = str(reading), str(request.identity)
            said = Text.of("parameter.changed", reading=told, who=who)
            if result.before is not None:
                before = shown(entry, result.before)
                said = Text.of("parameter.changed_from", reading=told, before=before, who=who)
            self._tell(drive.name, 400, said)
        self._warn(drive.name, result.warning)
        already = "" if result.changed else Text.of("parameter.held_already")
        conclude(Outcome(Code.OK, already, value=reading.value, time=reading.time))

    def _as_listed(
        self, drive: ParameterHolder, entry: ParameterEntry, reading: ParameterReading
    ) -> ParameterReading | ParameterError:
        """Reading of bytes that were written, decoded as the parameter that they belong to."""
        listed = drive.spec.names.resolve(str(entry.address))
        held = self._access[drive.name].held(entry)
        if listed.definition is None or listed.definition == reading.entry.definition or held is None:
            return reading
        try:
            return replace(reading, entry=listed, value=decode(listed, held))
        except ParameterError as error:
            return error

    def _on_saved(self, conclude: Reply, result: Said | ParameterError) -> None:
        if isinstance(result, ParameterError):
            conclude(_failed(result))
            return
        self._tell(self._node.name, 400, Text.of("parameter.saved"))
        self._warn(self._node.name, result)
        conclude(Outcome(Code.OK, Text.of("parameter.is_saved")))

    def _conclude(self, request: Request, drive: ParameterHolder, reply: Reply, outcome: Outcome) -> None:
        """Reply with the outcome; a refused write is an event, too."""
        if outcome.abort_code:
            drive.on_sdo_refused(outcome.abort_code, self._now)
        if not outcome.ok and request.action is not Action.READ_PARAMETER:
            drive.on_refused(self._now)
            said = refused(request.action, str(request.identity), outcome.said)
            self._events.report(Event(self._now, EventKind.REFUSED, drive.name, 300, said))
        reply(outcome)

    def _tell(self, source: str, severity: int, said: Text) -> None:
        self._events.report(Event(self._now, EventKind.CONFIGURATION, source, severity, said))

    def _warn(self, source: str, warning: Said) -> None:
        if warning:
            self._tell(source, 600, warning)

    # points

    def _poll(self, due: PointRead) -> None:
        """Read a point."""

        def on_result(result: ParameterReading | ParameterError) -> None:
            came = Came.READ
            if isinstance(result, ParameterError):
                came = Came.NEVER if self._view.is_final(result) else Came.FAILED
            self._polling.on_result(due, came)

        self._read(due.holder, due.entry, 0.0, on_result, Priority.POLL)

    def _show(
        self, drive: ParameterHolder, entry: ParameterEntry, result: ParameterReading | ParameterError
    ) -> None:
        if isinstance(result, ParameterError):
            self._view.failed(drive.name, entry, result, self._now)
            return
        self._view.show(drive.name, result)
        name = entry.definition.name if entry.definition else ""
        if name in self._deciding and entry.address == drive.spec.names.resolve(name).address:
            # It decides what the process data mean, which follow at once.
            drive.on_parameter(name, float(result.value), self._now)


def _why_not_set(identity: Identity, drive: ParameterHolder) -> Text | None:
    """Reason why ``identity`` may not set parameters, None if it may: an engineer may, and where its protocol
    knows no roles, whoever controls the drive or could."""
    if identity.role >= Role.ENGINEER:
        return None
    if not identity.may_set_parameters:
        return Text.of("parameter.not_by_you", who=str(identity))
    return drive.refusal(identity)


def _failed(error: ParameterError) -> Outcome:
    return Outcome(_CODES[error.why], error.said, forwarded=False, abort_code=error.abort_code)


def _no(code: Code, why: Said) -> Outcome:
    return Outcome(code, why, forwarded=False)
