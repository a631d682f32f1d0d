"""A file as a set of parameters that fits one drive: a backup, or a device description's factory settings."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from bridge.base.errors import Fault, FileFaults
from bridge.parameter import backups
from bridge.parameter.backup_file import BackupFile, read_backup
from bridge.parameter.factory import DESCRIPTIONS, factory
from bridge.parameter.names import Names
from bridge.text import Said, Text


def read_set(file: Path, names: Names, mapping: str, drive: str, node_id: int) -> BackupFile:
    """Content of ``file`` for ``drive``, whose family is ``mapping``. Raises ``FileFaults`` with all that
    does not fit."""
    if file.suffix.lower() in DESCRIPTIONS:
        objects = factory(file, names, node_id)
        if not objects:
            said = Text.of("set_file.no_factory", drive=drive)
            raise FileFaults([Fault(str(file), 0, "", said, Text.of("set_file.no_factory_advice"))])
        return BackupFile(mapping, drive, "", {}, {}, objects=objects)
    content = read_backup(file)
    if content.mapping != mapping:
        said = Text.of("set_file.other_mapping", of_file=content.mapping, drive=drive, of_drive=mapping)
        advice = Text.of("set_file.other_mapping_advice")
        raise FileFaults([fault_of(file, content, "mapping", said, advice)])
    faults = [
        fault_of(file, content, name, error.said) for name, error in backups.misfits(names, content.all)
    ]
    if faults:
        raise FileFaults(faults)
    return content


def why_another(of_file: Mapping[str, int], of_node: Mapping[str, int]) -> tuple[str, Text] | None:
    """Part of its identity by which a set is not of a drive of this kind, and the reason; None where it is,
    or where the set does not say."""
    for name in ("vendor", "product"):
        of_set, own = of_file.get(name), of_node.get(name)
        if of_set is not None and own is None:
            return name, Text.of("parameter_set.unknown_node", part=name, of_file=of_set)
        if of_set is not None and own is not None and of_set != own:
            return name, Text.of("parameter_set.other_node", part=name, of_file=of_set, of_node=own)
    return None


def fault_of(file: Path, content: BackupFile, name: str, said: Text, advice: Said = "") -> Fault:
    """A fault at the line of ``file`` that has ``name``."""
    return Fault(str(file), content.lines.get(name, 0), name, said, advice)
