"""Outputs of a simulated node when its communication fails (CiA 401)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from bridge.sim.generic.generic_plan import At

_DIGITAL: Final = {0x6200: (0x6206, 0x6207), 0x6300: (0x6306, 0x6307), 0x6320: (0x6326, 0x6327)}
"""Outputs in groups of 8, 16 and 32: a bit of the error mode that is 1 lets the error value's bit through."""
_ANALOGUE: Final = {0x6410: (0x6443, 0x6444), 0x6411: (0x6443, 0x6444), 0x6412: (0x6443, 0x6444)}
"""The error mode is 1: the output takes the error value."""
_BEHAVIOUR: Final = (0x1029, 1)


def outputs_in_error(numbers: Mapping[At, int]) -> Iterator[tuple[At, int]]:
    """Outputs and their values; one without an error mode stays as it is."""
    for (index, sub), value in numbers.items():
        if not sub:
            continue
        mode_at, safe_at = _DIGITAL.get(index) or _ANALOGUE.get(index) or (0, 0)
        mode, safe = numbers.get((mode_at, sub)), numbers.get((safe_at, sub))
        if mode is None or safe is None:
            continue
        if index in _DIGITAL:
            yield (index, sub), value & ~mode | safe & mode
        elif mode == 1:
            yield (index, sub), safe


def behaviour_in_error(numbers: Mapping[At, int]) -> int:
    """1029h:01: 0 leads to Pre-Operational, 1 to no other state, 2 to Stopped (CiA 301 §7.5.2.32)."""
    return numbers.get(_BEHAVIOUR, 0)
