"""CANopen slave of CAN 5000 with its deviations from CiA 301 (ID 441684.06 §7 … §9)."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from typing import Final

from bridge.sim.core.canopen_slave import Application, CanopenSlave
from bridge.sim.core.communication_settings import CommunicationSettings, PdoSettings, SdoSettings
from bridge.sim.core.dictionary import Dictionary
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.nmt_slave import CommandSpecifier, SlaveState, nmt_command_for
from bridge.sim.core.pdo_timing import MappedRpdo, Tpdo, unpack
from bridge.sim.core.sdo_server import SimulatedSdoServer
from bridge.sim.core.store import Store
from bridge.sim.core.supervision import SignWatch
from bridge.sim.core.ticks import earliest
from bridge.sim.stoeber.stoeber_settings import ANSWERED

_FRESH: Final = (SlaveState.INITIALISING, SlaveState.STOPPED)


class StoeberTpdo(Tpdo):
    """Type 254 is sent as the answer to an RPDO or by the event timer, not when its data change (§8.1.2)."""

    def __init__(self) -> None:
        super().__init__()
        self._asked = False

    def start(self) -> None:
        super().start()
        self._asked = False

    def ask(self) -> None:
        self._asked = True

    def due(self, settings: PdoSettings, sample: Callable[[], bytes], now: float) -> bytes | None:
        return sample() if self._is_due(settings, now) else None

    def _is_due(self, settings: PdoSettings, now: float) -> bool:
        if settings.transmission_type != ANSWERED:
            return False
        if self._sent_at is None:
            return self._asked or settings.event_timer_ms > 0
        if now < self._inhibited_until(settings, self._sent_at):
            return False
        return self._asked or now >= self._event_at(settings, self._sent_at)

    def sent(self, payload: bytes, now: float) -> None:
        super().sent(payload, now)
        self._asked = False

    def next_deadline(self, settings: PdoSettings) -> float | None:
        if settings.transmission_type != ANSWERED or self._sent_at is None:
            return None
        free_at = self._inhibited_until(settings, self._sent_at)
        if self._asked:
            return free_at
        return max(free_at, self._event_at(settings, self._sent_at)) if settings.event_timer_ms else None


class StoeberSlave(CanopenSlave):
    """``views`` are the objects as each PDO channel sees them: channel n maps parameters of axis n.

    Changed SDO channels take effect after reset communication, or after Stopped and Pre-Operational (§7.3.1).
    So reset communication keeps what was written.
    """

    def __init__(
        self,
        node_id: int,
        store: Store[CommunicationSettings],
        views: Sequence[Dictionary],
        servers: Sequence[SimulatedSdoServer],
        emcy: EmcyProducer,
        application: Application,
        sync: SignWatch,
        sync_lost: Callable[[], None],
    ) -> None:
        """``sync``, from the first one on, is watched by 1006h (§6, red LED)."""
        super().__init__(node_id, store, views[0], servers, emcy, application)
        self._views = tuple(views)
        self._answers = tuple(StoeberTpdo() for _ in store.current.tpdo)
        self._tpdos = self._answers
        self._open_sdo: list[SdoSettings] = []
        self._sync = sync
        self._sync_lost = sync_lost

    def poll(self, now: float) -> None:
        if self.state is SlaveState.OPERATIONAL and self._sync.expired(now):
            self._sync_lost()
        super().poll(now)
        if self.state is SlaveState.STOPPED:  # §7.1: emergency messages are sent in Stopped too
            for data in self.emcy.due(now):
                self._send(self._store.current.emcy.cob_id, data)

    def next_deadline(self) -> float | None:
        deadlines = [super().next_deadline()]
        if self.state is SlaveState.STOPPED:
            deadlines.append(self.emcy.next_deadline())
        if self.state is SlaveState.OPERATIONAL:
            deadlines.append(self._sync.next_deadline())
        return earliest(*deadlines)

    def _on_nmt(self, data: bytes) -> None:
        if nmt_command_for(self.node_id, data) is CommandSpecifier.RESET_COMMUNICATION:
            self._application.restarted(CommandSpecifier.RESET_COMMUNICATION)
            self.boot()
            return
        super()._on_nmt(data)

    def _enter(self, state: SlaveState) -> None:
        if state is SlaveState.PRE_OPERATIONAL and self.state in _FRESH:
            self._open_sdo = copy.deepcopy(self._store.current.sdo)
        self._sync.stop()
        super()._enter(state)

    @property
    def _sdo_channels(self) -> list[SdoSettings]:
        return self._open_sdo

    def _accepts(self, rpdo: MappedRpdo, data: bytes) -> bool:
        return True

    def _objects_of(self, number: int) -> Dictionary:
        return self._views[number]

    def _on_sync(self, now: float) -> None:
        self._sync.start(now)
        if self._sync.next_deadline() is not None:
            self.dirty.is_set = True
        super()._on_sync(now)

    def _apply(self, rpdo: MappedRpdo, data: bytes) -> None:
        """§8.1.1: surplus bytes are ignored, an object that is not completely covered stays unchanged."""
        covered = [place for place in rpdo.places if place.end <= len(data)]
        self.rpdos_ignored += unpack(covered, data)
        self._application.rpdo_applied(rpdo.number)
        self.dirty.is_set = True
        if rpdo.settings.transmission_type == ANSWERED:
            self._answers[rpdo.number].ask()
