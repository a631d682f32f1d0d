"""A site file with everything it names, read and checked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from bridge.config import NodeTable, Site, read_site
from bridge.config.download import Download
from bridge.drive.own_supervision import judge, why_silence_does_not_stop
from bridge.eds import read_configurations
from bridge.errors import FileFaults
from bridge.mapping import Family
from bridge.mapping.own_places import Raw, offline
from bridge.mapping.site import load_site_and_families
from bridge.tomlfile import Key


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
    project = Project(path, site, families, read_configurations(site, path))
    _refuse_vain_silence(project)
    return project


def _refuse_vain_silence(project: Project) -> None:
    """Silence is a stop only for a drive that watches its own process data (``docs/explanation``, reactions).
    Judged by the site file and the factory. Raises ``FileFaults``."""
    found = list(_vain_silences(project))
    if found:
        file, _ = read_site(project.path)
        for where, why in found:
            file.fault(where, f"silence does not stop this drive: {why}", _INSTEAD[where[-1]])
        raise FileFaults(file.faults)


def _vain_silences(project: Project) -> Iterator[tuple[Key, str]]:
    """Keys of the site file that ask for one, and why it is in vain."""
    for b, bus in enumerate(project.site.bus):
        for n, node in enumerate(bus.node):
            family = project.families[node.mapping]
            settings = _settings(node, project.downloads.get(node.name, ()))
            for d, drive in enumerate(node.drive):
                raw = offline(family, settings, bus, node, family.slot_named(drive.slot))
                why = why_silence_does_not_stop(family, judge(family, raw, bus, node), node)
                table = ("bus", b, "node", n, "drive", d)
                if why and drive.on_expiry == "silence":
                    yield (*table, "on_expiry"), why
                if why and drive.then_silence_ms:
                    yield (*table, "then_silence_ms"), why


_OWN_WATCH: Final = "own_timeout_ms and enforce = true where it has a watch of its own over its process data"
_INSTEAD: Final[dict[int | str, str]] = {
    "on_expiry": f'"disable_voltage", "quick_stop" or "stop"; or {_OWN_WATCH}',
    "then_silence_ms": f"0 (never); or {_OWN_WATCH}",
}


def _settings(node: NodeTable, from_file: Sequence[Download]) -> Raw:
    """What will have been downloaded; the site file wins over a configuration file."""
    downloads = (*from_file, *(one.download for one in node.configure))
    return {(one.index, one.sub): int.from_bytes(one.data, "little") for one in downloads}


def count(number: int, what: str) -> str:
    """``1 bus``, ``2 buses``, ``4 drives``."""
    ending = "" if number == 1 else "es" if what.endswith("s") else "s"
    return f"{number} {what}{ending}"
