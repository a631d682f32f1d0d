"""NORD SK TU4-CAO and SK CU4-CAO: a CANopen bus interface with four inverters on its system bus (BU 2500)."""

from __future__ import annotations

from collections.abc import Sequence

from bridge.sim.core.dictionary import Dictionary
from bridge.sim.core.nmt_slave import CommandSpecifier, SlaveState
from bridge.sim.core.pdo_objects import PdoConfigurator
from bridge.sim.core.sdo_server import SimulatedSdoServer
from bridge.sim.core.store import Store
from bridge.sim.nord.nord_drive import VALID, NordDrive
from bridge.sim.nord.nord_faults import (
    BUS_TIMEOUT,
    INTERFACE_BUS_TIMEOUT,
    INTERFACE_CANOPEN_TIMEOUT,
    INTERFACE_MISSING,
    TELEGRAM_DOWNTIME,
)
from bridge.sim.nord.nord_image import ProcessImage
from bridge.sim.nord.nord_interface import InterfaceParts, Kind, build_dictionary, build_servers
from bridge.sim.nord.nord_node import NordNode
from bridge.sim.nord.nord_profile import ProfileDictionary, VelocityMode
from bridge.sim.nord.nord_settings import (
    ALL_SLOTS,
    DRIVES,
    PDO_WORDS,
    InterfaceSettings,
    Layout,
    factory_communication,
    place_of,
)
from bridge.sim.nord.nord_states import NordState
from bridge.sim.nord.nord_supervision import FaultDisplay, Presence, TelegramWatch, module_state


