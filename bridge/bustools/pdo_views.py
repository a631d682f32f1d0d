"""Process data of a site's nodes, for a listener: of drives by their mapping, of others as described."""

from __future__ import annotations

from collections.abc import Mapping

from bridge.bustools.decode_device import DevicePdoView, device_views
from bridge.bustools.decode_pdo import PdoView, views
from bridge.config import NodeTable
from bridge.eds import Description
from bridge.mapping.model import Family


def pdo_views(
    node: NodeTable, family: Family, description: Description | None
) -> Mapping[int, PdoView | DevicePdoView]:
    """The PDOs of a node by COB-ID; ``description`` is used where its mapping says nothing of PDOs."""
    return views(node, family) or device_views(node, family, description)


def without_pdos(families: Mapping[str, Family]) -> list[str]:
    """Mappings that say nothing of PDOs: those of nodes that are no drives."""
    return [name for name, family in families.items() if family.is_device]
