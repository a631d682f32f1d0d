"""A drive with the profile CiA 402 (IEC 61800-7-201): one node, one axis, six modes of operation."""

from __future__ import annotations

from typing import Final

from bridge.canopen.frame import Frame
from bridge.sim.cia402.cia402_axis import Cia402Axis
from bridge.sim.cia402.cia402_objects import Cia402Objects
from bridge.sim.cia402.cia402_settings import RULES, Cia402Settings, factory_communication
from bridge.sim.cia402.cia402_states import Cia402State
from bridge.sim.core.canopen_slave import CanopenSlave
from bridge.sim.core.dictionary import Dictionary
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.nmt_slave import CommandSpecifier, SlaveState
from bridge.sim.core.pdo_objects import PdoConfigurator
from bridge.sim.core.sdo_server import SimulatedSdoServer
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.core.store import Store
from bridge.sim.core.supervision import HeartbeatWatch

_HEARTBEAT: Final = 0x700
_MASTER_LOST: Final = 0x8130
_REGISTERS: Final = {0x2: 0x03, 0x3: 0x05, 0x4: 0x09, 0x8: 0x21}
"""1001h by the first digit of the error code; bit 4, communication, for 81xxh and 82xxh."""


class Cia402Drive(SimulatedDevice):
    """``fail`` and its like happen at the next ``on_time`` or ``on_frame``."""

    def __init__(self, node_id: int, settings: Cia402Settings | None = None) -> None:
        super().__init__(node_id)
        self._settings = Store(Cia402Settings)
        if settings is not None:
            self._settings.current = settings
        self.save_settings()  # commissioned before it was connected to this bus
        self._communication = Store(lambda: factory_communication(node_id))
        self._emcy = EmcyProducer(self._communication, RULES)
        self.axis = Cia402Axis(lambda: self._settings.current, self._report)
        self._consumer = HeartbeatWatch(
            lambda: self._settings.current.heartbeat_consumer >> 16,
            lambda: self._settings.current.heartbeat_consumer & 0xFFFF,
        )
        self.objects = Dictionary()
        pdos = PdoConfigurator(
            self.objects, self._communication, RULES, lambda: self.slave.state is SlaveState.PRE_OPERATIONAL
        )
        objects = Cia402Objects(self.axis, self._settings, self._communication)
        objects.add_to(self.objects, self._emcy, pdos)
        servers = [SimulatedSdoServer(self.objects, RULES.sdo_block_segments)]
        self.slave = CanopenSlave(node_id, self._communication, self.objects, servers, self._emcy, self)
        self.heard = self._hears()

    @property
    def settings(self) -> Cia402Settings:
        """The profile's parameters as they are now."""
        return self._settings.current

    def save_settings(self) -> None:
        """Save the parameters, as at commissioning."""
        self._settings.save()

    # What a test or a demonstration does to the node.

    def fail(self, code: int, *, lasting: bool = False) -> None:
        """An error with this code, such as 4310h. A ``lasting`` cause blocks the reset until ``mend``."""
        if not 0 < code <= 0xFFFF:
            raise ValueError(f"error code {code:X}h: 0001h … FFFFh")
        self._injected.append(lambda: self.axis.fail(code, lasting=lasting))

    def mend(self) -> None:
        """Remove the cause."""
        self._injected.append(self.axis.automaton.cause_gone)

    # The application of the CANopen slave.

    def nmt_changed(self, state: SlaveState) -> None:
        # 6007h is for "NMT stopped state entered" too.
        if state is SlaveState.STOPPED and self.axis.state is Cia402State.ENABLED:
            self.axis.abort_connection(_MASTER_LOST)

    def restarted(self, command: CommandSpecifier) -> None:
        if command is CommandSpecifier.RESET_NODE:
            self._restart()
            return
        self._consumer.stop()
        if self.axis.state is Cia402State.ENABLED:
            self.axis.abort_connection(_MASTER_LOST)

    def rpdo_applied(self, number: int) -> None:
        del number
        self.slave.dirty.is_set = True
        self.axis.obey()

    def master_lost(self) -> None:
        """1016h or life guarding: the node goes to Pre-Operational (CiA 301), the drive follows 6007h (CiA
        402)."""
        if not self.axis.abort_connection(_MASTER_LOST):
            self._emcy.report(_MASTER_LOST, _register(_MASTER_LOST))
        if self.slave.state is SlaveState.OPERATIONAL:
            command = bytes([CommandSpecifier.ENTER_PRE_OPERATIONAL, self.node_id])
            self.slave.on_frame(Frame(0, command), self._now)

    def master_back(self) -> None:
        """If it was no fault, there is nothing to reset: the error is gone."""
        if self.axis.state not in (Cia402State.FAULT, Cia402State.FAULT_REACTION):
            self._emcy.report(0, 0)

    # How it works inside.

    def _switch_on(self) -> None:
        self._communication.power_on()
        self._restart()

    def _pass_time(self) -> None:
        if self.axis.advance(self._now):
            self.slave.dirty.is_set = True
        if self._consumer.expired(self._now):
            self.master_lost()

    def _receive(self, frame: Frame) -> None:
        is_heartbeat = self._consumer.node and frame.can_id == _HEARTBEAT + self._consumer.node
        if not is_heartbeat:
            self.slave.on_frame(frame, self._now)
            self.axis.obey()  # a control word that came by SDO
        elif self._consumer.on_heartbeat(frame.data, self._now):
            self.master_back()

    def _deadlines(self) -> tuple[float | None, ...]:
        return self.axis.next_deadline(), self._consumer.next_deadline()

    def _hears(self) -> frozenset[int]:
        watched = {_HEARTBEAT + self._consumer.node} if self._consumer.node else set[int]()
        return self.slave.hears() | watched

    def _restart(self) -> None:
        self._settings.power_on()
        self._emcy.error_register = 0
        self._consumer.stop()
        self.axis.power_on(self._now)

    def _report(self, code: int) -> None:
        """EMCY for a fault of the drive, or for its reset."""
        self._emcy.report(code, _register(code) if code else 0)


def _register(code: int) -> int:
    """1001h for an error code."""
    if code >> 8 in (0x81, 0x82):
        return 0x11
    return _REGISTERS.get(code >> 12, 0x01)
