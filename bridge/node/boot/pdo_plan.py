"""One PDO of a node, as the boot-up has found it."""

from __future__ import annotations

from dataclasses import dataclass

from bridge.canopen.pdo import PdoCodec
from bridge.node.places.word_map import WordPlace


@dataclass(frozen=True, slots=True)
class PdoPlan:
    """One PDO as the node has it. ``places`` says for each entry where it stands among the words of
    ``process.rpdo`` or ``process.tpdo``, or None for what we do not know."""

    cob_id: int
    transmission_type: int
    event_timer_ms: int
    codec: PdoCodec
    places: tuple[WordPlace | None, ...]
    remote_allowed: bool = True
    """Bit 30 of a TPDO's COB-ID is 0: it may be asked for by remote frame."""
    name: str = ""
    """Such as RPDO1."""

    @property
    def words(self) -> frozenset[int]:
        """Places of the words that it carries, whole or in part."""
        return frozenset(
            place.word + part for place in self.places if place is not None for part in range(place.span)
        )
