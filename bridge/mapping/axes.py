"""Indices that profile objects have on the axes of a node.

CiA 301 §7.4.1 gives each of eight logical devices of a node 800h indices from 6000h on; CiA 402 (IEC
61800-7-201) makes them the axes of a drive: 6040h, 6840h, 7040h … are their control words.
"""

from __future__ import annotations

from typing import Final

MOST_AXES: Final = 8
PROFILE_SIZE: Final = 0x800
STANDARDISED: Final = range(0x6000, 0x6000 + MOST_AXES * PROFILE_SIZE)
"""Indices of the profile objects of all logical devices."""


def profile_of(axis: int) -> range:
    """Indices of the profile objects of an axis, counted from 1."""
    start = STANDARDISED.start + (axis - 1) * PROFILE_SIZE
    return range(start, start + PROFILE_SIZE)


def axis_of(index: int) -> int | None:
    """Axis, or other logical device, that has the object; None for an object that the node has in common."""
    return 1 + (index - STANDARDISED.start) // PROFILE_SIZE if index in STANDARDISED else None


def on_axis(index: int, axis: int) -> int:
    """Index that an axis has for an object of the first one. Any other object is the node's, common to all
    axes."""
    return index + (axis - 1) * PROFILE_SIZE if index in profile_of(1) else index


def on_first(index: int) -> int:
    """Index that the first axis has for an object of any axis."""
    return profile_of(1).start + index % PROFILE_SIZE if index in STANDARDISED else index
