"""Effects of the objects of the device profiles, by index: for every node, whether or not a file lists them.

CiA 301 §7.4.1 divides 6000h … 9FFFh into eight logical devices of 800h indices; each object of the first is
there again in the others, and CiA 404 has them once for each data type in the same way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from bridge.mapping.axes import STANDARDISED, on_first
from bridge.parameter.write_effect import Effect

NETWORK_VARIABLES: Final = range(0xA000, 0xC000)
"""CiA 301 §7.4.1: the network and system variables of a programmable device (CiA 302-4). They are process
data: what an RPDO brings to a program."""

Row = tuple[int, int, Effect]
"""First and last index, and what a write of them does."""

_IO: Final[Sequence[Row]] = (
    # CiA 401: write output, 8 bits, single bits, 16 bits, 32 bits; write analogue output, each type
    *((first, last, Effect.COMMANDS) for first, last in ((0x6200, 0x6200), (0x6220, 0x622F))),
    *((index, index, Effect.COMMANDS) for index in (0x6300, 0x6320)),
    (0x6410, 0x6414, Effect.COMMANDS),
    # change polarity output; analogue output offset and scaling, as floats and as integers
    *((index, index, Effect.SHAPES) for index in (0x6202, 0x6302, 0x6322)),
    (0x6240, 0x624F, Effect.SHAPES),
    *((index, index + 1, Effect.SHAPES) for index in (0x6441, 0x6446)),
    # error mode, error value and filter mask output: a masked output does not follow
    *((index, index + 2, Effect.MAKES_SAFE) for index in (0x6206, 0x6306, 0x6326)),
    (0x6250, 0x627F, Effect.MAKES_SAFE),
    # analogue output error mode and error values; 67FEh error behaviour of the profile's first editions
    (0x6443, 0x6445, Effect.MAKES_SAFE),
    (0x67FE, 0x67FE, Effect.MAKES_SAFE),
)
_DRIVE: Final[Sequence[Row]] = (
    # CiA 402: controlword; vl target velocity, nominal percentage; target torque, target position;
    # position, velocity and torque offset; interpolation data record; digital outputs; target velocity
    *((index, index, Effect.COMMANDS) for index in (0x6040, 0x6042, 0x6052, 0x6071, 0x607A)),
    (0x60B0, 0x60B2, Effect.COMMANDS),
    *((index, index, Effect.COMMANDS) for index in (0x60C1, 0x60FE, 0x60FF)),
    # abort connection option code; vl velocity quick stop, quick stop time; quick stop, shutdown, disable
    # operation, halt and fault reaction option code; quick stop deceleration
    *((index, index, Effect.MAKES_SAFE) for index in (0x6007, 0x604A, 0x6051, 0x6085)),
    (0x605A, 0x605E, Effect.MAKES_SAFE),
    # modes of operation
    (0x6060, 0x6060, Effect.OPERATES),
)
_VALVE: Final[Sequence[Row]] = (
    # CiA 408: device control word, device mode, device control mode; set-point of the spool
    (0x6040, 0x6040, Effect.COMMANDS),
    (0x6042, 0x6043, Effect.COMMANDS),
    (0x6300, 0x6300, Effect.COMMANDS),
    # zero correction of the spool; its set-point in HOLD and FAULT HOLD
    (0x6324, 0x6324, Effect.SHAPES),
    (0x6314, 0x6314, Effect.MAKES_SAFE),
)
_NOTHING_MOVES: Final[Sequence[Row]] = ()
"""CiA 406: encoders. 6200h is their cyclic timer."""
PROFILES: Final[Mapping[int, Sequence[Row]]] = {
    401: _IO,
    402: _DRIVE,
    406: _NOTHING_MOVES,
    408: _VALVE,
}
_ANY: Final = (*_IO, *_DRIVE, *_VALVE)
"""For a node of which nobody says what profile it has."""
_ORDER: Final = tuple(Effect)


def effect_of(index: int, profile: int | None) -> Effect | None:
    """Effect of a write of this object by the device profile: None where the profile does not say. Without a
    profile, and with one that is not among ``PROFILES``, the first effect counts that it has in any."""
    if index in NETWORK_VARIABLES:
        return Effect.COMMANDS
    if index not in STANDARDISED:
        return None
    first = on_first(index)
    is_first = index == first
    # What a further logical device is, its own 67FFh says; the profile is that of the first.
    rows = PROFILES.get(profile, _ANY) if is_first and profile is not None else _ANY
    found = [effect for low, high, effect in rows if low <= first <= high]
    return min(found, key=_ORDER.index, default=None)
