"""Reading a site file."""

from __future__ import annotations

from pathlib import Path

from bridge.config.checks import check
from bridge.config.model import IGNORE_ALL_S, Site
from bridge.tomlfile import TomlFile


def load_site(path: Path) -> Site:
    """Read and check a site file. Raises ``FileFaults`` with every fault in it."""
    file, site = read_site(path)
    file.finish()
    if site is None:
        raise AssertionError("a site file without a model always has faults")
    return site


def read_site(path: Path) -> tuple[TomlFile, Site | None]:
    """The file with its faults noted, for who has more to check, and the site if its form is right.

    Raises ``FileFaults`` where the file is not TOML.
    """
    file = TomlFile(path)
    site = file.validate(Site)
    check(file)
    return file, site


def warnings(site: Site) -> list[str]:
    """What is allowed and still worth repeating, one sentence each."""
    found: list[str] = []
    for bus in site.bus:
        for node in bus.node:
            for drive in node.drive:
                name = f"{node.name}/{drive.name or drive.slot}"
                if drive.control != "none" and drive.fieldbus_timeout_ms == 0:
                    found.append(f"{name}: fieldbus_timeout_ms = 0: a silent controller will not stop it")
                if drive.telegram_downtime_s == IGNORE_ALL_S:
                    found.append(f"{name}: telegram_downtime_s = -0.1: no communication error will stop it")
                if drive.on_expiry == "hold" and drive.control != "none":
                    found.append(f'{name}: on_expiry = "hold": a silent controller is only reported')
    if site.opcua and site.opcua.no_security:
        found.append("opcua: no_security = true: anyone who reaches the port reads everything in clear text")
    return found
