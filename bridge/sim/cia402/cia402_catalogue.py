"""Simulated CiA 402 drives, whose parameters in a site file are objects."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from bridge.base.errors import OperationFailed
from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.core.settable import put_in, settable

MAPPINGS: Final = (
    "cyclic-position",
    "cyclic-velocity",
    "homing",
    "profile-position",
    "profile-velocity",
    "velocity",
)
_OBJECT: Final = re.compile(r"(?:drive/)?(6[0-9A-Fa-f]{3})(?::([0-9A-Fa-f]{2}))?")
_COMMANDS: Final = (0x6040, 0x6042, 0x607A, 0x60FF)
"""Objects by which the master commands, which are no parameters."""


def cia402(node_id: int, parameters: Mapping[str, float]) -> Cia402Drive:
    """``6083``, ``6046:02`` and any other parameter of the profile, in the drive's units. Raises
    ``OperationFailed`` for an unknown one or a value out of range."""
    node = Cia402Drive(node_id)
    for name, value in parameters.items():
        match = _OBJECT.fullmatch(name)
        if match is None:
            raise OperationFailed(
                f"{name}: the simulated CiA 402 drive takes objects such as 6083 or 6046:02"
            )
        index = int(match[1], 16)
        entry = settable(node.objects, name, index, int(match[2] or "0", 16), "object", index in _COMMANDS)
        low, high = entry.limits
        if not low <= value <= high or value != round(value):
            raise OperationFailed(f"{name} = {value:g}: a whole number in {low} … {high}")
        put_in(entry, name, value, round(value))
    node.save_settings()
    return node
