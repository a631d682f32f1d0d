"""Simulated 8400 motec, whose parameters in a site file are codes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from bridge.base.errors import OperationFailed
from bridge.sim.core.settable import put_in, settable
from bridge.sim.lenze.lenze_motec import LenzeMotec
from bridge.sim.lenze.lenze_settings import CODE_BASE

_CODE: Final = re.compile(r"(?:drive/)?C(\d{5})(?:/(\d{1,3}))?")
_FACTORS: Final = {12: 1000, 13: 1000, 39: 100, 88: 100, 105: 1000}
"""Wire value = value × factor (EDS84DMOTCAN 3.0, §9.2.3); the others have 1."""
_DEVICE_COMMANDS: Final = 2


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
        entry = settable(node.objects, name, CODE_BASE - code, int(match[2] or 0), "code", is_command)
        factor = _FACTORS.get(code, 1)
        low, high = entry.limits
        if not low <= round(value * factor) <= high:
            raise OperationFailed(f"{name} = {value:g} is outside {low / factor:g} … {high / factor:g}")
        put_in(entry, name, value, round(value * factor))
    node.save()
    return node
