"""Base of every NORD node, whatever stands behind it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Final

from bridge.canopen.frame import Frame
from bridge.sim.core.canopen_slave import CanopenSlave
from bridge.sim.core.communication_settings import CommunicationSettings
from bridge.sim.core.dictionary import Dictionary
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.nmt_slave import SlaveState
from bridge.sim.core.pdo_objects import PdoConfigurator
from bridge.sim.core.sdo_server import SimulatedSdoServer
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.core.store import Store
from bridge.sim.nord.nord_drive import NordDrive
from bridge.sim.nord.nord_settings import RULES
from bridge.sim.nord.nord_supervision import DriveFaultReporter, TelegramWatch


class NordNode(SimulatedDevice):
    """A family calls ``_build`` once it can fill the dictionary."""

    def __init__(
        self,
        node_id: int,
        drives: Sequence[NordDrive],
        communication: Store[CommunicationSettings],
        watch: TelegramWatch,
    ) -> None:
        super().__init__(node_id)
        self.drives = tuple(drives)
        self._communication = communication
        self._watch: Final = watch
        self._emcy = EmcyProducer(communication, RULES)
        self._reporter = DriveFaultReporter(self._emcy, len(self.drives))

    def _build(self) -> None:
        """Make the CANopen slave with the family's objects."""
        dictionary = self._empty_dictionary()
        pdos = PdoConfigurator(
            dictionary, self._communication, RULES, lambda: self.slave.state is SlaveState.PRE_OPERATIONAL
        )
        servers = self._fill(dictionary, pdos)
        self.slave = CanopenSlave(
            self.node_id, self._communication, dictionary, servers, emcy=self._emcy, application=self
        )
        for drive in self.drives:
            drive.dirty = self.slave.dirty

    # To be defined by the family.

    def _empty_dictionary(self) -> Dictionary:
        return Dictionary()

    @abstractmethod
    def _fill(self, dictionary: Dictionary, pdos: PdoConfigurator) -> Sequence[SimulatedSdoServer]:
        """Put the node's objects into ``dictionary``; returns what each SDO channel reaches."""

    @abstractmethod
    def _power_on(self) -> None:
        """Settings and process data are those of power-on."""

    @abstractmethod
    def _words_by_sdo(self) -> None:
        """An SDO request has been answered: process words that it wrote take effect on the drives."""

    @abstractmethod
    def _watch_expired(self) -> None:
        """The master's telegrams are missing."""

    @abstractmethod
    def _present_faults(self) -> Sequence[int | None]:
        """Fault of each drive, in tenths; None where the node cannot see it."""

    # The application of the CANopen slave, as far as all have it in common.

    def nmt_changed(self, state: SlaveState) -> None:
        # §7.1.1 demands the next valid telegram within P151 of the last without naming an exception, and
        # §6.2 closes the PDO channel outside Operational. So nothing is done here: the watch goes on
        # running and trips: a master that leaves Operational while a drive runs counts as silent.
        del state

    # How it works inside.

    def _causes_gone(self, fault_tenths: int) -> None:
        for drive in self.drives:
            if drive.fault_tenths == fault_tenths:
                drive.cause_gone()

    def _switch_on(self) -> None:
        self._communication.power_on()
        self._power_on()
        for drive in self.drives:
            drive.power_on(self._now)

    def _pass_time(self) -> None:
        for drive in self.drives:
            drive.advance(self._now)
        if self._watch.expired(self._now):
            self._watch_expired()

    def _receive(self, frame: Frame) -> None:
        self.slave.on_frame(frame, self._now)
        self._words_by_sdo()

    def _deadlines(self) -> list[float | None]:
        return [self._watch.next_deadline(), *(drive.next_deadline() for drive in self.drives)]

    def _finish(self) -> None:
        self._report_faults()
        was_lost = self.slave.master_is_lost
        self.slave.poll(self._now)
        if self.slave.master_is_lost is not was_lost and self._report_faults():
            self.slave.poll(self._now)

    def _report_faults(self) -> bool:
        return self._reporter.report(self._present_faults())
