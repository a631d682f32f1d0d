"""Commands on nodes: who may give them, and what each does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Protocol

from bridge.canopen.nmt import NmtCommand
from bridge.command import (
    Action,
    Code,
    Commanded,
    Event,
    EventKind,
    EventQueue,
    Outcome,
    Reply,
    Request,
    Role,
)
from bridge.command.drive_link import NodeState
from bridge.command.node import Node
from bridge.node.leaving import Leaving
from bridge.node.put_off import CANCELS_WORDS
from bridge.node.wire import NodeWire
from bridge.text import Text, Words

NMT: Final = {
    Action.RESET: NmtCommand.RESET_NODE,
    Action.RESET_COMMUNICATION: NmtCommand.RESET_COMMUNICATION,
    Action.START_NODE: NmtCommand.START,
    Action.STOP_NODE: NmtCommand.STOP,
    Action.ENTER_PRE_OPERATIONAL: NmtCommand.ENTER_PRE_OPERATIONAL,
}
_AFTER_RESET_S: Final = 1.0
"""Time in seconds after which a reset node is asked again if its boot-up message was not heard."""


class CommandedNode(Protocol):
    """A node as commands see it."""

    @property
    def node(self) -> Node: ...

    @property
    def state(self) -> NodeState: ...

    @property
    def wire(self) -> NodeWire: ...

    @property
    def leaving(self) -> Leaving: ...

    def leave_operation(self, now: float) -> None: ...

    def boot_next(self, at: float | None) -> None: ...

    def say(self, said: Text, now: float) -> None: ...

    def set_state(self, state: NodeState, now: float) -> None: ...

    def stop_drives(self, now: float) -> None: ...

    def was_told(self, command: NmtCommand) -> None: ...

    def carry_out_command(
        self, action: Action, who: Words, now: float, *, send: bool = True, at_once: bool = False
    ) -> None: ...


def answer(
    request: Request,
    name: str,
    nodes: Sequence[CommandedNode],
    events: EventQueue,
    now: float,
    reply: Reply,
) -> bool:
    """Answer a request for these nodes, ``name`` in the log; True where it was carried out and one frame is
    to be sent to them all.

    For a whole bus all commands but Start go out as one frame, which the caller sends: an unchecked node is
    not started. Where a node has to take over its stopped words first, each node gets its own frame.
    """
    is_bus = request.target.startswith("bus/")
    why = refusal(request, [commanded for one in nodes for commanded in one.node.commanded])
    if is_bus and request.action not in NMT:
        why = Text.of("request.no_bus_action", action=Text.word("action", request.action))
        reply(Outcome(Code.UNKNOWN_TARGET, why, forwarded=False))
        return False
    if why:
        reply(Outcome(Code.NOT_ALLOWED, why, forwarded=False))
        return False
    who = str(request.identity)
    told = Text.of("request.by", action=Text.word("action", request.action), who=who)
    events.report(Event(now, EventKind.OWNER, name, 400, told))
    each = not is_bus or request.action is Action.START_NODE
    each |= NMT.get(request.action) in CANCELS_WORDS and any(one.leaving.takeover_s for one in nodes)
    for one in nodes:
        one.carry_out_command(request.action, who, now, send=each)
    reply(Outcome(Code.OK))
    return not each


def refusal(request: Request, commanded: Sequence[Commanded]) -> Text | None:
    """Reason why this identity may not command the node now; None if it may.

    A command on the node affects all its drives, so nobody gives one while another identity controls one of
    them; an engineer may.
    """
    if request.identity.role < Role.OPERATOR:
        return Text.of("request.may_only_read", who=str(request.identity))
    if request.identity.role >= Role.ENGINEER:
        return None
    for one in commanded:
        owner = one.channel.owner
        if owner is not None and not request.identity.goes_on_as(owner):
            by = owner.named_beside(request.identity)
            return Text.of("request.one_controlled_by", name=one.name, owner=by)
    return None


def carry_out(
    node: CommandedNode,
    action: Action,
    who: Words,
    now: float,
    *,
    send: bool = True,
    at_once: bool = False,
) -> None:
    """Carry out ``action`` on a node. ``send`` is false where one frame tells all nodes; ``at_once``: its
    drives have had their stopped words for long."""
    if action in NMT:
        _nmt(node, NMT[action], who, now, send=send, at_once=at_once)
    elif action is Action.DISABLE:
        node.leave_operation(now)
        node.boot_next(None)
        node.say(Text.of("node.switched_off"), now)
        node.set_state(NodeState.DISABLED, now)
    elif action is Action.ENABLE and node.state is NodeState.DISABLED:
        node.say(Text.of("node.waiting"), now)
        node.set_state(NodeState.ABSENT, now)
        node.boot_next(now)


def _nmt(
    node: CommandedNode, command: NmtCommand, who: Words, now: float, *, send: bool, at_once: bool
) -> None:
    """Carry out an NMT command. For a node that is switched off it goes on the bus and changes nothing
    here."""
    if command is NmtCommand.START and node.state is not NodeState.OPERATIONAL:
        # It is booted first, and started at the end of that: an unchecked node gets no process data.
        if node.state is NodeState.DISABLED:
            return
        node.leave_operation(now)
        node.set_state(NodeState.BOOTING, now)
        node.boot_next(now)
        return
    if command is not NmtCommand.START:
        node.stop_drives(now)
        node.wire.send_stopped()
    if send and command in CANCELS_WORDS:
        node.leaving.send(command, now, at_once=at_once)
    elif send:
        node.wire.send_nmt(command)
    if command in CANCELS_WORDS:
        node.leaving.silence(now)
    if command is NmtCommand.START or node.state is NodeState.DISABLED:
        return
    node.leave_operation(now)
    node.was_told(command)
    if command in (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION):
        node.set_state(NodeState.LOST, now)
        node.boot_next(now + _AFTER_RESET_S)
    else:
        node.boot_next(None)
        stops = command is NmtCommand.STOP
        node.say(Text.of("node.stopped_by" if stops else "node.pre_operational_by", who=who), now)
        node.set_state(NodeState.STOPPED, now)
