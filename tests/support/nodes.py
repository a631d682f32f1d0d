"""Configured nodes without a bus: drives of a family of ours, devices of a mapping that a test writes."""

from __future__ import annotations

from pathlib import Path

from bridge.catalogue import Catalogue
from bridge.command import Plant
from bridge.command.node import Node
from bridge.mapping.site_families import load_site_and_families
from tests.support import sites
from tests.support.devices import SITE


def node_of(*drives: str, mapping: str = sites.FAMILY, more: str = "") -> Node:
    """Node 5 of can0, called conveyor, with these drives of ``mapping``."""
    tables = drives or (sites.drive("fu1", "lease", 200, ""),)
    text = sites.site(sites.bus(sites.node(*tables, mapping=mapping, more=more)))
    return sites.plant_of(text, mapping).nodes["conveyor"]


def device_plant(folder: Path, mapping: str, more: str = "") -> Plant:
    """A plant with node 20, called shaft, of the mapping with this text."""
    file = folder / "mappings" / "acme" / "encoder.toml"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(mapping, encoding="utf-8")
    path = folder / "site.toml"
    path.write_text(SITE.format(node=more), encoding="utf-8")
    site, families = load_site_and_families(path)
    return Plant(Catalogue.of(site, families), "1.2.3")
