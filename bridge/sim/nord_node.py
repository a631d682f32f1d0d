"""What every NORD node does with frames, time and power, whatever stands behind it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Final

from bridge.canopen.frame import STANDARD_MASK, Frame
from bridge.sim.canopen_slave import CanopenSlave
from bridge.sim.dictionary import Dictionary
from bridge.sim.emcy_producer import EmcyProducer
from bridge.sim.nmt_slave import NmtCommand, NmtState
from bridge.sim.nord_drive import NordDrive
from bridge.sim.nord_settings import RULES
from bridge.sim.nord_supervision import DriveFaultReporter, TelegramWatch
from bridge.sim.pdo_objects import PdoObjects
from bridge.sim.sdo_server import SdoServer
from bridge.sim.settings import CommunicationSettings
from bridge.sim.store import Store


class NordNode(ABC):
    """The node as the CAN bus sees it. Times are seconds of the caller's monotonic clock.

    What is injected happens at the next ``on_time`` or ``on_frame``; ``next_deadline`` says at once that
    there is something to do. A family calls ``_build`` when it is ready to fill the dictionary.
    """

    slave: CanopenSlave

    def __init__(
        self,
        node_id: int,
        drives: Sequence[NordDrive],
        communication: Store[CommunicationSettings],
        watch: TelegramWatch,
    ) -> None:
        self.node_id = node_id
        self.drives = tuple(drives)
        self.powered = False
        self._now = 0.0
        self._injected: list[Callable[[], None]] = []
        self._communication = communication
        self._watch: Final = watch
        self._emcy = EmcyProducer(communication, RULES)
        self._reporter = DriveFaultReporter(self._emcy, len(self.drives))
        self.heard: frozenset[int] = frozenset()

    def _build(self) -> None:
        """Make the CANopen slave with the family's objects."""
        dictionary = self._empty_dictionary()
        pdos = PdoObjects(
            dictionary, self._communication, RULES, lambda: self.slave.state is NmtState.PRE_OPERATIONAL
        )
        servers = self._fill(dictionary, pdos)
        self.slave = CanopenSlave(
            self.node_id, self._communication, dictionary, servers, emcy=self._emcy, application=self
        )

    # What a family is.

    def _empty_dictionary(self) -> Dictionary:
        return Dictionary()

    @abstractmethod
    def _fill(self, dictionary: Dictionary, pdos: PdoObjects) -> Sequence[SdoServer]:
        """Put the node's objects into ``dictionary``; returns what each SDO channel reaches."""

    @abstractmethod
    def _power_on(self) -> None:
        """Settings and process data are those of power-on."""

    @abstractmethod
    def _words_by_sdo(self) -> None:
        """An SDO request has been answered: process words that it wrote act on the drives."""

    @abstractmethod
    def _watch_expired(self) -> None:
        """The master's telegrams have failed to come."""

    @abstractmethod
    def _present_faults(self) -> Sequence[int | None]:
        """Of each drive, in tenths; None where the node cannot see it."""

    # The application of the CANopen slave, as far as all have it in common.

    def nmt_changed(self, state: NmtState) -> None:
        # §7.1.1 demands the next valid telegram within P151 of the last without naming an exception, and
        # §6.2 closes the PDO channel outside Operational. So nothing is done here: the watch goes on
        # running and trips. A master that lets a drive run and leaves Operational fell silent.
        del state

    @abstractmethod
    def restarted(self, command: NmtCommand) -> None: ...

    @abstractmethod
    def accepts_rpdo(self, number: int, length: int) -> bool: ...

    @abstractmethod
    def rpdo_applied(self, number: int) -> None: ...

    @abstractmethod
    def master_lost(self) -> None: ...

    @abstractmethod
    def master_back(self) -> None: ...

    # The core: frames and time in, frames out.

    def start(self, now: float) -> None:
        """Power on, interface and drives."""
        self._now = now
        self._communication.power_on()
        self._power_on()
        for drive in self.drives:
            drive.power_on(now)
        self.powered = True
        self.slave.boot()
        self.heard = self.slave.hears()

    def on_frame(self, frame: Frame, now: float) -> None:
        if not self.powered or frame.can_id & STANDARD_MASK not in self.heard:
            return
        self._advance(now)
        self.slave.on_frame(frame, self._now)
        self._words_by_sdo()
        if self.powered:
            self._finish()
        self.heard = self.slave.hears()

    def on_time(self, now: float) -> None:
        self._advance(now)
        if self.powered:
            self._finish()

    def next_deadline(self) -> float | None:
        if self._injected:
            return self._now
        if not self.powered:
            return None
        deadlines = [self.slave.next_deadline(), self._watch.next_deadline()]
        deadlines += [drive.next_deadline() for drive in self.drives]
        return min((deadline for deadline in deadlines if deadline is not None), default=None)

    def take_frames(self) -> list[Frame]:
        return self.slave.take_frames()

    # What a test or a demonstration does to any node.

    def silence(self) -> None:
        """The node sends nothing more; it goes on receiving and working."""
        self.slave.silent = True

    def speak(self) -> None:
        self.slave.silent = False

    def power_off(self) -> None:
        """Mains and 24 V off for the node and its drives."""

        def off() -> None:
            self.powered = False
            self.slave.power_off()

        self._injected.append(off)

    def power_cycle(self) -> None:
        """Off and on again: unsaved settings are lost, the boot-up message comes."""
        self.power_off()
        self._injected.append(lambda: self.start(self._now))

    # How it works inside.

    def _causes_gone(self, fault_tenths: int) -> None:
        for drive in self.drives:
            if drive.fault_tenths == fault_tenths:
                drive.cause_gone()

    def _advance(self, now: float) -> None:
        self._now = max(self._now, now)  # stamps of frames may lie before the last timer
        if self.powered:
            for drive in self.drives:
                drive.advance(self._now)
            if self._watch.expired(self._now):
                self._watch_expired()
        injected, self._injected = self._injected, []
        for action in injected:
            action()

    def _finish(self) -> None:
        self._report_faults()
        self.slave.poll(self._now)
        if self._report_faults():  # the life time may have run out in between
            self.slave.poll(self._now)

    def _report_faults(self) -> bool:
        return self._reporter.report(self._present_faults())