class NordTu4(NordNode):
    """Slots are named "fu1"…"fu4" or numbered 1…4. ``profile``: P168 [-01] was saved as 1."""

    def __init__(
        self,
        node_id: int,
        *,
        kind: Kind = "SK TU4-CAO",
        p151_ms: int = 0,
        p105_hz: float = 50.0,
        p112_a: float = 10.0,
        layout: Layout = "three",
        fitted: Sequence[int] = ALL_SLOTS,
        profile: bool = False,
        ripple: float = 0.0,
        seed: int = 0,
    ) -> None:
        self._layout: Layout = layout
        self._kind: Kind = kind
        self._interface = Store(InterfaceSettings)
        self._interface.current.p151_ms = p151_ms
        drives = [
            NordDrive(p105_hz=p105_hz, p112_a=p112_a, ripple=ripple, seed=seed + place)
            for place in range(DRIVES)
        ]
        super().__init__(
            node_id,
            drives,
            Store(lambda: factory_communication(node_id, layout)),
            TelegramWatch(lambda: self._interface.current.p151_ms / 1000),
        )
        self.presence = [Presence.ONLINE if slot in fitted else Presence.OFFLINE for slot in ALL_SLOTS]
        self.faults = FaultDisplay()
        self.image = ProcessImage(self.drives, self._online, layout)
        self.profile = VelocityMode(self.drives, self._online, self.image, self._interface)
        if profile:
            self._set_profile(True)
            self._communication.save()
        self._interface.save()  # commissioned before it was connected to this bus
        self._build()
        self.image.dirty = self.slave.dirty

    # What a test or a demonstration does to its drives.

    def fail_drive(self, slot: str | int, fault_tenths: int) -> None:
        """The drive trips by itself; 30 is E003/3.0. The cause does not last: an acknowledge works."""
        drive = self.drives[place_of(slot)]
        self._injected.append(lambda: drive.trip(fault_tenths))

    def drop_drive(self, slot: str | int) -> None:
        """The drive loses the system bus: missing for the interface, 10.9 in the drive."""
        place = place_of(slot)
        self._injected.append(lambda: self._join(place, Presence.LOST))

    def restore_drive(self, slot: str | int) -> None:
        """The drive is on the system bus (again). It keeps its fault until the acknowledge."""
        place = place_of(slot)
        self._injected.append(lambda: self._join(place, Presence.ONLINE))

    # The application of the CANopen slave.

    def restarted(self, command: CommandSpecifier) -> None:
        if command is CommandSpecifier.RESET_COMMUNICATION:
            self._fit_mappings()  # the mapping that was saved may be for the other kind of objects
            return  # the application, and with it P151, is not touched (CiA 301 §7.3.2.2.1)
        self._power_on()
        for drive in self.drives:
            # The restarting interface leaves the system bus for a moment. The manual does not say how
            # a drive reacts; here a running one reports it as missing, one at rest ignores it.
            if drive.state in (NordState.ENABLED, NordState.QUICK_STOP):
                drive.communication_lost(INTERFACE_MISSING)
                drive.cause_gone()

    def accepts_rpdo(self, number: int, length: int, mapped_bits: int) -> bool:
        """§6.4: a drive's PDO is evaluated only with all four words, mapped and received. In the drive
        profile it has the words that are mapped by §6.7.3."""
        if number >= DRIVES:
            return True
        if self.profile.is_on:
            return length * 8 == mapped_bits
        return mapped_bits == 16 * PDO_WORDS and length == 2 * PDO_WORDS

    def rpdo_applied(self, number: int) -> None:
        del number  # the words written tell which drives are meant, however the PDO is mapped
        written = self.image.take_touched()
        if any(self.image.control[drive] & VALID for drive in written):
            self._watch.on_telegram(self._now)
            self.faults.clear(INTERFACE_BUS_TIMEOUT)
            self._causes_gone(BUS_TIMEOUT)
        self._forward(written)

    def master_lost(self) -> None:
        self.faults.report(INTERFACE_CANOPEN_TIMEOUT)
        self._tell_drives(TELEGRAM_DOWNTIME)

    def master_back(self) -> None:
        self.faults.clear(INTERFACE_CANOPEN_TIMEOUT)
        self._causes_gone(TELEGRAM_DOWNTIME)

    # How it works inside.

    def _empty_dictionary(self) -> Dictionary:
        return ProfileDictionary(self.profile.hides)

    def _fill(self, dictionary: Dictionary, pdos: PdoConfigurator) -> Sequence[SimulatedSdoServer]:
        parts = InterfaceParts(
            self.node_id,
            self._kind,
            self._communication,
            self._interface,
            self.image,
            self.faults,
            self._emcy,
            self.profile,
            self._module_state,
            self._to_factory,
            self._set_profile,
        )
        build_dictionary(dictionary, parts, pdos)
        return build_servers(dictionary, self.drives, self._online)

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
        return module_state(slave.state, slave.master_is_lost, self._watch.tripped, self.presence)

    def _to_factory(self) -> None:
        self._communication.to_factory()
        self._interface.to_factory()

    def _set_profile(self, on: bool) -> None:
        if on is self.profile.is_on:
            return
        self._interface.current.profile[0] = int(on)
        self.image.clear()
        self.profile.clear()
        self._fit_mappings()

    def _fit_mappings(self) -> None:
        """Remove mappings of objects that do not exist now. §6.7.3 leaves it to the master to map those of
        the profile; without the profile the factory mapping applies."""
        now, factory = self._communication.current, factory_communication(self.node_id, self._layout)
        for pdo, delivered in zip((*now.rpdo, *now.tpdo), (*factory.rpdo, *factory.tpdo), strict=True):
            if not any(pdo.entries) or any(self.profile.hides(entry >> 16) for entry in pdo.entries):
                pdo.entries = [0] * PDO_WORDS if self.profile.is_on else delivered.entries
                pdo.count = 0 if self.profile.is_on else delivered.count

    def _power_on(self) -> None:
        self._interface.power_on()
        self.image.clear()
        self.profile.clear()
        self.faults.power_off()
        self._watch.stop()
        self._reporter.reset()

    def _words_by_sdo(self) -> None:
        written = self.image.take_touched()
        if written and self.slave.state is SlaveState.OPERATIONAL:
            # Process words written by SDO act on the drive, but only a process data telegram restarts P151.
            self._forward(written)

    def _watch_expired(self) -> None:
        self.faults.report(INTERFACE_BUS_TIMEOUT)
        self._tell_drives(BUS_TIMEOUT)

    def _tell_drives(self, fault_tenths: int) -> None:
        for place, drive in enumerate(self.drives):
            if self._online(place):  # a drive that is off the system bus does not get it
                drive.communication_lost(fault_tenths)

    def _forward(self, places: Sequence[int]) -> None:
        for place in places:
            if not self._online(place):
                continue
            drive = self.drives[place]
            control = self.image.control[place]
            if control & VALID:
                drive.follow(self.profile.demand(place) if self.profile.is_on else None)
            drive.on_telegram(control, self.image.setpoints_of(place))

    def _present_faults(self) -> Sequence[int | None]:
        drives = zip(self.presence, self.drives, strict=True)
        return [drive.fault_tenths if presence is Presence.ONLINE else None for presence, drive in drives]
