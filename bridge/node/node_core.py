"""One node on one bus: frames and time in, frames and readings out. Sans-IO."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Final

from bridge.base.habit_texts import text_of_habit
from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.command import Action, BusSide, ParameterHolder, Reply, Request
from bridge.command.drive_link import NodeState
from bridge.command.node import Node
from bridge.config.download import Download
from bridge.node import boot
from bridge.node import nmt_commands as node_commands
from bridge.node.backoff import BETWEEN_BOOTS_S, BackOff
from bridge.node.booting import Booting
from bridge.node.error_control import Sign
from bridge.node.identifiers import BusIdentifiers
from bridge.node.leaving import Leaving
from bridge.node.neighbours import Neighbours
from bridge.node.node_view import NodeView
from bridge.node.parameters.service import NodeParameters
from bridge.node.process.stop_words import StopWords
from bridge.node.put_off import CANCELS_WORDS
from bridge.node.wire import Handler, NodeWire, Service
from bridge.text import Said, Text, Words

_SETTLE_S: Final = 2.0
_OWN_RESET_S: Final = 30.0
"""Time in seconds within which a boot-up message is the answer to our own reset."""


BUS_IS_DOWN: Final = Text.of("bus.is_down")


class NodeCore:
    """Boots one node, keeps it in operation and reacts to its loss."""

    def __init__(
        self,
        node: Node,
        side: BusSide,
        neighbours: Neighbours,
        identifiers: BusIdentifiers,
        downloads: Sequence[Download] = (),
    ) -> None:
        self.node = node
        self._neighbours = neighbours
        self._downloads = downloads
        table = self.table = node.table
        self.state = NodeState.ABSENT
        self._view = NodeView(node, side)
        self._touch = partial(neighbours.touched, self)
        cycles = node.family.eeprom.cycles if node.family.eeprom else None
        self._memory = boot.BootMemory(ledger=side.eeprom_writes, cycles=cycles)
        configured = (*downloads, *(entry.download for entry in table.configure))
        self.wire = NodeWire(node, side, identifiers, StopWords(node, configured, self._memory))
        self.leaving = Leaving(node, self.wire, self._memory)
        self.error_control = self.wire.error_control
        self.booting = Booting(self, self.wire.sdo)
        self.parameters = NodeParameters(node, side, self.wire.sdo)
        self.boot_at: float | None = 0.0
        self.has_concluded = False
        """Whether a boot-up has ended, well or not, since the bus came up."""
        self.told: NmtCommand | None = None
        """Last NMT command to the node, if it keeps it out of Operational."""
        self._held_by_reset_at = float("-inf")
        """Time at which the node was last reset although it is to stay stopped."""
        self._reset_at = float("-inf")
        """Time of our last reset of the node, or of its communication."""
        self._back_off = BackOff()
        self._last_boot = float("-inf")
        self.started_at = float("-inf")
        """Time of the node's last boot-up message."""
        self._operational_since = 0.0
        if not table.enabled:
            self.boot_at = None
            self.set_state(NodeState.DISABLED, side.began)
        self.say(Text.of("node.waiting"), side.began)
        self._show(side.began)

    def take_routes(self) -> dict[int, Handler]:
        """Handlers by COB-ID; marks them as taken until they change."""
        wire = self.wire
        services = {cob_id: partial(self._on_service, service) for cob_id, service in wire.services.items()}
        return {**wire.requests, **services, **wire.take_routes()}

    def _on_service(self, service: Service, frame: Frame) -> None:
        """Take a frame that is no process data: frames to be sent and deadlines may change by it."""
        sign = service(frame)
        duplicate = self.error_control.duplicate
        if duplicate is not None:
            self.error_control.duplicate = None
            self._neighbours.duplicate(self, duplicate, frame.time)
        if sign is None:
            self._touch()
        elif sign is not Sign.MALFORMED:
            self._on_sign(sign, frame.time)

    def _on_sign(self, sign: Sign, now: float) -> None:
        """Take an error control message."""
        if sign is Sign.SAME and self.is_operational and self.error_control.state is NmtState.OPERATIONAL:
            return
        self._touch()
        if sign is Sign.BOOT_UP:
            self._on_boot_up(now)
            return
        if sign is Sign.WRONG_TOGGLE:
            self._show(now)
            return
        if sign is Sign.CHANGED:
            self._show(now)
        self.leaving.on_state(self.error_control.state, now)
        if not self.leaving.is_due:
            self._judge_nmt_state(now)

    def _on_boot_up(self, now: float) -> None:
        """Take a boot-up message: whatever the node was told before is forgotten."""
        self.started_at = now
        self._neighbours.started_anew(self)
        self.told = None
        self._memory.may_run = False
        self.leaving.on_restart()
        if now > self._reset_at + _OWN_RESET_S:
            self._memory.start_anew()
        else:
            self._memory.was_reset()
        loop = self.error_control.boot_loop
        pause_s = loop.on_boot_up(now)
        self._view.loops(loop, now)
        if self.state is NodeState.DISABLED:
            return
        if self.state is NodeState.STOPPED and now <= self._held_by_reset_at + _OWN_RESET_S:
            self.told = NmtCommand.STOP
            self.leaving.send(NmtCommand.STOP, now)
            return
        if self.is_operational:
            self._view.restarted(now)
        self.leave_operation(now)
        self.stop_drives(now)
        if pause_s:
            self.say(Text.of("node.loops", pause_s=pause_s), now)
        self.set_state(NodeState.LOST if pause_s else NodeState.BOOTING, now)
        self.boot_at = max(now + pause_s, self._last_boot + BETWEEN_BOOTS_S)
        self._back_off.reset()

    def _judge_nmt_state(self, now: float) -> None:
        seen = self.error_control.state
        self.booting.on_nmt_state(seen, now)
        if self.state is NodeState.LOST and not self.booting.is_running:
            self._heard_again(now)
        elif (
            self.is_operational
            and seen is not NmtState.OPERATIONAL
            and now > self._operational_since + _SETTLE_S
        ):
            self._lose(Text.of("node.went", state=seen.words), now)
            self.error_control.assume(seen)
            self._show(now)
            if self.boot_at is not None:
                self.boot_at = self._soon(now)

    def _heard_again(self, now: float) -> None:
        """Go on with a node that is heard without a boot-up message: the cable was at fault, not the node."""
        reaction = self.table.on_loss
        if self.error_control.boot_loop.is_looping:
            return
        if reaction == "nothing" and self.wire.pdos and self.error_control.state is NmtState.OPERATIONAL:
            self.node.on_heard_again()
            self._enter_operation(Text.of("node.heard_again"), now)
        elif reaction != "stop_node":
            self.boot_at = self._soon(now)

    def _soon(self, now: float) -> float:
        """Earliest time to boot a node that is there, counted from the boot-up before."""
        return max(now, self._last_boot + self._back_off.between_boots_s)

    def boot_next(self, at: float | None) -> None:
        """Schedule the next boot-up, at once if ``at`` is past; None: only on request."""
        self.boot_at = at

    @property
    def is_held(self) -> bool:
        """True if it was told to leave Operational, and nobody has asked for it since."""
        return self.told is not None and self.state not in (NodeState.OPERATIONAL, NodeState.BOOTING)

    def hold_again(self, now: float) -> None:
        """Repeat the command: somebody else may have brought the node back."""
        if self.told is not None:
            self.leaving.tell(self.told, now, takes_words=True)
            self._touch()

    def hold_by_reset(self, now: float) -> None:
        """Reset the node and keep it stopped: neither words nor NMT stop keep its drives from running."""
        self._reset_at = self._held_by_reset_at = now
        self.wire.send_stopped()
        self.wire.send_nmt(NmtCommand.RESET_NODE)
        self._touch()

    def was_told(self, command: NmtCommand) -> None:
        """Note the NMT command that was sent to the node last."""
        self.told = command if command in CANCELS_WORDS else None

    # time

    def on_time(self, now: float) -> None:
        self.wire.on_time(now)
        if self.error_control.on_time(now):
            self._lose(self.error_control.loss, now)
        if self._back_off.steady_at is not None and now >= self._back_off.steady_at:
            self._back_off.reset()
            self._view.stays(now)
        self.booting.on_time(now, self.error_control.state)
        if self.boot_at is not None and now >= self.boot_at and not self._is_busy:
            self.boot_at = None
            self._last_boot = self._memory.began_at = now
            self.leaving.forget()
            # A stopped node answers no SDO: it has to be woken before it is asked.
            if self.told is NmtCommand.STOP or self.error_control.state is NmtState.STOPPED:
                self.wire.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
            self.booting.begin(boot.boot(self.node, self._downloads, self._memory), now)
        self.wire.polling.on_time(now)
        self.parameters.on_time(now)

    def next_deadline(self) -> float | None:
        times = (
            self.wire.next_deadline(),
            self.booting.next_deadline(),
            self.parameters.next_deadline(),
            None if self._is_busy else self.boot_at,
            self._back_off.steady_at,
        )
        return min((time for time in times if time is not None), default=None)

    # boot-up

    @property
    def _is_busy(self) -> bool:
        return self.booting.is_running or self.leaving.is_due

    @property
    def is_on_its_way(self) -> bool:
        if self.is_out_of_service:
            return False
        return not self.has_concluded or (self.state is NodeState.BOOTING and self.booting.is_running)

    @property
    def is_out_of_service(self) -> bool:
        return self.state in (NodeState.DISABLED, NodeState.STOPPED)

    @property
    def is_ready(self) -> bool:
        return self.state is NodeState.OPERATIONAL or self.booting.is_held

    def may_start(self) -> bool:
        return self._neighbours.may_start(self)

    def carry_out(self, action: boot.Action, now: float) -> None:
        match action:
            case boot.BootStep():
                # Looking for a node that was never there is nothing to report every ten seconds.
                if self.state is not NodeState.ABSENT:
                    self.say(action.said, now)
            case boot.BootSignal.FOUND:
                self.set_state(NodeState.BOOTING, now)
            case boot.DeviceErrors():
                self._view.errors(action.said, now)
            case boot.BootSignal.START_SUPERVISION:
                self.error_control.expect(now)
            case _:
                if isinstance(action, boot.ResetCommunication):
                    self._reset_at = now
                    self._view.resets(action.why, now)
                self.wire.carry_out(action)

    def boot_ended(self, result: boot.BootResult | boot.BootError, now: float) -> None:
        self.has_concluded = True
        if isinstance(result, boot.BootError):
            self._fail_boot(result, now)
            return
        if self._view.identified(result.identification, now):
            self.wire.sdo.forget_block()
        self.wire.connect(result, now)
        out = [name for name, plan in result.drives.items() if plan.problem]
        left_out = tuple(Text.of("boot.failed", letter="J", what=name) for name in out)
        said = Text.of("boot.left_out", drives=left_out) if left_out else Text.of("boot.ok")
        if result.notes:
            said = Text.of("boot.noted", outcome=said, notes=tuple(result.notes))
        self._enter_operation(said, now)

    def _enter_operation(self, said: Text, now: float) -> None:
        self.told = None
        self._operational_since = now
        self._back_off.entered_operation(now)
        # The guard may have run out between the start command and the node's answer.
        self.error_control.expect(now)
        self.error_control.assume(NmtState.OPERATIONAL)
        self.boot_at = None
        self.set_state(NodeState.OPERATIONAL, now)
        self.wire.start_polling(now)
        for one in self.node.commanded:
            if not self.wire.carries(one):
                one.channel.on_node(NodeState.CONFIG_ERROR, now)
                one.refresh(now)
        self._view.succeeded(said, now)

    def _fail_boot(self, error: boot.BootError, now: float) -> None:
        self.error_control.stop(now)
        habits = self.wire.habits.said()
        if habits and error.absent:
            hint = Text.of("boot.habits", habits=tuple(map(text_of_habit, habits)))
            error = boot.BootError(error.letter, error.what, absent=True, hint=hint)
        self._view.failed(error, now)
        if self.state is NodeState.BOOTING:
            self.set_state(NodeState.LOST if error.absent else NodeState.CONFIG_ERROR, now)
        self._stop_unbooted(now)
        self.boot_at = now + self._back_off.failed(absent=error.absent)

    def _stop_unbooted(self, now: float) -> None:
        """Stop a node that could not be booted, and its drives, which nobody supervises. Also where it seems
        absent: it may still hear, and our heartbeat would keep it running."""
        self.stop_drives(now)
        self.wire.send_stopped()
        self.told = NmtCommand.STOP
        if self._memory.may_run and not self.leaving.is_stopped_by_nmt:
            self._reset_at = now
            self.wire.send_nmt(NmtCommand.RESET_NODE)
        else:
            self.leaving.send(NmtCommand.STOP, now)

    def enforce(self, action: Action, why: Said, now: float) -> None:
        """Carry out ``action``, because a stop whose words have been on the bus for long is ignored."""
        self.carry_out_command(action, why, now, at_once=self.leaving.has_told(now))

    def tell_habits(self, now: float) -> None:
        """Report deviations of its frames from the standard, if there are new ones."""
        if self.is_operational and (news := self.wire.habits.take_news()):
            habits = self.wire.habits.habits()
            self._view.shows_habits([*map(text_of_habit, news)], [*map(text_of_habit, habits)], now)

    # states

    def _lose(self, why: Text, now: float) -> None:
        """Handle a node that is silent, or not in the state it was put in."""
        self.error_control.assume(NmtState.UNKNOWN)
        if not self.is_operational and not self.booting.is_held:
            self.error_control.stop(now, lost=self.state is NodeState.LOST)
            self._show(now)
            return
        self.say(why, now)
        pause_s = self._back_off.lost(now)
        self._view.flaps(self._back_off, now)
        reaction = self.table.on_loss
        policy = self.node.bus.mandatory_missing
        stops_all = reaction == "stop_all" or (self.table.mandatory and policy == "stop_all")
        if reaction == "stop_node" or stops_all:
            self.stop_drives(now)
            self.wire.send_stopped()
            self.leaving.silence(now, only_heard=True)
        self.set_state(NodeState.LOST, now)
        self.leave_operation(now)
        if reaction == "stop_node":
            self.leaving.send(NmtCommand.STOP, now)
            self.told = NmtCommand.STOP
        elif reaction != "nothing":
            self.boot_at = now + pause_s
        if stops_all:
            self._neighbours.stop_others(self, Text.of("node.is_lost", node=self.node.name), now)

    def stop_drives(self, now: float) -> None:
        """Require every drive of the node to be enabled anew, and its outputs to be written anew."""
        for one in self.node.commanded:
            one.channel.start_anew(now)

    def leave_operation(self, now: float) -> None:
        self.error_control.stop(now, lost=self.state is NodeState.LOST)
        self.wire.stop_polling()
        self.booting.cancel(now)

    def hold(self, why: Text, now: float) -> None:
        """Leave operation, because all nodes are stopped, and boot up as far as the start.

        A node in operation or at its boot-up begins again, and so does one that cannot be used: it stays in
        Stopped no longer than it has to. The others are woken when their time comes.
        """
        self.stop_drives(now)
        begins_again = self.is_operational or self.booting.is_running
        if begins_again:
            self.wire.send_stopped()
            self.leaving.silence(now)
            self.leave_operation(now)
            self.say(Text.of("node.stopped_because", why=why), now)
        if self.is_operational:
            self.set_state(NodeState.BOOTING, now)
        if begins_again or self.state is NodeState.CONFIG_ERROR:
            self.boot_at = now + BETWEEN_BOOTS_S

    def bus_is_gone(self, now: float, why: Text = BUS_IS_DOWN) -> None:
        """Lose the node at once, with all others: the bus is down, or another bridge's."""
        self.error_control.assume(NmtState.UNKNOWN)
        self.stop_drives(now)
        self.wire.clear()
        if self.state is NodeState.DISABLED or self._stays_stopped:
            # Who was stopped on purpose is not started by a bus that comes back.
            return
        if self.state is not NodeState.ABSENT:
            self.say(Text.of("node.lost_because", why=why), now)
            self.set_state(NodeState.LOST, now)
        self.leave_operation(now)
        self.has_concluded = False
        self.boot_at = now + self._back_off.pause_s

    @property
    def _stays_stopped(self) -> bool:
        """Whether the node was stopped, and nothing boots it by itself."""
        gave_up = self.boot_at is None and self.state is NodeState.LOST and self.table.on_loss == "stop_node"
        return self.state is NodeState.STOPPED or gave_up

    def bus_is_back(self, now: float) -> None:
        """Repeat the command to a node that stays stopped: nobody knows whether it has had it."""
        self.stop_drives(now)
        if self._stays_stopped:
            self.leaving.tell(self.told or NmtCommand.STOP, now, takes_words=True)

    def set_state(self, state: NodeState, now: float) -> None:
        if state is self.state:
            return
        self.state = state
        self.leaving.on_node(state)
        self._view.is_in(state, now)
        self.node.on_state(state, now)
        if not self._back_off.is_flapping:
            self._view.went(state, now)
        self.parameters.on_node(state, now)
        self._show(now)

    @property
    def is_asked(self) -> bool:
        """True while a boot-up runs, or an SDO transfer."""
        return self.booting.is_running or any(channel.waiting for channel in self.wire.sdo)

    @property
    def is_operational(self) -> bool:
        return self.state is NodeState.OPERATIONAL

    @property
    def sends_process_data(self) -> bool:
        """Whether RPDOs are sent: also to a lost node, which may hear, and until the last are taken over."""
        states = (NodeState.OPERATIONAL, NodeState.LOST, NodeState.DISABLED)
        return self.leaving.is_due or self.state in states

    def say(self, said: Text, now: float) -> None:
        self._view.say(said, now)

    def _show(self, now: float) -> None:
        self._view.show(self.error_control.state, self.state, self.error_control.toggle_errors, now)

    def ask(self, request: Request, holder: ParameterHolder, now: float, reply: Reply) -> None:
        """Carry out a request for a parameter of a drive or of the device; ``reply`` is called once, when it
        has answered."""
        self.parameters.submit(request, holder, now, reply)
        self._touch()

    def carry_out_command(
        self, action: Action, who: Words, now: float, *, send: bool = True, at_once: bool = False
    ) -> None:
        """Carry out a permitted command; ``send`` is false where one frame has told all nodes."""
        self.error_control.forget_boots()
        self._back_off.reset()
        if action in (Action.RESET, Action.RESET_COMMUNICATION):
            self._memory.start_anew()
        node_commands.carry_out(self, action, who, now, send=send, at_once=at_once)
        self._touch()
