"""Modes of CiA 402 that a device has, as far as its description tells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from bridge.eds import Description
from bridge.eds.model import StaticDataType

CONTROL_WORD: Final = 0x6040
STATUS_WORD: Final = 0x6041
MODE: Final = 0x6060
MODE_DISPLAY: Final = 0x6061
_SUPPORTED: Final = 0x6502
PROFILE_402: Final = 402
_FREQUENCY_CONVERTER: Final = 1
_BITS: Final = {
    StaticDataType.INTEGER8: 8,
    StaticDataType.UNSIGNED8: 8,
    StaticDataType.INTEGER16: 16,
    StaticDataType.UNSIGNED16: 16,
    StaticDataType.INTEGER32: 32,
    StaticDataType.UNSIGNED32: 32,
}


@dataclass(frozen=True, slots=True)
class Mode:
    """``number`` is that of 6060h, ``setpoint`` and ``actual`` are the objects in its PDOs, of ``bits``."""

    name: str
    number: int
    setpoint: int | None
    actual: int
    bits: int = 32

    @property
    def mapping(self) -> str:
        """The mapping that a drive in this mode extends."""
        return f"cia402/{self.name}"

    @property
    def commanded(self) -> tuple[tuple[int, int], ...]:
        """Objects in the RPDO, with their lengths."""
        setpoint = () if self.setpoint is None else ((self.setpoint, self.bits),)
        return ((CONTROL_WORD, 16), *setpoint)

    @property
    def told(self) -> tuple[tuple[int, int], ...]:
        """Objects in the TPDO, the mode of operation aside, with their lengths."""
        return ((STATUS_WORD, 16), (self.actual, self.bits))


MODES: Final = (
    Mode("profile-velocity", 3, 0x60FF, 0x606C),
    Mode("velocity", 2, 0x6042, 0x6044, 16),
    Mode("profile-position", 1, 0x607A, 0x6064),
    Mode("cyclic-velocity", 9, 0x60FF, 0x606C),
    Mode("cyclic-position", 8, 0x607A, 0x6064),
    Mode("homing", 6, None, 0x6064),
)
"""Modes in order of preference, for a device that supports several."""


def modes_of(description: Description) -> list[Mode]:
    """The modes that a mapping of ours can drive the device in, the best first. A frequency converter is
    driven in velocity mode, if it has it."""
    supported = description.number(_SUPPORTED) or 0
    found = [
        mode
        for mode in MODES
        if all(bits_of(description, index) == bits for index, bits in (*mode.commanded, *mode.told))
        and (not supported or supported >> mode.number - 1 & 1)
    ]
    if (description.number(0x1000) or 0) >> 16 & 0xFF == _FREQUENCY_CONVERTER:
        found.sort(key=lambda mode: mode.name != "velocity")
    elif not supported:
        # Nobody says that it has the cyclic modes, and homing is not what a drive does all day.
        found.sort(key=lambda mode: mode.number in (6, 8, 9))
    return found


def bits_of(description: Description, index: int, sub: int = 0) -> int | None:
    """The length of an object; None where it is not there, or no integer of 8, 16 or 32 bits."""
    entry = description.entry(index, sub)
    return _BITS.get(entry.data_type) if entry and entry.data_type else None
