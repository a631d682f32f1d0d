"""Codes of an 8400 motec with its CANopen unit, and what the CAN stack makes of them
(EDS84DMOTCAN 3.0, §8.3, §12.2).

Only the codes are stored. NMT reset and C00002/26 initialise the CAN stack from them again.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from bridge.sim.core.communication_settings import (
    DISABLED,
    CobId,
    CommunicationSettings,
    PdoSettings,
    SdoSettings,
    SlaveRules,
)

CODE_BASE: Final = 0x5FFF
"""Index = 5FFFh − code (§9.2.2)."""
PDOS: Final = 2
PORT_WORDS: Final = 4
PORT_IN: Final = 0x5001
PORT_OUT: Final = 0x5002
"""CAN1_IN…CAN2_OUT inside the drive, sub-indices 1…8. No SDO reaches them, and neither do 1600h…1A01h:
the mapping is static (§13)."""

LENZE_BASE: Final = 0
CAN_BASE: Final = 1
OWN_COB_ID: Final = 2
"""C00353/1…2 as §12.2 numbers them."""

RULES: Final = SlaveRules(
    cob_id_change_needs_disabled=True,  # §13, I-1400: off, change, on
    emcy_inhibit_unit_s=1e-3,  # C00324/1
    error_entries=10,  # §13, I-1003
    sdo_block_segments=127,  # §4.2
)

_BASES: Final = {
    # RPDO1, TPDO1, RPDO2, TPDO2: the order of C00354 (§7.1.1).
    LENZE_BASE: (0x200, 0x180, 0x281, 0x280),
    CAN_BASE: (0x200, 0x180, 0x300, 0x280),
}
_SDO: Final = ((0x600, 0x580), (0x640, 0x5C0))


@dataclass(slots=True)
class LenzeCodes:
    """Everything that C00002/11 saves; lists are in the order of the sub-codes."""

    node_id: int
    """C00350."""
    bit_rate: int = 0
    """C00351; 0 is 500 kbit/s."""
    master: int = 0
    """C00352."""
    cob_source: list[int] = field(default_factory=lambda: [CAN_BASE] * PDOS)
    """C00353. §8.3 and §12.2 number the choices differently; both mean the CANopen base at factory."""
    cob_ids: list[int] = field(default_factory=list[int])
    """C00354 without bit 31: RPDO1, TPDO1, RPDO2, TPDO2."""
    pdo_off: list[int] = field(default_factory=lambda: [0] * 2 * PDOS)
    """C00389, and bit 31 of C00354."""
    tx_types: list[int] = field(default_factory=lambda: [254] * PDOS)
    """C00322."""
    rx_types: list[int] = field(default_factory=lambda: [254] * PDOS)
    """C00323."""
    inhibit_ms: list[int] = field(default_factory=lambda: [0] * (1 + PDOS))
    """C00324: EMCY, TPDO1, TPDO2."""
    times_ms: list[int] = field(default_factory=lambda: [3000, 0, 0, 0, 0])
    """C00356: boot-up to Operational of a master, TPDO2 cycle, reserved, first TPDO, TPDO1 cycle."""
    rpdo_time_ms: list[int] = field(default_factory=lambda: [3000] * PDOS)
    """C00357."""
    sdo_cob_ids: list[int] = field(default_factory=lambda: [DISABLED] * 2)
    """1201h:1 and :2."""
    sync_rx: int = 0x80
    """C00367."""
    sync_tx: int = 0x80
    """C00368."""
    sync_ms: int = 0
    """C00369."""
    sync_producer: bool = False
    """1005h, bit 30."""
    emcy_cob_id: int = 0
    """1014h."""
    heartbeat_ms: int = 0
    """C00381."""
    watched_node: int = 0
    """C00385/1."""
    watched_ms: int = 0
    """C00386/1."""
    mapping: list[int] = field(default_factory=lambda: [0] * PDOS * PORT_WORDS)
    """C00409."""
    bus_reactions: list[int] = field(default_factory=lambda: [0] * 5)
    """C00592."""
    rpdo_reactions: list[int] = field(default_factory=lambda: [0] * PDOS)
    """C00593."""
    mci_reactions: list[int] = field(default_factory=lambda: [1, 1])
    """C01501."""
    mci_time_ms: list[int] = field(default_factory=lambda: [200])
    """C01503."""
    control_mode: int = 40
    """C00007; 40 is Network (MCI/CAN), §8.2."""
    reference_rpm: int = 1500
    """C00011."""
    ramp_ms: list[int] = field(default_factory=lambda: [2000, 2000, 500])
    """C00012, C00013, C00105: acceleration, deceleration, quick stop; over C00011."""
    fixed_setpoints: list[int] = field(default_factory=lambda: [0, 0, 0])
    """C00039, in 0.01 %."""
    motor_current_ca: int = 170
    """C00088, in 0.01 A."""

    def __post_init__(self) -> None:
        if not self.cob_ids:
            self.cob_ids = [base + self.node_id for base in _BASES[CAN_BASE]]
        self.emcy_cob_id = self.emcy_cob_id or 0x80 + self.node_id

    def move_to(self, node_id: int) -> None:
        """C00350 has changed: identifiers that depend on it follow at the next reset (§8.3)."""
        if node_id != self.node_id:
            self.node_id = node_id
            self.cob_ids = [base + node_id for base in _BASES[CAN_BASE]]
            self.emcy_cob_id = self.emcy_cob_id & DISABLED | 0x80 + node_id

    def use_both_sdo_channels(self, both: bool) -> None:
        """C00366."""
        if not both:
            self.sdo_cob_ids = [cob_id | DISABLED for cob_id in self.sdo_cob_ids]
        elif any(cob_id & DISABLED for cob_id in self.sdo_cob_ids):
            self.sdo_cob_ids = [base + self.node_id for base in _SDO[1]]


def heartbeat_step(time_ms: int) -> int:
    """Heartbeat times are whole multiples of 5 ms, rounded down (§10.3.2)."""
    return time_ms - time_ms % 5


def communication(codes: LenzeCodes, words: tuple[int, int]) -> CommunicationSettings:
    """The CAN stack as the codes initialise it. ``words`` are those of PDO1 and PDO2, up to four."""
    rpdo: list[PdoSettings] = []
    tpdo: list[PdoSettings] = []
    for number in range(PDOS):
        receive, send = _cob_ids(codes, number)
        place = 2 * number
        rpdo.append(_pdo(PORT_IN, number, words, receive, codes.pdo_off[place], codes.rx_types[number]))
        one = _pdo(PORT_OUT, number, words, send, codes.pdo_off[place + 1], codes.tx_types[number])
        one.inhibit_100us = 10 * codes.inhibit_ms[1 + number]
        one.event_timer_ms = codes.times_ms[CYCLE_PLACES[number]]
        tpdo.append(one)
    first, second = _SDO[0]
    to_node, from_node = codes.sdo_cob_ids
    return CommunicationSettings(
        emcy=CobId.of(codes.emcy_cob_id),
        emcy_inhibit=codes.inhibit_ms[0],
        sdo=[
            SdoSettings.at(first + codes.node_id, second + codes.node_id),
            SdoSettings(CobId.of(to_node), CobId.of(from_node)),
        ],
        rpdo=rpdo,
        tpdo=tpdo,
        sync_cob_id=codes.sync_rx,
        heartbeat_ms=heartbeat_step(codes.heartbeat_ms),
    )


CYCLE_PLACES: Final = (4, 1)
"""Sub-codes of C00356 with the cycle times of TPDO1 and TPDO2."""


def _cob_ids(codes: LenzeCodes, number: int) -> tuple[int, int]:
    source, place = codes.cob_source[number], 2 * number
    if source == OWN_COB_ID:
        return codes.cob_ids[place], codes.cob_ids[place + 1]
    receive, send = _BASES[source][place : place + 2]
    return receive + codes.node_id, send + codes.node_id


def _pdo(port: int, number: int, words: tuple[int, int], cob_id: int, off: int, kind: int) -> PdoSettings:
    first = PORT_WORDS * number + 1
    entries = [port << 16 | sub << 8 | 16 for sub in range(first, first + words[number])]
    return PdoSettings(cob_id, enabled=not off, transmission_type=kind, entries=entries, count=len(entries))
