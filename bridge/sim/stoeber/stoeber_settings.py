"""Factory settings of a STÖBER inverter with CAN 5000 (ID 441684.06 §7.2, §8.1.3, §11.1)."""

from __future__ import annotations

from dataclasses import dataclass, field
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
from bridge.sim.stoeber.stoeber_axis import AxisParameters

CHANNELS: Final = 4
MAP_ENTRIES: Final = 6
ANSWERED: Final = 254
"""Transmission type: an RPDO takes effect at once and is answered by a TPDO (§8.1.2)."""

RULES: Final = SlaveRules(
    remap_needs_disabled=False,  # §7.3.1 and §8.1.1 ask for Pre-Operational only
    cob_id_change_needs_disabled=False,
)

SDO_BASES: Final = ((0x600, 0x580), (0x620, 0x5A0), (0x640, 0x5C0), (0x660, 0x5E0))


def coordinate(name: str) -> int:
    """Index of a parameter by its coordinate: C01 is 2401h (§11.2)."""
    return 0x2000 + 0x200 * (ord(name[0]) - ord("A")) + int(name[1:])


def _words(*names: tuple[str, int]) -> list[int]:
    return [coordinate(name) << 16 | bits for name, bits in names]


RECEIVED: Final = _words(("A180", 8), ("D230", 16))
SENT: Final = _words(("E48", 8), ("E200", 8), ("E08", 16), ("E00", 16))
"""The application's words that mappings/stoeber/5000.toml assumes; the manual names none."""
AXIS_RECEIVED: Final = _words(("Q00", 8), ("Q01", 16))
AXIS_SENT: Final = _words(("Q02", 8), ("Q03", 8), ("Q04", 16), ("Q05", 16))
"""The same for an application with a channel to each axis, mappings/stoeber/5000-four-axes.toml."""
POSI_RECEIVED: Final = _words(("A180", 8), ("I210", 8), ("I213", 32), ("I216", 16))
POSI_RAMPS: Final = _words(("I217", 16), ("I218", 16))
POSI_SENT: Final = _words(("E48", 8), ("I200", 8), ("I80", 32), ("I88", 16))
"""The same for command positioning, mappings/stoeber/5000-posi.toml; the ramps are in RPDO2."""


@dataclass(slots=True)
class StoeberPdo(PdoSettings):
    """A PDO whose mapping may have empty places, which read 0 (§11.1: "0 (inactive)")."""

    @property
    def mapping(self) -> list[int]:
        return [entry for entry in self.entries if entry]


@dataclass(slots=True)
class StoeberSettings:
    """Settings that "save values" keeps in addition to the communication objects."""

    axes: list[AxisParameters]
    edited_axis: list[int]
    """A11.0…4: the axis (from 0) that the display and SDO1…4 work on."""
    sync_timeout_us: int = 0
    configuration_date: int = 0
    configuration_time: int = 0
    sdo_client: list[int] = field(default_factory=lambda: [0] * CHANNELS)


def factory_settings(axes: int) -> StoeberSettings:
    edited = [0, *(min(channel, axes - 1) for channel in range(CHANNELS))]
    return StoeberSettings([AxisParameters() for _ in range(axes)], edited)


def factory_communication(
    node_id: int, axes: int, *, mapped: bool, positions: bool = False
) -> CommunicationSettings:
    """Settings as delivered; ``mapped``: with an application downloaded from POSITool, which ``positions`` or
    not."""
    received, sent = [RECEIVED], [SENT]
    if positions:
        received, sent = [POSI_RECEIVED, POSI_RAMPS], [POSI_SENT]
    elif axes > 1:
        received, sent = [AXIS_RECEIVED] * axes, [AXIS_SENT] * axes

    def pdo(base: int, channel: int, words: list[list[int]]) -> PdoSettings:
        used = words[channel] if mapped and channel < len(words) else []
        return StoeberPdo(
            base + node_id,
            transmission_type=ANSWERED,
            entries=used + [0] * (MAP_ENTRIES - len(used)),
            count=len(used),
        )

    return CommunicationSettings(
        emcy=CobId(0x80 + node_id, enabled=node_id != 0),  # §9.3: 80h would be the SYNC
        sdo=[
            SdoSettings.at(receive + node_id, send + node_id, enabled=first)
            for first, (receive, send) in zip((True, False, False, False), SDO_BASES, strict=True)
        ],
        rpdo=[pdo(base, channel, received) for channel, base in enumerate(RPDO_BASES)],
        tpdo=[pdo(base, channel, sent) for channel, base in enumerate(TPDO_BASES)],
    )
