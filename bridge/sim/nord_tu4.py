"""NORD SK TU4-CAO: a CANopen bus interface with four inverters on its system bus (BU 2500)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bridge.sim.canopen_slave import CanopenSlave
from bridge.sim.dictionary import Dictionary
from bridge.sim.emcy_producer import EmcyProducer
from bridge.sim.nmt_slave import NmtCommand, NmtState
from bridge.sim.nord_drive import VALID, NordDrive
from bridge.sim.nord_faults import (
    BUS_TIMEOUT,
    INTERFACE_BUS_TIMEOUT,
    INTERFACE_CANOPEN_TIMEOUT,
    INTERFACE_MISSING,
    TELEGRAM_DOWNTIME,
)
from bridge.sim.nord_image import ProcessImage
from bridge.sim.nord_interface import InterfaceParts, build_dictionary, build_servers
from bridge.sim.nord_settings import (
    ALL_SLOTS,
    DRIVES,
    PDO_WORDS,
    RULES,
    InterfaceSettings,
    Layout,
    factory_communication,
    place_of,
)
from bridge.sim.nord_states import State
from bridge.sim.nord_supervision import (
    DriveFaultReporter,
    ExternalBusTimeout,
    FaultDisplay,
    Presence,
    module_state,
)
from bridge.sim.pdo_objects import PdoObjects
from bridge.sim.sdo_server import SdoServer
from bridge.sim.store import Store
from bridge.southbound.bus.frame import STANDARD_MASK, Frame


class NordTu4:
    """The node as the CAN bus sees it. Times are seconds of the caller's monotonic clock.

    Slots are named "fu1"…"fu4" or numbered 1…4. What is injected (``fail_drive`` and its like) happens at
    the next ``on_time`` or ``on_frame``; ``next_deadline`` says at once that there is something to do.
    """

    def __init__(
        self,
        node_id: int,
        *,
        p151_ms: int = 0,
        p105_hz: float = 50.0,
        p112_a: float = 10.0,
        layout: Layout = "three",
        fitted: Sequence[int] = ALL_SLOTS,
        ripple: float = 0.0,
        seed: int = 0,
    ) -> None:
        self.node_id = node_id
        self.drives = tuple(
            NordDrive(p105_hz=p105_hz, p112_a=p112_a, ripple=ripple, seed=seed + place)
            for place in range(DRIVES)
        )
        self.presence = [Presence.ONLINE if slot in fitted else Presence.OFFLINE for slot in ALL_SLOTS]
        self.faults = FaultDisplay()
        self.image = ProcessImage(self.drives, self._online, layout)
        self.powered = False
        self._now = 0.0
        self._injected: list[Callable[[], None]] = []
        self._communication = Store(lambda: factory_communication(node_id, layout))
        self._interface = Store(InterfaceSettings)
        self._interface.current.p151_ms = p151_ms
        self._interface.save()  # commissioned before it came onto this bus
        self._timeout = ExternalBusTimeout(lambda: self._interface.current.p151_ms)
        emcy = EmcyProducer(self._communication, RULES)
        self._reporter = DriveFaultReporter(emcy, DRIVES)
        self.slave = CanopenSlave(
            node_id, self._communication, *self._build_objects(emcy), emcy=emcy, application=self
        )
        self._heard = self.slave.hears()

    # The core: frames and time in, frames out.

    def start(self, now: float) -> None:
        """Power on, interface and drives."""
        self._now = now
        self._communication.power_on()
        self._interface.power_on()
        self._reset_application()
        for drive in self.drives:
            drive.power_on(now)
        self.powered = True
        self.slave.boot()
        self._heard = self.slave.hears()

    def on_frame(self, frame: Frame, now: float) -> None:
        if not self.powered or frame.can_id & STANDARD_MASK not in self._heard:
            return
        self._advance(now)
        self.slave.on_frame(frame, self._now)
        written = self.image.take_touched()
        if written and self.slave.state is NmtState.OPERATIONAL:
            # Process words written by SDO act on the drive, but P151 waits for a process data telegram.
            self._forward(written)
        if self.powered:
            self._finish()
        self._heard = self.slave.hears()

    def on_time(self, now: float) -> None:
        self._advance(now)
        if self.powered:
            self._finish()

    def next_deadline(self) -> float | None:
        if self._injected:
            return self._now
        if not self.powered:
            return None
        deadlines = [self.slave.next_deadline(), self._timeout.next_deadline()]
        deadlines += [drive.next_deadline() for drive in self.drives]
        return min((deadline for deadline in deadlines if deadline is not None), default=None)

    def take_frames(self) -> list[Frame]:
        return self.slave.take_frames()

    # What a test or a demonstration does to the node.

    def fail_drive(self, slot: str | int, fault_tenths: int) -> None:
        """The drive trips by itself; 30 is E003/3.0. The cause is gone at once, the acknowledge works."""
        drive = self.drives[place_of(slot)]
        self._injected.append(lambda: drive.trip(fault_tenths))

    def drop_drive(self, slot: str | int) -> None:
        """The drive loses the system bus: lost for the interface, 10.9 in the drive."""
        place = place_of(slot)
        self._injected.append(lambda: self._join(place, Presence.LOST))

    def restore_drive(self, slot: str | int) -> None:
        """The drive is on the system bus (again). It keeps its fault until the acknowledge."""
        place = place_of(slot)
        self._injected.append(lambda: self._join(place, Presence.ONLINE))

    def silence(self) -> None:
        """The node sends nothing more; it goes on receiving and working."""
        self.slave.silent = True

    def speak(self) -> None:
        self.slave.silent = False

    def power_off(self) -> None:
        """Mains and 24 V off for the interface and its drives."""

        def off() -> None:
            self.powered = False
            self.slave.power_off()

        self._injected.append(off)

    def power_cycle(self) -> None:
        """Off and on again: unsaved settings are lost, the boot-up message comes."""
        self.power_off()
        self._injected.append(lambda: self.start(self._now))

    # The application of the CANopen slave.

    def nmt_changed(self, state: NmtState) -> None:
        # §7.1.1 demands the next valid telegram within P151 of the last without naming an exception, and
        # §6.2 closes the PDO channel outside Operational. So nothing is done here: P151 goes on running and
        # trips. A master that lets a drive run and leaves Operational is a master that fell silent.
        del state

    def restarted(self, command: NmtCommand) -> None:
        if command is NmtCommand.RESET_COMMUNICATION:
            return  # the application, and with it P151, is not touched (CiA 301 §7.3.2.2.1)
        self._interface.power_on()
        self._reset_application()
        for drive in self.drives:
            # The restarting interface is gone from the system bus for a moment. The manual does not say what
            # a drive makes of it; here one that is running reports it as missing, one at rest lets it pass.
            if drive.state in (State.ENABLED, State.QUICK_STOP):
                drive.communication_lost(INTERFACE_MISSING)
                drive.cause_gone()

    def accepts_rpdo(self, number: int, length: int) -> bool:
        """§6.4: a drive's PDO is evaluated only with all four words, mapped and received."""
        if number >= DRIVES:
            return True
        words = self._communication.current.rpdo[number].mapped_bits == 16 * PDO_WORDS
        return words and length == 2 * PDO_WORDS

    def rpdo_applied(self, number: int) -> None:
        del number  # the words written say which drives are meant, however the PDO is mapped
        written = self.image.take_touched()
        if any(self.image.control[drive] & VALID for drive in written):
            self._telegram_came()
        self._forward(written)

    def master_lost(self) -> None:
        self.faults.report(INTERFACE_CANOPEN_TIMEOUT)
        self._tell_drives(TELEGRAM_DOWNTIME)

    def master_back(self) -> None:
        self.faults.clear(INTERFACE_CANOPEN_TIMEOUT)
        self._causes_gone(TELEGRAM_DOWNTIME)

    # How it works inside.

    def _build_objects(self, emcy: EmcyProducer) -> tuple[Dictionary, list[SdoServer]]:
        dictionary = Dictionary()
        parts = InterfaceParts(
            self.node_id,
            self._communication,
            self._interface,
            self.image,
            self.faults,
            emcy,
            self._module_state,
            self._to_factory,
        )
        pdos = PdoObjects(
            dictionary, self._communication, RULES, lambda: self.slave.state is NmtState.PRE_OPERATIONAL
        )
        build_dictionary(dictionary, parts, pdos)
        return dictionary, build_servers(dictionary, self.drives, self._online)

    def _online(self, place: int) -> bool:
        return self.presence[place] is Presence.ONLINE

    def _join(self, place: int, presence: Presence) -> None:
        self.presence[place] = presence
        if presence is Presence.ONLINE:
            self.drives[place].cause_gone()
        else:
            self.drives[place].communication_lost(INTERFACE_MISSING)

    def _module_state(self) -> int:
        slave = self.slave
        return module_state(slave.state, slave.master_is_lost, self._timeout.tripped, self.presence)

    def _to_factory(self) -> None:
        self._communication.to_factory()
        self._interface.to_factory()

    def _reset_application(self) -> None:
        self.image.clear()
        self.faults.power_off()
        self._timeout.disarm()
        self._reporter.reset()

    def _telegram_came(self) -> None:
        self._timeout.on_telegram(self._now)
        self.faults.clear(INTERFACE_BUS_TIMEOUT)
        self._causes_gone(BUS_TIMEOUT)

    def _tell_drives(self, fault_tenths: int) -> None:
        for place, drive in enumerate(self.drives):
            if self._online(place):  # one that is off the system bus does not hear of it
                drive.communication_lost(fault_tenths)

    def _causes_gone(self, fault_tenths: int) -> None:
        for drive in self.drives:
            if drive.fault_tenths == fault_tenths:
                drive.cause_gone()

    def _forward(self, places: Sequence[int]) -> None:
        for place in places:
            if self._online(place):
                self.drives[place].on_telegram(self.image.control[place], self.image.setpoints_of(place))

    def _advance(self, now: float) -> None:
        self._now = max(self._now, now)  # stamps of frames may lie before the last timer
        if self.powered:
            for drive in self.drives:
                drive.advance(self._now)
            if self._timeout.expired(self._now):
                self.faults.report(INTERFACE_BUS_TIMEOUT)
                self._tell_drives(BUS_TIMEOUT)
        injected, self._injected = self._injected, []
        for action in injected:
            action()

    def _finish(self) -> None:
        self._report_faults()
        self.slave.poll(self._now)
        if self._report_faults():  # the life time may have run out in between
            self.slave.poll(self._now)

    def _report_faults(self) -> bool:
        drives = zip(self.presence, self.drives, strict=True)
        return self._reporter.report(
            [drive.fault_tenths if presence is Presence.ONLINE else None for presence, drive in drives]
        )
