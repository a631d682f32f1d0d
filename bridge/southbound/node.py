"""One node on one bus: frames and time in, frames and readings out. Sans-IO."""

from __future__ import annotations

import struct
from collections.abc import Callable

from bridge.command import Action, Code, Event, Kind, Outcome, Plant, Reply, Request
from bridge.command.link import NodeState
from bridge.command.plant import Node
from bridge.southbound import boot, node_commands
from bridge.southbound.booting import Booting
from bridge.southbound.bus.frame import Frame
from bridge.southbound.canopen import cobid, emcy, nmt
from bridge.southbound.canopen.heartbeat import HeartbeatConsumer, NodeGuard
from bridge.southbound.canopen.nmt import NmtCommand, NmtState
from bridge.southbound.canopen.sdo import SdoChannel, SdoError
from bridge.southbound.canopen.sync import tpdo_deadline_s
from bridge.southbound.polling import Polling
from bridge.southbound.process_data import DrivePdos

_FIRST_RETRY_S = 1.0
_LAST_RETRY_S = 10.0
_BETWEEN_BOOTS_S = 0.2
_SETTLE_S = 2.0

Handler = Callable[[Frame], None]


class NodeCore:
    """Boots, supervises and exchanges data with one node.

    ``rejected`` counts frames that did not fit what the node says it sends.
    """

    def __init__(self, node: Node, plant: Plant) -> None:
        self.node = node
        self._plant = plant
        self._table = node.table
        timeout_s = self._table.sdo_timeout_ms / 1000
        node_id = self._table.id
        self.sdo = SdoChannel(cobid.SDO_REQUEST + node_id, cobid.SDO_REPLY + node_id, timeout_s)
        self.state = NodeState.ABSENT
        self.nmt_state = NmtState.UNKNOWN
        self.rejected = 0
        self.is_taken: Callable[[int], bool] = lambda cob_id: False
        """Whether another node of the bus has a PDO on this identifier."""
        self.drives: dict[str, DrivePdos] = {}
        self.routes: dict[int, Handler] = self._basic_routes()
        self.routes_changed = True
        supervision_s = self._table.supervision_ms / 1000
        self._supervisor: HeartbeatConsumer | NodeGuard | None = None
        if self._table.supervision == "heartbeat":
            self._supervisor = HeartbeatConsumer(supervision_s)
        elif self._table.supervision == "guarding":
            self._supervisor = NodeGuard(node_id, supervision_s, self._table.life_time_factor)
        self._booting = Booting(self, node, self.sdo)
        self._polling = Polling(node.family.poll, self.sdo, self._show_poll)
        self._boot_at: float | None = 0.0
        self._retry_s = _FIRST_RETRY_S
        self._last_boot = float("-inf")
        self._operational_since = 0.0
        self._frames: list[Frame] = []
        node.command = self.command
        if not self._table.enabled:
            self._boot_at = None
            self._set_state(NodeState.DISABLED, plant.began)
        self._say("waiting", plant.began)
        self._show(plant.began)

    # frames

    def _basic_routes(self) -> dict[int, Handler]:
        node_id = self._table.id
        return {
            cobid.SDO_REPLY + node_id: self._on_sdo,
            cobid.ERROR_CONTROL + node_id: self._on_error_control,
            cobid.EMCY + node_id: self._on_emcy,
        }

    def take_frames(self) -> list[Frame]:
        frames = self._frames + self.sdo.take_frames()
        self._frames = []
        if self._supervisor:
            frames += self._supervisor.take_frames()
        return frames

    def _on_sdo(self, frame: Frame) -> None:
        self.sdo.on_frame(frame)

    def _on_emcy(self, frame: Frame) -> None:
        emergency = emcy.decode(frame.data)
        if emergency is None:
            self.reject(frame, "an emergency message has 8 bytes")
            return
        byte = self.node.family.emcy.drive_byte
        number = frame.data[byte] if byte is not None and byte < len(frame.data) else None
        for drive in self.node.drives:
            if drive.slot.emcy_drive is None or drive.slot.emcy_drive == number:
                drive.channel.on_emcy(emergency.code, frame.time)
                drive.refresh(frame.time)

    def _on_error_control(self, frame: Frame) -> None:
        if len(frame.data) != 1:
            self.reject(frame, "an error control message has 1 byte")
            return
        state = nmt.state_of(frame.data[0])
        if state is NmtState.INITIALISING:
            self._on_boot_up(frame.time)
            return
        if self._supervisor:
            self._supervisor.on_frame(frame)
        if state is not self.nmt_state:
            self.nmt_state = state
            self._show(frame.time)
        self._judge_nmt_state(frame.time)

    def _on_boot_up(self, now: float) -> None:
        """The node has started: whatever it was told before is forgotten."""
        self.nmt_state = NmtState.PRE_OPERATIONAL
        if self.state is NodeState.DISABLED:
            return
        if self.state is NodeState.OPERATIONAL:
            self._plant.report(Event(now, Kind.NODE_LOST, self.node.name, 800, "the node has restarted"))
        self._leave_operation(now)
        self._set_state(NodeState.BOOTING, now)
        self._boot_at = max(now, self._last_boot + _BETWEEN_BOOTS_S)
        self._retry_s = _FIRST_RETRY_S

    def _judge_nmt_state(self, now: float) -> None:
        self._booting.on_nmt_state(self.nmt_state, now)
        if self.state is NodeState.LOST and not self._booting.is_running:
            # Heard again without a boot-up message: the cable was the fault, not the node.
            self._boot_at = max(now, self._last_boot + _BETWEEN_BOOTS_S)
        elif (
            self.state is NodeState.OPERATIONAL
            and self.nmt_state is not NmtState.OPERATIONAL
            and now > self._operational_since + _SETTLE_S
        ):
            self._lose(f"the node went {self.nmt_state.label.replace('_', ' ')} by itself", now)
            self._boot_at = now

    def reject(self, frame: Frame, why: str) -> None:
        """A frame that does not fit: counted, told at most once a minute, nothing changed."""
        self.rejected += 1
        message = f"{frame!r} does not fit: {why}"
        self._plant.report(Event(frame.time, Kind.CONFIGURATION, self.node.name, 300, message))

    # time

    def on_time(self, now: float) -> None:
        self.sdo.on_time(now)
        if self._supervisor and self._supervisor.on_time(now):
            self._lose("silent", now)
        self._booting.on_time(now, self.nmt_state)
        if self._boot_at is not None and now >= self._boot_at and not self._booting.is_running:
            self._boot_at = None
            self._last_boot = now
            self._booting.begin(now)
        self._polling.on_time(now)

    def next_deadline(self) -> float | None:
        times = [
            self.sdo.next_deadline(),
            self._supervisor.next_deadline() if self._supervisor else None,
            self._booting.next_deadline(),
            None if self._booting.is_running else self._boot_at,
            self._polling.next_deadline(),
        ]
        known = [time for time in times if time is not None]
        return min(known) if known else None

    def _show_poll(self, name: str, value: int, now: float) -> None:
        self._plant.set(f"{self.node.name}/node/{name}", value, now)

    # boot-up

    def pump(self, now: float) -> None:
        """Let the boot-up go on with the answers that have come."""
        self._booting.pump(now)

    def carry_out(self, action: boot.Action, now: float) -> None:
        match action:
            case boot.Step(text):
                # Looking for a node that was never there is nothing to report every ten seconds.
                if self.state is not NodeState.ABSENT:
                    self._say(text, now)
            case boot.Nmt(command):
                self._frames.append(nmt.command(command, self._table.id))
            case boot.SendStopped():
                self._set_state(NodeState.BOOTING, now)
                self._frames += self._stopped_frames()
            case boot.StartSupervision():
                if self._supervisor:
                    self._supervisor.expect(now)
            case _:
                raise AssertionError(f"{action} waits for an answer")

    def begin_await(self, state: NmtState) -> bool:
        if self._supervisor is None:
            self.nmt_state = state
            return False
        # What was reported before the command does not count.
        self.nmt_state = NmtState.UNKNOWN
        return True

    def _stopped_frames(self) -> list[Frame]:
        frames: list[Frame] = []
        for drive in self.node.drives:
            words = (drive.channel.words.stopped, *([0] * (len(drive.family.process.rpdo) - 1)))
            data = struct.pack(f"<{len(words)}H", *words)
            frames.append(Frame(drive.slot.rpdo.cob_id + self._table.id, data))
        return frames

    def boot_ended(self, result: boot.BootResult | Exception, now: float) -> None:
        if isinstance(result, Exception):
            self._fail_boot(result, now)
            return
        self._retry_s = _FIRST_RETRY_S
        self._apply(result, now)
        self._operational_since = now
        self.nmt_state = NmtState.OPERATIONAL
        self._set_state(NodeState.OPERATIONAL, now)
        self._polling.start(now)
        for drive in self.node.drives:
            if drive.name not in self.drives:
                drive.channel.on_node(NodeState.CONFIG_ERROR, now)
                drive.refresh(now)
        self._say("; ".join(["ok", *result.notes]), now)

    def _fail_boot(self, error: Exception, now: float) -> None:
        if self._supervisor:
            self._supervisor.reset()
        absent = isinstance(error, SdoError) and not error.by_server
        self._say("no answer" if absent else str(error), now)
        if self.state is NodeState.BOOTING:
            self._set_state(NodeState.LOST if absent else NodeState.CONFIG_ERROR, now)
        self._boot_at = now + self._retry_s
        self._retry_s = min(self._retry_s * 2, _LAST_RETRY_S)

    def _apply(self, result: boot.BootResult, now: float) -> None:
        """Take over what the boot-up found: codecs, routes, scales, identity."""
        self.drives = {}
        self.routes = self._basic_routes()
        for drive in self.node.drives:
            drive.on_identification(result.identification, now)
            for name, full in result.scales.get(drive.name, {}).items():
                drive.on_scale(name, full)
            plan = result.drives[drive.name]
            if plan.rpdo is None or plan.tpdo is None or plan.problem:
                continue
            if self.is_taken(plan.rpdo.cob_id) or self.is_taken(plan.tpdo.cob_id):
                result.notes.append(f"{drive.slot.name}: another node has its PDO on the same identifier")
                continue
            pdos = self.drives[drive.name] = DrivePdos(drive, plan.rpdo, plan.tpdo, self.reject)
            self.routes[plan.tpdo.cob_id] = pdos.on_tpdo
            drive.channel.link.pdo_deadline_s = tpdo_deadline_s(
                plan.tpdo.transmission_type, plan.tpdo.event_timer_ms, self.node.bus.sync_period_ms
            )
        self.routes_changed = True

    # states

    def _lose(self, why: str, now: float) -> None:
        if self.state is not NodeState.OPERATIONAL:
            if self._supervisor:
                self._supervisor.reset()
            return
        self.nmt_state = NmtState.UNKNOWN
        self._say(f"lost: {why}", now)
        self._leave_operation(now)
        self._set_state(NodeState.LOST, now)
        self._boot_at = now + self._retry_s

    def _leave_operation(self, now: float) -> None:
        if self._supervisor:
            self._supervisor.reset()
        self._polling.stop()
        self._booting.cancel(now)

    def bus_is_gone(self, now: float) -> None:
        """The bus is down: everything on it is lost at once."""
        self._leave_operation(now)
        for drive in self.node.drives:
            drive.channel.on_bus_gone(now)
        self.nmt_state = NmtState.UNKNOWN
        if self.state in (NodeState.OPERATIONAL, NodeState.BOOTING):
            self._say("lost: the bus is down", now)
            self._set_state(NodeState.LOST, now)
        if self.state is not NodeState.DISABLED:
            self._boot_at = now + self._retry_s

    def _set_state(self, state: NodeState, now: float) -> None:
        if state is self.state:
            return
        self.state = state
        self._plant.on_node(self.node, state, now)
        self._show(now)

    @property
    def sends_process_data(self) -> bool:
        """RPDOs go on while the node is lost: stopped ones, in case it still hears us."""
        return self.state in (NodeState.OPERATIONAL, NodeState.LOST, NodeState.DISABLED)

    def _say(self, text: str, now: float) -> None:
        self._plant.set(f"{self.node.name}/node/boot_status", text, now)

    def _show(self, now: float) -> None:
        top = f"{self.node.name}/node"
        self._plant.set(f"{top}/nmt_state", int(self.nmt_state), now)
        self._plant.set(f"{top}/supervision_state", f"{self._table.supervision}: {self.state.value}", now)

    def refresh(self, now: float) -> None:
        self._plant.set(f"{self.node.name}/node/rejected_frames", self.rejected, now)
        for drive in self.node.drives:
            if drive.slot.parameters_by_sdo:
                drive.sdo_abort_code = self.sdo.last_abort

    # commands on the node

    def command(self, request: Request, now: float, reply: Reply) -> None:
        """Reset, enable or disable the node. Nobody does that to a drive another one controls."""
        why = node_commands.refusal(request, self.node.drives)
        if why:
            reply(Outcome(Code.NOT_ALLOWED, why, forwarded=False))
            return
        self._plant.report(
            Event(now, Kind.OWNER, self.node.name, 400, f"{request.action} by {request.identity}")
        )
        match request.action:
            case Action.RESET | Action.RESET_COMMUNICATION:
                reset = request.action is Action.RESET
                what = NmtCommand.RESET_NODE if reset else NmtCommand.RESET_COMMUNICATION
                self._leave_operation(now)
                self._frames.append(nmt.command(what, self._table.id))
                if self.state is not NodeState.DISABLED:
                    self._set_state(NodeState.LOST, now)
                    self._boot_at = now + _FIRST_RETRY_S
            case Action.DISABLE:
                self._leave_operation(now)
                self._boot_at = None
                self._say("switched off by an operator", now)
                self._set_state(NodeState.DISABLED, now)
            case Action.ENABLE if self.state is NodeState.DISABLED:
                self._say("waiting", now)
                self._set_state(NodeState.ABSENT, now)
                self._boot_at = now
            case _:
                pass
        reply(Outcome(Code.OK))
