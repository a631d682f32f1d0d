"""The configuration files that a site file names."""

from __future__ import annotations

from pathlib import Path

from bridge.base.errors import Fault, FileFaults
from bridge.config import Site
from bridge.config.download import Download
from bridge.eds.device_file import read_configuration
from bridge.text import Text
from bridge.tomlfile import TomlFile, dotted


def read_configurations(site: Site, path: Path) -> dict[str, tuple[Download, ...]]:
    """The downloads in the files named by ``configuration``, by node name; file names are relative to the
    site file at ``path``. Raises ``FileFaults`` with all faults of all files."""
    found: dict[str, tuple[Download, ...]] = {}
    faults: list[Fault] = []
    for b, bus in enumerate(site.bus):
        for n, node in enumerate(bus.node):
            if node.configuration is None:
                continue
            try:
                found[node.name] = read_configuration(path.parent / node.configuration, node.id)
            except FileFaults as error:
                key = ("bus", b, "node", n, "configuration")
                line = TomlFile(path).line(key)
                # A finding without a line of its own is reported where the file is named.
                faults += [one if one.line else _named(one, path, line, dotted(key)) for one in error.faults]
    if faults:
        raise FileFaults(faults)
    return found


def _named(fault: Fault, site: Path, line: int, key: str) -> Fault:
    """The fault of a file as a whole, at the line of the site file that names it."""
    said = Text.of("file.at", place=fault.file, said=Text.plain(fault.said))
    return Fault(str(site), line, key, said, fault.advice)
