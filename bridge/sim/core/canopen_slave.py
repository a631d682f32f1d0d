"""A CANopen slave without its application: NMT, SDO, PDO, SYNC, EMCY and error control (CiA 301).

A device is built from one of these, an object dictionary and an ``Application``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Sequence
from typing import Final

from bridge.canopen.frame import ERROR, EXTENDED, REMOTE, STANDARD_MASK, Frame
from bridge.sim.core.communication_settings import CommunicationSettings, SdoSettings
from bridge.sim.core.dictionary import Dictionary
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.nmt_slave import (
    COMMANDED_STATE,
    CommandSpecifier,
    SlaveErrorControl,
    SlaveState,
    nmt_command_for,
)
from bridge.sim.core.pdo_timing import CYCLIC_MAX, MappedRpdo, Rpdo, Tpdo, unpack
from bridge.sim.core.sdo_server import SimulatedSdoServer
from bridge.sim.core.slave_plan import SlavePlan
from bridge.sim.core.store import Store
from bridge.sim.core.ticks import earliest

_ERROR_CONTROL: Final = 0x700
_OUTBOX_MAX: Final = 256
"""A real controller's queue is shorter; this bounds the memory if nobody fetches the frames."""


class Application(ABC):
    """Reactions of the device to its communication."""

    @abstractmethod
    def nmt_changed(self, state: SlaveState) -> None:
        """The NMT state has changed."""

    @abstractmethod
    def restarted(self, command: CommandSpecifier) -> None:
        """Reset node or reset communication, before the boot-up message; settings are as at power-on."""

    def accepts_rpdo(self, number: int, length: int, mapped_bits: int) -> bool:
        """Whether an RPDO (numbered from 0) of ``length`` bytes is evaluated at all. Too short ones do not
        get here; of a longer one the mapped bytes are used."""
        del number, length, mapped_bits
        return True

    def rpdo_applied(self, number: int) -> None:
        """The objects mapped in this RPDO have their new values."""
        del number

    @abstractmethod
    def master_lost(self) -> None:
        """The life time of node guarding has run out."""

    @abstractmethod
    def master_back(self) -> None:
        """The first guard request after that has come."""


