"""Networks of the gateway: the part of a bus that it serves."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Final

from bridge import __version__
from bridge.catalogue import FIRST_CHANNEL, NodeSpec
from bridge.config import BusTable
from bridge.northbound.gateway.gateway_session import Net

_VERSION: Final = "0 0 {version} 0 1 3.00 {version}"
"""Vendor id, product code, revision, serial number, gateway class, version of the protocol, version of the
implementation (CiA 309-3). The bridge has neither a vendor id nor a serial number."""


def net_of(bus: BusTable, number: int, nodes: Iterable[NodeSpec], tap: Path) -> Net:
    """``number`` is what clients call it; ``nodes`` are those of the site; at ``tap`` the bus process passes
    its frames on where no other process can hear them."""
    version = ".".join(__version__.split(".")[:2])
    return Net(
        number,
        f"bus/{bus.name}",
        {node.table.id: (node.name, _on_first(node)) for node in nodes if node.bus is bus},
        _VERSION.format(version=version),
        f"socketcan {bus.channel}" if bus.interface == "socketcan" else f"tap {tap}",
    )


def _on_first(node: NodeSpec) -> str | None:
    """Name of the drive, or of a node that is none, whose parameters the node's first SDO channel reaches."""
    return next((one.name for one in node.members if one.sdo_channel == FIRST_CHANNEL), None)
