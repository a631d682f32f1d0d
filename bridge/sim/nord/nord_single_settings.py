"""Factory settings of nodes with one SK 5xxE (BU 2500 §6.5.7)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from bridge.sim.core.communication_settings import CobId, CommunicationSettings, PdoSettings, SdoSettings
from bridge.sim.nord.nord_parameters import SK_5XXE, SK_54XE, NordParameter
from bridge.sim.nord.nord_settings import ACTUAL_VALUES, CONTROL_WORDS, PDO_WORDS, SETPOINTS, STATUS_WORDS

ENCODER: Final = 0x3006
"""The position of an absolute encoder, as an object of this simulation: §6.5.7 does not name NORD's."""
_BITS_16: Final = 0x10
_BITS_32: Final = 0x20
_INHIBIT_100US: Final = 100
_EVENT_TIMER_MS: Final = 250


@dataclass(frozen=True, slots=True)
class NordPdo:
    """One PDO as delivered: its identifier without the node address, and its mapping words."""

    cob_id: int
    entries: tuple[int, ...]
    enabled: bool = True


@dataclass(frozen=True, slots=True)
class Variant:
    """``values`` are setpoints, and as many actual values. ``has_interface``: with an SK TU3-CAO between
    drive and bus; then the latest RPDO decides which setpoints count."""

    device_name: str
    values: int
    parameters: tuple[NordParameter, ...]
    rpdo: tuple[NordPdo, ...]
    tpdo: tuple[NordPdo, ...]
    has_interface: bool = False


def _words(head: int, values: int, numbers: Sequence[int]) -> tuple[int, ...]:
    return (head << 16 | _BITS_16, *_values(values, numbers))


def _values(values: int, numbers: Sequence[int]) -> tuple[int, ...]:
    return tuple(values << 16 | number << 8 | _BITS_16 for number in numbers)


_THREE: Final = (1, 2, 3)
_RPDO_1: Final = NordPdo(0x200, _words(CONTROL_WORDS, SETPOINTS, _THREE))
_TPDO_1: Final = NordPdo(0x180, _words(STATUS_WORDS, ACTUAL_VALUES, _THREE))
_ENCODER_ENTRY: Final = (ENCODER << 16 | _BITS_32,)

# The 32 bits of PDO3 are mapped in halves: §6.5.7 names objects of 16 bits alone, §6.5.4 splits a position
# into a low and a high word.
TU3: Final = Variant(
    "SK TU3-CAO",
    3,
    SK_5XXE,
    rpdo=(
        NordPdo(0x200, _words(CONTROL_WORDS, SETPOINTS, (1,))),
        NordPdo(0x300, _words(CONTROL_WORDS, SETPOINTS, _THREE)),
        NordPdo(0x400, _words(CONTROL_WORDS, SETPOINTS, _THREE)),
        NordPdo(0x500, _words(CONTROL_WORDS, SETPOINTS, ())),
    ),
    tpdo=(
        NordPdo(0x180, _words(STATUS_WORDS, ACTUAL_VALUES, (1,))),
        NordPdo(0x280, _words(STATUS_WORDS, ACTUAL_VALUES, _THREE), enabled=False),
        NordPdo(0x380, _words(STATUS_WORDS, ACTUAL_VALUES, _THREE), enabled=False),
        NordPdo(0x480, _words(STATUS_WORDS, ACTUAL_VALUES, ()), enabled=False),
    ),
    has_interface=True,
)
RJ45_5XX: Final = Variant(
    "SK 535E", 3, SK_5XXE, rpdo=(_RPDO_1, NordPdo(0x300, _ENCODER_ENTRY)), tpdo=(_TPDO_1,)
)
RJ45_54X: Final = Variant(
    "SK 540E",
    5,
    SK_54XE,
    rpdo=(_RPDO_1, NordPdo(0x300, _values(SETPOINTS, (4, 5))), NordPdo(0x400, _ENCODER_ENTRY)),
    tpdo=(_TPDO_1, NordPdo(0x280, _values(ACTUAL_VALUES, (4, 5)))),
)


def factory_settings(node_id: int, variant: Variant) -> CommunicationSettings:
    """Settings as delivered: one SDO channel, the PDOs of §6.5.7."""
    return CommunicationSettings(
        emcy=CobId(0x80 + node_id),
        sdo=[SdoSettings.at(0x600 + node_id, 0x580 + node_id)],
        rpdo=[_settings(node_id, view) for view in variant.rpdo],
        tpdo=[_settings(node_id, view, _INHIBIT_100US, _EVENT_TIMER_MS) for view in variant.tpdo],
    )


def _settings(node_id: int, view: NordPdo, inhibit_100us: int = 0, event_timer_ms: int = 0) -> PdoSettings:
    return PdoSettings(
        view.cob_id + node_id,
        enabled=view.enabled,
        inhibit_100us=inhibit_100us,
        event_timer_ms=event_timer_ms,
        entries=[*view.entries, *[0] * (PDO_WORDS - len(view.entries))],
        count=len(view.entries),
    )