class CanopenSlave:
    """Frames and time in, frames out. The owner calls ``poll`` after every change."""

    def __init__(
        self,
        node_id: int,
        store: Store[CommunicationSettings],
        dictionary: Dictionary,
        servers: Sequence[SimulatedSdoServer],
        emcy: EmcyProducer,
        application: Application,
    ) -> None:
        self.node_id = node_id
        self.emcy = emcy
        self.state = SlaveState.INITIALISING
        self.silent = False
        self.rpdos_ignored = 0
        self._store = store
        self._dictionary = dictionary
        self._servers = tuple(servers)
        self._application = application
        self._error_control = SlaveErrorControl(store)
        self._tpdos = tuple(Tpdo() for _ in store.current.tpdo)
        self._rpdos = tuple(Rpdo() for _ in store.current.rpdo)
        self._outbox: deque[Frame] = deque()
        self.dirty = emcy.dirty
        self._present_plan: SlavePlan | None = None

    @property
    def _plan(self) -> SlavePlan:
        """Plan of the slave by its present settings."""
        if self._present_plan is None:
            own = (0, _ERROR_CONTROL + self.node_id)
            parts = (self._servers, self._sdo_channels, self._tpdos, self._objects_of)
            self._present_plan = SlavePlan(self._store.current, own, *parts)
        return self._present_plan

    def touch(self) -> None:
        """Settings may have been changed, or anything else."""
        self._present_plan = None
        self.dirty.is_set = True

    @property
    def dictionary(self) -> Dictionary:
        """Objects that its PDOs can map."""
        return self._dictionary

    @property
    def master_is_lost(self) -> bool:
        return self._error_control.life.tripped

    def boot(self) -> None:
        """Initialisation done: boot-up message, then Pre-Operational."""
        for server in self._servers:
            server.reset()
        for rpdo in self._rpdos:
            rpdo.reset()
        self.emcy.reset()
        self._error_control.boot()
        self.state = SlaveState.INITIALISING
        self._send(_ERROR_CONTROL + self.node_id, b"\0")
        self._enter(SlaveState.PRE_OPERATIONAL)
        self.touch()

    def power_off(self) -> None:
        self.state = SlaveState.INITIALISING
        self.touch()
        self._outbox.clear()

    def on_frame(self, frame: Frame, now: float) -> None:
        """Take one frame from the bus; frames for other nodes are ignored."""
        if self.state is SlaveState.INITIALISING or frame.can_id & (EXTENDED | ERROR):
            return
        cob_id = frame.can_id & STANDARD_MASK
        if frame.can_id & REMOTE:
            # A PDO is not sent on request: bit 30 of its COB-ID reads 1 (BU 2500 §6.5.5).
            if cob_id == _ERROR_CONTROL + self.node_id:
                self._on_guard_request(now)
        elif cob_id == 0:
            self._on_nmt(frame.data)
            self.touch()
        elif self.state is not SlaveState.STOPPED:
            self._on_object(cob_id, frame.data, now)

    def poll(self, now: float) -> None:
        """Do what is due: life guarding, heartbeat, EMCY, event-driven TPDOs."""
        if self.state is SlaveState.INITIALISING:
            return
        if self._error_control.life.expired(now):
            self._application.master_lost()
            # CiA 301 §7.5.2.32: a heartbeat or guarding event leads from Operational to Pre-Operational.
            if self.state is SlaveState.OPERATIONAL:
                self._enter(SlaveState.PRE_OPERATIONAL)
        if self._error_control.heartbeat_due(now):
            self._send(_ERROR_CONTROL + self.node_id, bytes([self.state]))
        if self.state is not SlaveState.STOPPED:
            for data in self.emcy.due(now):
                self._send(self._store.current.emcy.cob_id, data)
        if self.state is SlaveState.OPERATIONAL:
            self._send_due_tpdos(now)

    def next_deadline(self) -> float | None:
        """Time at which ``poll`` has to be called next if nothing else happens."""
        if self.state is SlaveState.INITIALISING:
            return None
        deadlines = [self._error_control.next_deadline()]
        if self.state is not SlaveState.STOPPED:
            deadlines.append(self.emcy.next_deadline())
        if self.state is SlaveState.OPERATIONAL:
            deadlines += [active.tpdo.next_deadline(active.settings) for active in self._plan.tpdos]
        return earliest(*deadlines)

    def hears(self) -> frozenset[int]:
        """The identifiers that concern this node with its present settings."""
        return self._plan.hears

    def take_frames(self) -> list[Frame]:
        frames = list(self._outbox)
        self._outbox.clear()
        return frames

    def _on_guard_request(self, now: float) -> None:
        self.dirty.is_set = True
        was_lost = self._error_control.life.tripped
        answer = self._error_control.on_guard_request(self.state, now)
        if answer is None:
            return
        self._send(_ERROR_CONTROL + self.node_id, answer)
        if was_lost:
            self._application.master_back()

    def _on_nmt(self, data: bytes) -> None:
        command = nmt_command_for(self.node_id, data)
        if command is None:
            return
        state = COMMANDED_STATE.get(command)
        if state is not None:
            self._enter(state)
            return
        self._store.power_on()
        self._application.restarted(command)
        self.boot()

    @property
    def _sdo_channels(self) -> list[SdoSettings]:
        """SDO channels that are in effect."""
        return self._store.current.sdo

    def _objects_of(self, number: int) -> Dictionary:
        """Objects that PDO ``number`` (from 0), either direction, can map."""
        del number
        return self._dictionary

    def _on_object(self, cob_id: int, data: bytes, now: float) -> None:
        plan, settings = self._plan, self._store.current
        if cob_id in plan.channels:
            server, channel = plan.channels[cob_id]
            only_reads = server.only_reads(data)
            for answer in server.on_request(data):
                self._send(channel.send.cob_id, answer)
            if not only_reads:
                self.touch()
            return
        if self.state is not SlaveState.OPERATIONAL:
            return
        if settings.sync_on and cob_id == settings.sync_cob_id:
            self._on_sync(now)
            return
        for rpdo in plan.rpdos_by_cob_id.get(cob_id, ()):
            self._on_rpdo(rpdo, data)

    def _on_rpdo(self, rpdo: MappedRpdo, data: bytes) -> None:
        if not rpdo.settings.count or not self._accepts(rpdo, data):
            self.rpdos_ignored += 1
            return
        effective = self._rpdos[rpdo.number].on_data(rpdo.settings, data)
        if effective is not None:
            self._apply(rpdo, effective)

    def _accepts(self, rpdo: MappedRpdo, data: bytes) -> bool:
        size, bits = len(data), rpdo.mapped_bits
        return size * 8 >= bits and self._application.accepts_rpdo(rpdo.number, size, bits)

    def _on_sync(self, now: float) -> None:
        # TPDOs are sampled before RPDOs act, because both refer to the moment of the SYNC (CiA 301 §7.2.2.2).
        for active in self._plan.tpdos:
            settings = active.settings
            if settings.transmission_type > CYCLIC_MAX:
                continue
            payload = active.payload()
            if active.tpdo.on_sync(settings, payload):
                self._send(settings.cob_id, payload)
                active.tpdo.sent(payload, now)
        for number, rpdo in enumerate(self._rpdos):
            data = rpdo.on_sync()
            if data is not None:
                self._apply(self._plan.rpdos[number], data)

    def _apply(self, rpdo: MappedRpdo, data: bytes) -> None:
        self.rpdos_ignored += unpack(rpdo.places, data)
        self._application.rpdo_applied(rpdo.number)

    def _enter(self, state: SlaveState) -> None:
        if state is self.state:
            return
        self.state = state
        for rpdo in self._rpdos:
            rpdo.reset()
        for tpdo in self._tpdos:
            tpdo.start()
        self._application.nmt_changed(state)

    def _send_due_tpdos(self, now: float) -> None:
        for active in self._plan.tpdos:
            payload = active.tpdo.due(active.settings, active.payload, now)
            if payload is not None:
                self._send(active.settings.cob_id, payload)
                active.tpdo.sent(payload, now)

    def _send(self, cob_id: int, data: bytes) -> None:
        if self.silent:
            return
        if len(self._outbox) >= _OUTBOX_MAX:
            self._outbox.popleft()
        self._outbox.append(Frame(cob_id, data))
