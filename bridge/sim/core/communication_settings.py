"""All settings made by communication objects: what ``save`` keeps and ``load`` restores."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from bridge.sim.core.sdo_abort import AbortCode

DISABLED: Final = 0x8000_0000
"""Bit 31 of a COB-ID object: this PDO or SDO does not exist."""
COB_ID_MASK: Final = 0x7FF
RPDO_BASES: Final = (0x200, 0x300, 0x400, 0x500)
TPDO_BASES: Final = (0x180, 0x280, 0x380, 0x480)
"""PDO1 … PDO4 of the pre-defined connection set (CiA 301 §7.3.3)."""


@dataclass(frozen=True, slots=True)
class SlaveRules:
    """Choices that CiA 301 leaves to devices, and deviations from it."""

    wrong_state: AbortCode = AbortCode.WRONG_STATE
    """Answer to a write that is allowed in Pre-Operational only."""
    remap_needs_disabled: bool = True
    """A mapping may be changed only while the PDO's bit 31 is set (CiA 301 §7.5.2.36)."""
    cob_id_change_needs_disabled: bool = True
    """An enabled PDO must be disabled before it gets another COB-ID (CiA 301 §7.5.2.35)."""
    cob_id_fixed_bits: int = 0
    """Bits of a PDO's COB-ID object that always read 1."""
    emcy_inhibit_unit_s: float = 1e-4
    """Unit of 1015h; CiA 301 has 100 µs."""
    error_entries: int = 8
    """Errors that 1003h remembers."""
    sdo_block_segments: int = 0
    """Segments in a block that the SDO servers accept; 0: no block transfer."""


@dataclass(slots=True)
class CobId:
    """A COB-ID that bit 31 of its object switches off."""

    cob_id: int
    enabled: bool = True

    @classmethod
    def of(cls, word: int) -> CobId:
        """COB-ID of its object's value."""
        return CobId(word & COB_ID_MASK, not word & DISABLED)

    @property
    def word(self) -> int:
        return self.cob_id | (0 if self.enabled else DISABLED)

    @word.setter
    def word(self, value: int) -> None:
        self.cob_id, self.enabled = value & COB_ID_MASK, not value & DISABLED


@dataclass(slots=True)
class PdoSettings(CobId):
    """One PDO, either direction. ``entries`` are mapping words ``IIIISSLLh``."""

    transmission_type: int = 255
    inhibit_100us: int = 0
    event_timer_ms: int = 0
    entries: list[int] = field(default_factory=list[int])
    count: int = 0

    @property
    def mapping(self) -> list[int]:
        return self.entries[: self.count]

    @property
    def mapped_bits(self) -> int:
        return sum(entry & 0xFF for entry in self.mapping)


@dataclass(slots=True)
class SdoSettings:
    """One SDO server channel, named as the device sees it: it receives requests and sends answers."""

    receive: CobId
    send: CobId

    @classmethod
    def at(cls, receive: int, send: int, *, enabled: bool = True) -> SdoSettings:
        return cls(CobId(receive, enabled), CobId(send, enabled))

    @property
    def enabled(self) -> bool:
        return self.receive.enabled and self.send.enabled


@dataclass(slots=True)
class CommunicationSettings:
    """Objects 1005h…1A1Fh of one node."""

    emcy: CobId
    sdo: list[SdoSettings]
    rpdo: list[PdoSettings] = field(default_factory=list[PdoSettings])
    tpdo: list[PdoSettings] = field(default_factory=list[PdoSettings])
    sync_cob_id: int = 0x80
    sync_on: bool = True
    emcy_inhibit: int = 0
    guard_time_ms: int = 0
    life_time_factor: int = 0
    heartbeat_ms: int = 0
