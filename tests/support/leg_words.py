"""The words of the drive families as their manuals have them: what the exploration's oracle goes by.

Nothing here comes from ``mappings/`` or from the code that reads it. ``tests/unit/command/test_leg_words.py``
compares the two, so that a mistake in either shows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from bridge.image import Value


@dataclass(frozen=True, slots=True)
class Bits:
    """Bits of a word with the values that they have to have."""

    mask: int
    value: int

    def fit(self, word: int) -> bool:
        return word & self.mask == self.value


@dataclass(frozen=True, slots=True)
class LegWords:
    """One family. ``stop``, ``quick_stop`` and ``disable_voltage`` are how the three stops look; ``valid``
    has the bits without which a drive takes no word, ``begin`` what a start raises once the drive is enabled,
    ``handshake`` the bit that hands over a position, and ``taken`` the drive's answer to it.

    ``place``: where setpoints follow the drive's position, another one: as setpoints, and as the words after
    its status word.

    ``setpoint`` is something to be moved to, ``more`` another one, ``too_large`` a telegram that is out of
    range.
    """

    mapping: str
    shut_down: int
    enable: int
    acknowledge: int
    enabling: Bits
    stop: Bits
    quick_stop: Bits
    disable_voltage: Bits
    ready: int
    enabled: int
    fault: int
    in_fault: Bits
    too_large: Mapping[str, Value]
    setpoint: Mapping[str, Value] = field(default_factory=dict[str, Value])
    more: Mapping[str, Value] = field(default_factory=dict[str, Value])
    valid: int = 0
    begin: int = 0
    handshake: int = 0
    taken: int = 0
    place: tuple[int, ...] = ()

    def stops(self, kind: str) -> tuple[Bits, ...]:
        """Words of a stop of this kind: none that is in force already is lifted for a weaker one."""
        return tuple(getattr(self, name) for name in STRENGTH[STRENGTH.index(kind) :])


STRENGTH: Final = ("stop", "quick_stop", "disable_voltage")
"""The stops, the weakest first."""

HALF_SPEED: Final = 0x2000

# BU 2500 §6.5.1 (control word), §6.5.2 and §6.5.3 (status word), §6.8 (an example of both).
NORD_TU4: Final = LegWords(
    "nord/sk-tu4-cao",
    shut_down=0x047E,
    enable=0x047F,
    acknowledge=0x0080,
    valid=0x0400,
    enabling=Bits(0x000F, 0x000F),
    stop=Bits(0x0007, 0x0006),  # XXXXX110
    quick_stop=Bits(0x0006, 0x0002),  # XXXXX01X
    disable_voltage=Bits(0x0002, 0x0000),  # XXXXXX0X
    ready=0x0B31,
    enabled=0x0B37,
    fault=0x0B08,
    in_fault=Bits(0x004F, 0x0008),  # 0XX1000
    setpoint={"setpoint_1": HALF_SPEED},
    too_large={"control_word": 0x047F, "frequency": 1e9},
)

# The same words (§6.5 is both's), one value with them (§6.5.7).
NORD_TU3: Final = replace(NORD_TU4, mapping="nord/sk-tu3-cao-pdo1")

# EDS84DMOTCAN prints neither word. Control word: the 8400's device control, with 1 in bit 0 "switch on",
# bit 1 "disable voltage", bit 2 "quick stop", bit 3 "enable operation", bit 7 "reset fault"; it ramps down by
# its quick stop alone. Status word: wDeviceStateWord of the software manual, bits 8 … 11 are the device
# state: 3 ready to switch on, 5 operation enabled, 8 fault.
LENZE: Final = LegWords(
    "lenze/8400-motec",
    shut_down=0x0001,
    enable=0x0009,
    acknowledge=0x0080,
    enabling=Bits(0x000F, 0x0009),
    stop=Bits(0x0004, 0x0004),
    quick_stop=Bits(0x0004, 0x0004),
    disable_voltage=Bits(0x0002, 0x0002),
    ready=0x0300,
    enabled=0x0500,
    fault=0x0800,
    in_fault=Bits(0x0F00, 0x0800),
    setpoint={"setpoint_1": HALF_SPEED},
    too_large={"control_word": 0x0009, "setpoint_1": 0x1_0000},
)

# The bits of A180 are those of POSITool: 0 enable, 1 acknowledge, 2 quick stop. CAN 5000 §11.1 (1002h): the
# low byte of the status word is E48, 2 ready to switch on, 4 operation enabled, 5 fault; the high one E200.
STOEBER: Final = LegWords(
    "stoeber/5000",
    shut_down=0x0000,
    enable=0x0001,
    acknowledge=0x0002,
    enabling=Bits(0x0005, 0x0001),
    stop=Bits(0x0004, 0x0004),
    quick_stop=Bits(0x0004, 0x0004),
    disable_voltage=Bits(0x0001, 0x0000),
    ready=0x0002,
    enabled=0x0104,
    fault=0x0205,
    in_fault=Bits(0x00FF, 0x0005),
    setpoint={"setpoint_1": 500},
    too_large={"control_word": 0x0001, "velocity": 1e9},
)


def _cia402(mapping: str, enable: int, **more: object) -> LegWords:
    """CiA 402, 6040h and 6041h. A stop is "disable operation" (0111b), which 605Ch makes a
    ramp at factory."""
    return LegWords(
        mapping,
        shut_down=0x0006,
        enable=enable,
        acknowledge=0x0080,
        enabling=Bits(0x000F, 0x000F),
        stop=Bits(0x0008, 0x0000),
        quick_stop=Bits(0x0006, 0x0002),
        disable_voltage=Bits(0x0002, 0x0000),
        ready=0x0231,
        enabled=0x0237,
        fault=0x0218,
        in_fault=Bits(0x004F, 0x0008),
        **more,  # pyright: ignore[reportArgumentType]
    )


# The velocity mode's bits 4 … 6 let the ramp generator run.
VELOCITY: Final = _cia402(
    "cia402/velocity",
    0x007F,
    setpoint={"setpoint_1": 500},
    too_large={"control_word": 0x007F, "velocity": 1e9},
)
# Homing: bit 4 begins it.
HOMING: Final = _cia402("cia402/homing", 0x000F, begin=0x0010, too_large={"control_word": 0x1_0000})
# Profile position: bit 4 "new set-point", status bit 12 "set-point acknowledge"; bit 5 changes at once.
POSITION: Final = _cia402(
    "cia402/profile-position",
    0x002F,
    handshake=0x0010,
    taken=0x1000,
    setpoint={"position": 70_000},
    more={"position": -70_000},
    too_large={"control_word": 0x002F, "position": 1e12},
)

ALL: Final = (NORD_TU4, NORD_TU3, LENZE, STOEBER, VELOCITY, HOMING, POSITION)
