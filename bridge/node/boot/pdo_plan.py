"""One PDO of a node, as the boot-up has found it."""

from __future__ import annotations

from dataclasses import dataclass

from bridge.canopen.pdo import PdoCodec
from bridge.node.places.word_map import WordPlace


@dataclass(frozen=True, slots=True)
class PdoPlan:
    """One PDO as the node has it. ``places`` has the place of each entry among the words of ``process.rpdo``
    or ``process.tpdo``, None if unknown."""

    cob_id: int
    transmission_type: int
    event_timer_ms: int
    codec: PdoCodec
    places: tuple[WordPlace | None, ...]
    remote_allowed: bool = True
    """True if a TPDO may be requested by remote frame: bit 30 of its COB-ID is 0."""
    name: str = ""
    """Name of the PDO, such as RPDO1."""

    @property
    def words(self) -> frozenset[int]:
        """Indices of the words that it carries, in whole or in part."""
        return frozenset(
            place.word + part for place in self.places if place is not None for part in range(place.span)
        )
