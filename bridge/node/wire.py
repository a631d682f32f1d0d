"""Traffic of one node: routes, SDO, emergencies, error control, process data. Sans-IO."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Final

from bridge.base.sdo_texts import text_of_learned
from bridge.canopen import cobid, nmt
from bridge.canopen.frame import Frame
from bridge.canopen.habits import HabitCounter, Odd
from bridge.canopen.nmt import NmtCommand
from bridge.canopen.sdo import SdoChannel
from bridge.command import BusSide, Commanded, Event, EventKind
from bridge.command.device import Device
from bridge.command.node import Node
from bridge.node import boot
from bridge.node.emergencies import Concerned, Emergencies
from bridge.node.error_control import ErrorControl, Sign
from bridge.node.fault_reading import FaultReading
from bridge.node.identifiers import BusIdentifiers
from bridge.node.meaning_watch import MeaningWatch
from bridge.node.places.sdo_channels import SdoChannels
from bridge.node.process.inputs import connect_inputs
from bridge.node.process.output_rpdos import OutputPdos, connect_outputs
from bridge.node.process.polling import Polling
from bridge.node.process.process_data import DrivePdos, connect
from bridge.node.process.stop_words import StopWords
from bridge.node.process.tpdo import node_tpdos
from bridge.node.process.unfit_frames import UnfitFrames
from bridge.node.put_off import PutOff
from bridge.node.read_back import ReadBack
from bridge.text import Said, Text

Handler = Callable[[Frame], None]
Service = Callable[[Frame], Sign | None]
"""Taker of a frame by which more than process data may change. It gives the content of an error control
message, None for any other frame."""
_SDO_BYTES: Final = 8


class NodeWire:
    """Frames from and to one node."""

    def __init__(self, node: Node, side: BusSide, identifiers: BusIdentifiers, stop_words: StopWords) -> None:
        self._node = node
        self.stop_words = stop_words
        self._image = side.image
        self._events = side.events
        self._identifiers = identifiers
        self.sdo = SdoChannels(node)
        self.habits = HabitCounter()
        self.unfit = UnfitFrames(node.name, side.events, self.habits, cobid.EMCY + node.table.id)
        self.faults = FaultReading(node, self.sdo)
        self.meanings = MeaningWatch(node, self.sdo)
        outputs = [one for device in node.devices for one in device.commanded]
        self._read_backs = [ReadBack(one, self.sdo) for one in outputs]
        self._timed = (*node.devices, *self._read_backs)
        self._emergencies = Emergencies(node, side)
        self.error_control = ErrorControl(node.table)
        self.polling = Polling(node.family.poll, self.sdo.for_polls, side.image, f"{node.name}/node")
        self.drives: dict[str, DrivePdos] = {}
        self.output_pdos: dict[str, OutputPdos] = {}
        """PDOs of outputs, by output name; ``drives`` has those of drives."""
        self._no_rpdo: dict[str, Said] = {one.name: Text.of("unsent.no_rpdo") for one in outputs}
        self._left_out = self._no_rpdo
        self.requests: dict[int, Handler] = {
            channel.request_id: self.error_control.on_foreign_request for channel in self.sdo
        }
        """Handlers of other clients' SDO requests, by COB-ID: what we send does not come back."""
        self.services = self._services()
        """Takers of SDO answers, error control and emergency messages, by COB-ID."""
        self.routes: dict[int, Handler] = {}
        """Handlers of process data, by COB-ID."""
        self.routes_changed = True
        self._frames: list[Frame] = []
        self.put_off = PutOff()
        """NMT command that waits until stopped words are taken over; these go on until then."""

    def _services(self) -> dict[int, Service]:
        services: dict[int, Service] = {
            **{channel.reply_id: partial(self._on_sdo, channel) for channel in self.sdo},
            cobid.ERROR_CONTROL + self._node.table.id: self._on_error_control,
        }
        if self.unfit.emcy_id is not None:
            services[self.unfit.emcy_id] = self._on_emcy
        return services

    @property
    def given_ids(self) -> frozenset[int]:
        """COB-IDs that the site's files give to PDOs of the node."""
        return self.stop_words.given_ids

    def uses(self, cob_id: int) -> bool:
        """Whether the node uses this COB-ID at present, for a PDO or anything else."""
        is_received = cob_id in self.routes or cob_id in self.services or cob_id in self.requests
        return is_received or any(cob_id == rpdo.cob_id for pdos in self.pdos for rpdo in pdos.rpdos)

    def carries(self, one: Commanded) -> bool:
        """Whether the boot-up has found RPDOs that command ``one``."""
        return one.name in self.drives or one.name in self.output_pdos

    @property
    def pdos(self) -> Sequence[DrivePdos | OutputPdos]:
        """PDOs that command the node, of its drives and its outputs."""
        return [*self.drives.values(), *self.output_pdos.values()]

    def why_left_out(self, one: Commanded) -> Text:
        """Reason why the boot-up has found no PDOs by which ``one`` can be commanded."""
        return self._left_out.get(one.name) or Text.of("unsent.no_pdos")

    def take_routes(self) -> dict[int, Handler]:
        """Handlers of process data by COB-ID; marks all COB-IDs as taken until they change."""
        self.routes_changed = False
        return self.routes

    def take_frames(self, *, only_commands: bool = False) -> list[Frame]:
        """Frames to be sent now. ``only_commands``: process data and NMT alone, all requests are dropped."""
        asked = self.sdo.take_frames() + self.error_control.take_frames() + self.polling.take_frames()
        commands, self._frames = self._frames, []
        return commands if only_commands else commands + asked

    def clear(self) -> None:
        """Drop all that waits to be sent: the bus is gone."""
        self._frames.clear()
        self.put_off.clear()

    def send_nmt(self, command: NmtCommand) -> None:
        """Send ``command`` now, and drop the one that waits."""
        self.put_off.clear()
        self._frames.append(nmt.command(command, self._node.table.id))

    def carry_out(self, action: boot.Action) -> None:
        """Send what the boot-up asks for and needs no answer to."""
        match action:
            case boot.SendNmt(command):
                self.send_nmt(command)
            case boot.BootSignal.SEND_STOPPED:
                self.send_stopped()
            case boot.BootSignal.WAKE:
                self.send_stopped()
                self.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
            case boot.ResetCommunication():
                self.send_stopped()
                self.send_nmt(NmtCommand.RESET_COMMUNICATION)
            case _:
                raise AssertionError(f"{action} waits for an answer")

    def send_stopped(self) -> None:
        is_foreign = partial(self._identifiers.is_foreign, self)
        self._frames += self.stop_words.frames(self.drives, is_foreign)
        for pdos in self.output_pdos.values():
            frames = pdos.frames_with_stop()
            self._frames += [frame for frame in frames if not is_foreign(frame.can_id)]

    def _on_sdo(self, channel: SdoChannel, frame: Frame) -> None:
        unmatched, late = channel.unmatched, channel.late
        self.meanings.now = frame.time
        for one in self._read_backs:
            one.now = frame.time
        channel.on_frame(frame)
        if len(frame.data) != _SDO_BYTES:
            self.habits.note(Odd.SDO_LENGTH, len(frame.data), _SDO_BYTES)
        if channel.late == late:
            self.error_control.on_reply(frame, matched=channel.unmatched == unmatched)
        else:
            late_ms, timeout_ms = round(1000 * channel.lateness_s), round(1000 * channel.timeout_s)
            self.habits.note(Odd.SDO_LATE, late_ms, timeout_ms)
        self._tell_learned(frame.time)

    def _on_emcy(self, frame: Frame) -> None:
        concerned = self._emergencies.on_frame(frame)
        if concerned is None:
            self.unfit.reject(frame, Text.of("frame.emergency_length"))
        else:
            self._look_for_faults(concerned)

    def _look_for_faults(self, concerned: Sequence[Concerned]) -> None:
        for one in concerned:
            self.faults.on_emcy(one.drive, one.at)

    def _on_error_control(self, frame: Frame) -> Sign:
        sign = self.error_control.on_frame(frame)
        if sign is Sign.MALFORMED:
            self.habits.note(Odd.HEARTBEAT_LENGTH, len(frame.data), 1)
            self.unfit.reject(frame, Text.of("frame.error_control_length"))
        return sign

    def on_time(self, now: float) -> None:
        self._look_for_faults(self._emergencies.on_time(now))
        self.faults.on_time(now)
        self.meanings.on_time(now)
        for one in self._timed:
            one.on_time(now)
        self.sdo.on_time(now)
        self.send_put_off(now)

    def _tell_learned(self, now: float) -> None:
        """Report what was learned: that happens when a transfer ends well, which an answer brings about."""
        for learned in self.sdo.take_learned():
            said = Text.of("node.no_block_transfer", why=text_of_learned(learned))
            self._events.report(Event(now, EventKind.CONFIGURATION, self._node.name, 300, said))

    def send_put_off(self, now: float) -> None:
        """Send the NMT command that waits, if its time has come."""
        command = self.put_off.on_time(now)
        if command is not None:
            self.send_nmt(command)

    def next_deadline(self) -> float | None:
        times = (
            self.sdo.next_deadline(),
            self.error_control.next_deadline(),
            self.polling.next_deadline(),
            self._emergencies.next_deadline(),
            self.faults.next_deadline(),
            self.meanings.next_deadline(),
            self.put_off.next_deadline(),
            *[one.next_deadline() for one in self._timed],
        )
        return min((time for time in times if time is not None), default=None)

    def start_polling(self, now: float) -> None:
        """Begin all polling: the node is in operation."""
        self.polling.start(self.drives.values(), now)
        self.faults.start(now)
        self.meanings.start(now)

    def stop_polling(self) -> None:
        self.polling.stop()
        self.faults.stop()
        self.meanings.stop()

    def connect(self, result: boot.BootResult, now: float) -> None:
        """Take over what the boot-up found."""
        self.error_control.produces_every(result.heartbeat_ms / 1000 or None)
        self.unfit.emcy_id = self._usable_emcy_id(result)
        self._image.put(f"{self._node.name}/node/software_version", result.software_version, now)
        is_taken = partial(self._identifiers.is_taken, self)
        self.drives = connect(self._node, result, self.unfit, is_taken, now)
        self._left_out = self._no_rpdo | {
            name: Text.of("unsent.no_pdos_because", why=plan.problem)
            for name, plan in result.drives.items()
            if plan.problem
        }
        self.unfit.mapped_bytes = {pdo.cob_id: pdo.codec.length for pdo in _tpdos(result)}
        self.services = self._services()
        self.routes = {}
        for pdos in self.drives.values():
            self.routes |= pdos.handlers
        sync_ms = self._node.bus.sync_period_ms
        self.routes |= node_tpdos(result.node_tpdos, sync_ms, self.polling, self.unfit)
        for device in self._node.devices:
            self._connect_device(device, result, now)
        self.routes_changed = True

    def _connect_device(self, device: Device, result: boot.BootResult, now: float) -> None:
        plan, sync_ms = result.devices[device.name], self._node.bus.sync_period_ms
        device.identification = result.identification
        self.routes |= connect_inputs(device, plan.tpdos, sync_ms, self.unfit, now)
        for outputs in device.commanded:
            is_taken = partial(self._identifiers.is_taken, self)
            pdos = connect_outputs(outputs, plan.rpdos, result, is_taken, now)
            self.output_pdos = {outputs.name: pdos} if pdos else {}

    def _usable_emcy_id(self, result: boot.BootResult) -> int | None:
        """COB-ID of the emergency messages; the default one where the node's own belongs to another node."""
        default = cobid.EMCY + self._node.table.id
        wanted = result.emcy_id
        if wanted in (None, default) or not self._identifiers.is_taken(self, wanted):
            return wanted
        result.notes.append(Text.of("boot.emergency_id_taken", id=f"{wanted:03X}h"))
        return default

    def refresh(self, now: float) -> None:
        rejected = self.unfit.count + self.sdo.unmatched
        self._image.put(f"{self._node.name}/node/rejected_frames", rejected, now)
        self._emergencies.refresh(now)


def _tpdos(result: boot.BootResult) -> Iterator[boot.PdoPlan]:
    """TPDOs of the node that the bridge receives."""
    for plan in result.drives.values():
        yield from plan.tpdos
    for of_node in result.node_tpdos:
        yield of_node.pdo
    for device in result.devices.values():
        yield from device.tpdos.pdos
