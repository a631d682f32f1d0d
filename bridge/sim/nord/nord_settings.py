"""Factory settings of the bus interface (BU 2500 §6.4, §7.1)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, Literal

from bridge.sim.core.communication_settings import (
    RPDO_BASES,
    TPDO_BASES,
    CobId,
    CommunicationSettings,
    PdoSettings,
    SdoSettings,
    SlaveRules,
)
from bridge.sim.core.sdo_abort import AbortCode

DRIVES: Final = 4
ALL_SLOTS: Final = (1, 2, 3, 4)
PDO_WORDS: Final = 4

CONTROL_WORDS: Final = 0x3000
STATUS_WORDS: Final = 0x3001
SETPOINTS: Final = 0x3002
ACTUAL_VALUES: Final = 0x3003
DIGITAL_OUTPUTS: Final = 0x3004
DIGITAL_INPUTS: Final = 0x3005

Layout = Literal["three", "five"]
"""Setpoints and actual values per drive in 3002h and 3003h: P165 (§7.1.2) has three, §6.7.5 five."""

RULES: Final = SlaveRules(
    # §6.6.3 shows a write to 1800h:1 refused with 0601 0002h, and §8.3.2 has no 0800 0022h.
    wrong_state=AbortCode.READ_ONLY,
    # §6.5.8 changes the mapping first and disables the PDO afterwards.
    remap_needs_disabled=False,
    # §6.5.5 asks for Pre-Operational only.
    cob_id_change_needs_disabled=False,
    cob_id_fixed_bits=0x4000_0000,
    emcy_inhibit_unit_s=1e-3,  # §6.7.2 gives ms
)

_TPDO_BASES: Final = (*TPDO_BASES, 0x1C0)
_RPDO_BASES: Final = (*RPDO_BASES, 0x240)
_SDO_BASES: Final = ((0x600, 0x580), (0x340, 0x2C0), (0x440, 0x3C0), (0x540, 0x4C0))
_INHIBIT_100US: Final = 100
_EVENT_TIMER_MS: Final = 250


def place_of(slot: str | int) -> int:
    """Index of a slot given as "fu1" or 1."""
    number = int(slot.removeprefix("fu")) if isinstance(slot, str) else slot
    if number not in ALL_SLOTS:
        raise ValueError(f"no slot {slot!r}: fu1…fu4")
    return number - 1


def values_per_drive(layout: Layout) -> int:
    return 3 if layout == "three" else 5


def factory_communication(node_id: int, layout: Layout) -> CommunicationSettings:
    """All channels as delivered: PDO1…4 and SDO1 on, PDO5 and SDO2…4 off (§6.4)."""
    rpdo: list[PdoSettings] = []
    tpdo: list[PdoSettings] = []
    for number in range(DRIVES):
        rpdo.append(_pdo(_RPDO_BASES[number] + node_id, _words(CONTROL_WORDS, SETPOINTS, number, layout)))
        tpdo.append(_pdo(_TPDO_BASES[number] + node_id, _words(STATUS_WORDS, ACTUAL_VALUES, number, layout)))
    rpdo.append(_pdo(_RPDO_BASES[4] + node_id, [DIGITAL_OUTPUTS << 16 | 16], enabled=False))
    tpdo.append(_pdo(_TPDO_BASES[4] + node_id, [DIGITAL_INPUTS << 16 | 16], enabled=False))
    for settings in rpdo:
        settings.inhibit_100us = settings.event_timer_ms = 0
    return CommunicationSettings(
        emcy=CobId(0x80 + node_id),
        sdo=[
            SdoSettings.at(receive + node_id, send + node_id, enabled=first)
            for first, (receive, send) in zip((True, False, False, False), _SDO_BASES, strict=True)
        ],
        rpdo=rpdo,
        tpdo=tpdo,
    )


def _words(head: int, values: int, drive: int, layout: Layout) -> list[int]:
    """Mapping words of the control or status word and the first three values of a drive (from 0)."""
    first = drive * values_per_drive(layout) + 1
    words = [head << 16 | (drive + 1) << 8 | 16]
    return words + [values << 16 | sub << 8 | 16 for sub in range(first, first + 3)]


def _pdo(cob_id: int, words: list[int], *, enabled: bool = True) -> PdoSettings:
    return PdoSettings(
        cob_id,
        enabled=enabled,
        inhibit_100us=_INHIBIT_100US,
        event_timer_ms=_EVENT_TIMER_MS,
        entries=words + [0] * (PDO_WORDS - len(words)),
        count=len(words),
    )


@dataclass(slots=True)
class InterfaceSettings:
    """P150…P154, P168 and 6046h, which no parameter shows."""

    relays: int = 0
    p151_ms: int = 0
    system_bus_cycle_ms: list[int] = field(default_factory=lambda: [10, 5])
    io_access: list[int] = field(default_factory=lambda: [0, 0])
    profile: list[int] = field(default_factory=lambda: [0] + [1500, 2] * 8)
    velocity_min: list[int] = field(default_factory=lambda: [0] * DRIVES)
    velocity_max: list[int] = field(default_factory=lambda: [32767] * DRIVES)
