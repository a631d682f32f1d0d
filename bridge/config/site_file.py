"""Reading and checking of a site file."""

from __future__ import annotations

from pathlib import Path

from bridge.config.model import Site
from bridge.config.site_checks import check
from bridge.tomlfile import TomlFile


def load_site(path: Path) -> Site:
    """Read and check a site file. Raises ``FileFaults`` with every fault in it."""
    file, site = read_site(path)
    file.finish()
    if site is None:
        raise AssertionError("a site file without a model always has faults")
    return site


def read_site(path: Path) -> tuple[TomlFile, Site | None]:
    """The file with its faults noted, for callers that check more, and the site if its form is right.

    Raises ``FileFaults`` where the file is not TOML.
    """
    file = TomlFile(path)
    site = file.validate(Site)
    check(file)
    return file, site
