"""A file as a set of parameters that fits one drive: a backup, or a device description's factory settings."""

from __future__ import annotations

from pathlib import Path

from bridge.base.errors import Fault, FileFaults
from bridge.parameter import backups
from bridge.parameter.backup_file import BackupFile, read_backup
from bridge.parameter.factory import DESCRIPTIONS, factory
from bridge.parameter.names import Names


def read_set(file: Path, names: Names, mapping: str, drive: str, node_id: int) -> BackupFile:
    """Content of ``file`` for ``drive``, whose family is ``mapping``. Raises ``FileFaults`` with all that
    does not fit."""
    if file.suffix.lower() in DESCRIPTIONS:
        objects = factory(file, names, node_id)
        if not objects:
            hint = "the EDS, DCF or XDD file of this drive"
            raise FileFaults([Fault(str(file), 0, "", f"has no factory settings of {drive}", hint)])
        return BackupFile(mapping, drive, "", {}, {}, objects=objects)
    content = read_backup(file)
    if content.mapping != mapping:
        message = f"the file is of {content.mapping}, and {drive} has {mapping}"
        raise FileFaults([fault_of(file, content, "mapping", message, "a backup of such a drive")])
    faults = [
        fault_of(file, content, name, str(error)) for name, error in backups.misfits(names, content.all)
    ]
    if faults:
        raise FileFaults(faults)
    return content


def fault_of(file: Path, content: BackupFile, name: str, message: str, hint: str = "") -> Fault:
    """A fault at the line of ``file`` that has ``name``."""
    return Fault(str(file), content.lines.get(name, 0), name, message, hint)
