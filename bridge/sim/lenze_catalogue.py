"""A simulated 8400 motec from the parameters of a site file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from bridge.errors import OperationFailed
from bridge.sim.abort import SdoAbort
from bridge.sim.dictionary import Number
from bridge.sim.lenze_motec import LenzeMotec
from bridge.sim.lenze_settings import CODE_BASE

_NAME: Final = re.compile(r"(?:drive/)?C(\d{5})(?:/(\d{1,3}))?")
_FACTORS: Final = {12: 1000, 13: 1000, 39: 100, 88: 100, 105: 1000}
"""Wire value = value × factor (§9.2.3); the others have 1."""
_DEVICE_COMMANDS: Final = 2


def lenze_8400_motec(node_id: int, parameters: Mapping[str, float]) -> LenzeMotec:
    """``C00011`` (1/min), ``C00012`` and ``C00013`` (s), ``C00593/1`` and any other code that can be written.
    Raises ``OperationFailed`` for an unknown one or a value out of range."""
    if not 1 <= node_id <= 63:
        raise OperationFailed(f"an 8400 motec has addresses 1…63, not {node_id}")
    node = LenzeMotec(node_id)
    for name, value in parameters.items():
        match = _NAME.fullmatch(name)
        if match is None:
            raise OperationFailed(f"{name}: the simulated 8400 motec takes codes such as C00011 or C00593/1")
        _commission(node, name, int(match[1]), int(match[2] or 0), value)
    node.save()
    return node


def _commission(node: LenzeMotec, name: str, code: int, sub_code: int, value: float) -> None:
    try:
        entry = node.objects.find(CODE_BASE - code, sub_code)
    except SdoAbort:
        raise OperationFailed(f"{name}: the simulated drive has no such code") from None
    if not isinstance(entry, Number) or entry.write is None or code == _DEVICE_COMMANDS:
        raise OperationFailed(f"{name} of the simulated drive cannot be set")
    wire = round(value * _FACTORS.get(code, 1))
    low, high = entry.limits
    if not low <= wire <= high:
        factor = _FACTORS.get(code, 1)
        raise OperationFailed(f"{name} = {value:g} is outside {low / factor:g} … {high / factor:g}")
    try:
        entry.write(wire)
    except SdoAbort as abort:
        raise OperationFailed(f"{name} = {value:g}: {abort}") from None
