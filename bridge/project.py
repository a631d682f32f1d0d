"""A site file with everything it names, read and checked."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from bridge.config import Site
from bridge.config.download import Download
from bridge.eds import read_configurations
from bridge.mapping import Family
from bridge.mapping.site import load_site_and_families


@dataclass(frozen=True, slots=True)
class Project:
    """A checked site with the families it uses, and the file it came from. ``downloads`` has what
    configuration files ask of their nodes, by the node's name."""

    path: Path
    site: Site
    families: dict[str, Family]
    downloads: dict[str, tuple[Download, ...]] = field(default_factory=dict[str, tuple[Download, ...]])


def load_project(path: Path) -> Project:
    """Read a site file and every file it names. Raises ``FileFaults`` with all faults of the site file and
    its mappings, or else of its configuration files."""
    site, families = load_site_and_families(path)
    return Project(path, site, families, read_configurations(site, path))


def count(number: int, what: str) -> str:
    """``1 bus``, ``2 buses``, ``4 drives``."""
    ending = "" if number == 1 else "es" if what.endswith("s") else "s"
    return f"{number} {what}{ending}"
