"""A site file's parameters for a simulated CiA 402 drive."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from bridge.errors import OperationFailed
from bridge.sim.abort import SdoAbort
from bridge.sim.cia402_drive import Cia402Drive
from bridge.sim.dictionary import Number

MAPPINGS: Final = (
    "cyclic-position",
    "cyclic-velocity",
    "homing",
    "profile-position",
    "profile-velocity",
    "velocity",
)
_NAME: Final = re.compile(r"(?:drive/)?(6[0-9A-Fa-f]{3})(?::([0-9A-Fa-f]{2}))?")
_COMMANDS: Final = (0x6040, 0x6042, 0x607A, 0x60FF)
"""What the master commands is not a parameter."""


def cia402(node_id: int, parameters: Mapping[str, float]) -> Cia402Drive:
    """``6083``, ``6046:02`` and any other parameter of the profile, in the drive's units. Raises
    ``OperationFailed`` for an unknown one or a value out of range."""
    node = Cia402Drive(node_id)
    for name, value in parameters.items():
        match = _NAME.fullmatch(name)
        if match is None:
            raise OperationFailed(
                f"{name}: the simulated CiA 402 drive takes objects such as 6083 or 6046:02"
            )
        _commission(node, name, int(match[1], 16), int(match[2] or "0", 16), value)
    node.save_settings()
    return node


def _commission(node: Cia402Drive, name: str, index: int, sub: int, value: float) -> None:
    try:
        entry = node.objects.find(index, sub)
    except SdoAbort:
        raise OperationFailed(f"{name}: the simulated drive has no such object") from None
    if not isinstance(entry, Number) or entry.write is None or index in _COMMANDS:
        raise OperationFailed(f"{name} of the simulated drive cannot be set")
    low, high = entry.limits
    if not low <= value <= high or value != round(value):
        raise OperationFailed(f"{name} = {value:g}: a whole number in {low} … {high}")
    try:
        entry.write(round(value))
    except SdoAbort as abort:
        raise OperationFailed(f"{name} = {value:g}: {abort}") from None
