"""Parameters of the simulated CiA 402 drive and its PDOs as delivered (CiA 402, CiA 301)."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Final

from bridge.sim.core.communication_settings import (
    RPDO_BASES,
    TPDO_BASES,
    CobId,
    CommunicationSettings,
    PdoSettings,
    SdoSettings,
    SlaveRules,
)

RULES: Final = SlaveRules(sdo_block_segments=127)
MAP_ENTRIES: Final = 8
INCREMENTS: Final = 10_000
"""608Fh: of the encoder for one revolution."""


class Cia402Mode(IntEnum):
    """6060h and 6061h."""

    NONE = 0
    PROFILE_POSITION = 1
    VELOCITY = 2
    PROFILE_VELOCITY = 3
    HOMING = 6
    CYCLIC_POSITION = 8
    CYCLIC_VELOCITY = 9


SUPPORTED_MODES: Final = sum(1 << mode - 1 for mode in Cia402Mode if mode)
"""6502h."""


@dataclass(slots=True)
class Cia402Settings:
    """The profile's parameters that 1010h saves. Positions are in increments, speeds in increments per
    second, ramps in increments per second squared; those of the vl mode are in 1/min and s."""

    abort_connection: int = 1
    """6007h."""
    options: dict[int, int] = field(
        default_factory=lambda: {0x605A: 2, 0x605B: 0, 0x605C: 1, 0x605D: 1, 0x605E: 2}
    )
    mode: int = Cia402Mode.NONE
    vl_dimension: list[int] = field(default_factory=lambda: [1, 1])
    """604Ch: numerator and denominator, by which the numbers of the vl mode become 1/min."""
    vl_limits: list[int] = field(default_factory=lambda: [0, 3000])
    """6046h: least and greatest speed."""
    vl_acceleration: list[int] = field(default_factory=lambda: [3000, 2])
    """6048h: speed and time."""
    vl_deceleration: list[int] = field(default_factory=lambda: [3000, 2])
    vl_quick_stop: list[int] = field(default_factory=lambda: [3000, 1])
    following_window: int = 20_000
    following_ms: int = 10
    position_window: int = 100
    position_window_ms: int = 0
    velocity_window: int = 1000
    velocity_threshold: int = 100
    position_limits: list[int] = field(default_factory=lambda: [0, 0])
    """607Dh; none where both are 0."""
    max_profile_velocity: int = 1_000_000
    max_motor_rpm: int = 3000
    """6080h."""
    profile_velocity: int = 100_000
    acceleration: int = 500_000
    deceleration: int = 500_000
    quick_stop_deceleration: int = 2_000_000
    home_offset: int = 0
    homing_method: int = 35
    homing_speeds: list[int] = field(default_factory=lambda: [50_000, 10_000])
    homing_acceleration: int = 500_000
    interpolation: list[int] = field(default_factory=lambda: [1, -3])
    """60C2h: 60C2:01 × 10^60C2:02 s."""
    heartbeat_consumer: int = 0
    """1016h:1: node id in bits 16 … 22, time in ms in the low word."""

    @property
    def vl_factor(self) -> float:
        """604Ch; a factor that is none counts as 1."""
        numerator, denominator = self.vl_dimension
        return numerator / denominator if numerator and denominator else 1.0

    @property
    def max_speed(self) -> float:
        """6080h in increments per second."""
        return self.max_motor_rpm * INCREMENTS / 60


_FIRST: Final = (0x180 >> 7, 0x200 >> 7)
# PDO1 … PDO4 as CiA 402 has them at delivery: control and status word alone, with the mode, for pp, for pv.
_RPDO_ENTRIES: Final = (
    (0x60400010,),
    (0x60400010, 0x60600008),
    (0x60400010, 0x607A0020),
    (0x60400010, 0x60FF0020),
)
_TPDO_ENTRIES: Final = (
    (0x60410010,),
    (0x60410010, 0x60610008),
    (0x60410010, 0x60640020),
    (0x60410010, 0x606C0020),
)


def factory_communication(node_id: int) -> CommunicationSettings:
    """PDO1 is on, the others are there and off."""
    return CommunicationSettings(
        emcy=CobId(0x80 + node_id),
        sdo=[SdoSettings.at(0x600 + node_id, 0x580 + node_id)],
        rpdo=[_pdo(base + node_id, entries) for base, entries in zip(RPDO_BASES, _RPDO_ENTRIES, strict=True)],
        tpdo=[_pdo(base + node_id, entries) for base, entries in zip(TPDO_BASES, _TPDO_ENTRIES, strict=True)],
    )


def _pdo(cob_id: int, entries: tuple[int, ...]) -> PdoSettings:
    padded = [*entries, *[0] * (MAP_ENTRIES - len(entries))]
    return PdoSettings(cob_id, enabled=cob_id >> 7 in _FIRST, entries=padded, count=len(entries))
