"""Plan of a slave by its settings: the identifiers that it hears, and the objects in its PDOs.

Settings change by SDO and NMT only, so this is made when one of these has come, and not for every frame.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

from bridge.sim.core.communication_settings import CommunicationSettings, SdoSettings
from bridge.sim.core.dictionary import Dictionary
from bridge.sim.core.pdo_timing import ActiveTpdo, MappedRpdo, Tpdo, entries_of, places_of
from bridge.sim.core.sdo_server import SimulatedSdoServer

Channel = tuple[SimulatedSdoServer, SdoSettings]


class SlavePlan:
    """``own`` are identifiers that the node hears whatever its settings are; ``objects_of`` gives what a PDO,
    by its number from 0, can map. Each part is made when it is first asked for."""

    def __init__(
        self,
        settings: CommunicationSettings,
        own: Sequence[int],
        servers: Sequence[SimulatedSdoServer],
        channels: Sequence[SdoSettings],
        tpdos: Sequence[Tpdo],
        objects_of: Callable[[int], Dictionary],
    ) -> None:
        self._settings = settings
        self._own = own
        self._servers = servers
        self._channels = channels
        self._tpdos = tpdos
        self._objects_of = objects_of

    @cached_property
    def hears(self) -> frozenset[int]:
        """The identifiers that concern the node."""
        sdo = (channel.receive.cob_id for channel in self._channels)
        rpdos = (pdo.cob_id for pdo in self._settings.rpdo)
        return frozenset((*self._own, self._settings.sync_cob_id, *sdo, *rpdos))

    @cached_property
    def channels(self) -> dict[int, Channel]:
        """The SDO channels that are on, by the identifier of their requests."""
        found: dict[int, Channel] = {}
        for server, channel in zip(self._servers, self._channels, strict=True):
            if channel.enabled:
                found.setdefault(channel.receive.cob_id, (server, channel))
        return found

    @cached_property
    def rpdos(self) -> tuple[MappedRpdo, ...]:
        return tuple(
            MappedRpdo(number, pdo, pdo.mapped_bits, places_of(self._objects_of(number), pdo))
            for number, pdo in enumerate(self._settings.rpdo)
        )

    @cached_property
    def rpdos_by_cob_id(self) -> dict[int, list[MappedRpdo]]:
        """Enabled RPDOs by COB-ID."""
        found: dict[int, list[MappedRpdo]] = {}
        for rpdo in self.rpdos:
            if rpdo.settings.enabled:
                found.setdefault(rpdo.settings.cob_id, []).append(rpdo)
        return found

    @cached_property
    def tpdos(self) -> tuple[ActiveTpdo, ...]:
        """Enabled TPDOs with at least one mapped object."""
        return tuple(
            ActiveTpdo(tpdo, pdo, entries_of(self._objects_of(number), pdo))
            for number, (tpdo, pdo) in enumerate(zip(self._tpdos, self._settings.tpdo, strict=True))
            if pdo.enabled and pdo.count
        )
