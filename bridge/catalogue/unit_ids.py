"""Modbus unit ids of drives, and of nodes that are no drives."""

from __future__ import annotations

from typing import Final

from bridge.base.errors import Fault, FileFaults
from bridge.config import Site
from bridge.text import Text

DEVICE: Final = -1
"""In place of a drive's number among those of its node."""


def unit_ids(site: Site) -> dict[tuple[str, int], int]:
    """Unit ids by node and the drive's number among those of its node, or ``DEVICE``: as given, the others in
    order from 1. Raises ``FileFaults`` where there are not enough."""
    nodes = [node for bus in site.bus for node in bus.node]
    given = {drive.unit_id for node in nodes for drive in node.drive} | {node.unit_id for node in nodes}
    free = (unit for unit in range(1, 248) if unit not in given)
    units: dict[tuple[str, int], int] = {}
    for node in nodes:
        owners = [(place, drive.unit_id) for place, drive in enumerate(node.drive)]
        for position, own in owners or [(DEVICE, node.unit_id)]:
            unit = own or next(free, 0)
            if not unit:
                raise FileFaults([Fault("", 0, "unit_id", Text.of("site.unit_ids_exhausted"))])
            units[node.name, position] = unit
    return units
