"""Simulated drives whose parameters in a site file are objects: CiA 402 drives, and the 8400 motec."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from bridge.base.errors import OperationFailed
from bridge.sim.abort import SdoAbort
from bridge.sim.cia402_drive import Cia402Drive
from bridge.sim.dictionary import Dictionary, Number
from bridge.sim.lenze_motec import LenzeMotec
from bridge.sim.lenze_settings import CODE_BASE

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
"""What the master commands is not a parameter."""
_CODE: Final = re.compile(r"(?:drive/)?C(\d{5})(?:/(\d{1,3}))?")
_FACTORS: Final = {12: 1000, 13: 1000, 39: 100, 88: 100, 105: 1000}
"""Wire value = value × factor (EDS84DMOTCAN 3.0, §9.2.3); the others have 1."""
_DEVICE_COMMANDS: Final = 2


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
        entry = _settable(node.objects, name, index, int(match[2] or "0", 16), "object", index in _COMMANDS)
        low, high = entry.limits
        if not low <= value <= high or value != round(value):
            raise OperationFailed(f"{name} = {value:g}: a whole number in {low} … {high}")
        _set(entry, name, value, round(value))
    node.save_settings()
    return node


def lenze_8400_motec(node_id: int, parameters: Mapping[str, float]) -> LenzeMotec:
    """``C00011`` (1/min), ``C00012`` and ``C00013`` (s), ``C00593/1`` and any other code that can be written.
    Raises ``OperationFailed`` for an unknown one or a value out of range."""
    if not 1 <= node_id <= 63:
        raise OperationFailed(f"an 8400 motec has addresses 1…63, not {node_id}")
    node = LenzeMotec(node_id)
    for name, value in parameters.items():
        match = _CODE.fullmatch(name)
        if match is None:
            raise OperationFailed(f"{name}: the simulated 8400 motec takes codes such as C00011 or C00593/1")
        code = int(match[1])
        is_command = code == _DEVICE_COMMANDS
        entry = _settable(node.objects, name, CODE_BASE - code, int(match[2] or 0), "code", is_command)
        factor = _FACTORS.get(code, 1)
        low, high = entry.limits
        if not low <= round(value * factor) <= high:
            raise OperationFailed(f"{name} = {value:g} is outside {low / factor:g} … {high / factor:g}")
        _set(entry, name, value, round(value * factor))
    node.save()
    return node


def _settable(objects: Dictionary, name: str, index: int, sub: int, what: str, is_command: bool) -> Number:
    try:
        entry = objects.find(index, sub)
    except SdoAbort:
        raise OperationFailed(f"{name}: the simulated drive has no such {what}") from None
    if not isinstance(entry, Number) or entry.write is None or is_command:
        raise OperationFailed(f"{name} of the simulated drive cannot be set")
    return entry


def _set(entry: Number, name: str, value: float, wire: int) -> None:
    try:
        entry.download(entry.data_type.encode(wire))
    except SdoAbort as abort:
        raise OperationFailed(f"{name} = {value:g}: {abort}") from None
