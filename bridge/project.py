"""A site file with everything it names, read and checked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from bridge.base.errors import FileFaults
from bridge.config import REACTIONS, NodeTable, Site, read_site
from bridge.config.download import Download
from bridge.derive import describe
from bridge.drive.own_judgement import judge, why_silence_does_not_stop
from bridge.eds import read_configurations
from bridge.mapping import Family
from bridge.mapping.model import Slot
from bridge.mapping.own_places import Raw, channels_needed, offline
from bridge.mapping.site_families import load_site_and_families
from bridge.text import Text
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
    site, families = load_site_and_families(path, describe)
    project = Project(path, site, families, read_configurations(site, path))
    _refuse_vain_silence(project)
    return project


def _refuse_vain_silence(project: Project) -> None:
    """Silence is a stop only for a drive that watches its own process data (``docs/explanation``, reactions).
    Judged by the site file and the factory. Raises ``FileFaults``."""
    found = list(_vain_silences(project))
    if found:
        file, _ = read_site(project.path)
        for where, why, advice in found:
            file.fault(where, why, advice)
        raise FileFaults(file.faults)


def _vain_silences(project: Project) -> Iterator[tuple[Key, Text, Text]]:
    """Keys of the site file that ask for silence, why it would not stop the drive, and what would."""
    for b, bus in enumerate(project.site.bus):
        for n, node in enumerate(bus.node):
            family = project.families[node.mapping_key]
            settings = _settings(node, project.downloads.get(node.name, ()))
            for d, drive in enumerate(node.drive):
                table = ("bus", b, "node", n, "drive", d)
                if drive.reaction.holds:
                    if drive.then_silence_ms:
                        advice = Text.of("check.never_silent_advice")
                        yield (*table, "then_silence_ms"), Text.of("check.never_silent"), advice
                    continue
                slot = family.slot_named(drive.slot)
                of_drive = family.of_slot(slot)
                own = judge(of_drive, offline(of_drive, settings, bus, node, slot), bus, node)
                why = why_silence_does_not_stop(of_drive, own, node)
                if not why:
                    continue
                why = Text.of("check.silence_does_not_stop", why=why)
                watch = _own_watch(family, node, slot)
                if drive.reaction.is_silent:
                    yield (*table, "on_expiry"), why, _other_reaction(watch)
                if drive.then_silence_ms:
                    yield (*table, "then_silence_ms"), why, Text.of("check.then_silence_advice", watch=watch)


_STOPS: Final = [f'"{name}"' for name, rule in REACTIONS.items() if rule.sends_stop]
"""Reactions that stop any drive."""


def _other_reaction(watch: Text) -> Text:
    *others, last = _STOPS
    return Text.of("check.silent_reaction_advice", reactions=tuple(others), last=last, watch=watch)


def _own_watch(family: Family, node: NodeTable, slot: Slot) -> Text:
    """Text on the settings that make silence a stop."""
    channels = channels_needed(family, node, [slot])
    if channels:
        return Text.of("check.own_watch_channels_advice", channels=str(channels))
    return Text.of("check.own_watch_advice")


def _settings(node: NodeTable, from_file: Sequence[Download]) -> Raw:
    """Values after the downloads; the site file wins over a configuration file."""
    downloads = (*from_file, *(one.download for one in node.configure))
    return {(one.index, one.sub): int.from_bytes(one.data, "little") for one in downloads}


def count(number: int, what: str) -> str:
    """``1 bus``, ``2 buses``, ``4 drives``."""
    ending = "" if number == 1 else "es" if what.endswith("s") else "s"
    return f"{number} {what}{ending}"
