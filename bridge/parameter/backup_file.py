"""A backup as a file: TOML, one line a value, to be read, compared and kept by people."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, cast

from bridge.base.errors import Fault
from bridge.image import Value
from bridge.text import Said, Text
from bridge.tomlfile import TomlFile, dotted

_FORMAT: Final = 3
_READ: Final = (1, 2, 3)
"""Format 1 has neither identity nor objects, format 2 no line for its end."""
_ENDED: Final = 3
_END: Final = "# End of the backup: without this line, half a file would look like a whole one."
IDENTITY: Final = ("vendor", "product", "revision", "serial")


@dataclass(frozen=True, slots=True)
class BackupFile:
    """Content of a file. ``mapping`` is the family, such as nord/sk-tu4-cao; ``drive`` where the values come
    from, ``saved`` when, both for people."""

    mapping: str
    drive: str
    saved: str
    values: Mapping[str, Value]
    comments: Mapping[str, str]
    """Meaning of a value, by its name; not read back."""
    missing: Sequence[str] = ()
    identity: Mapping[str, int] = field(default_factory=dict[str, int])
    """Identity of the node (1018h), as far as it has one, by ``IDENTITY``."""
    objects: Mapping[str, Value] = field(default_factory=dict[str, Value])
    """Values that the mapping file does not list, as the drive sends them, by name."""
    unreadable: Mapping[str, str] = field(default_factory=dict[str, str])
    """Reason why something was not read, by its name; not read back."""
    left_out: Mapping[str, str] = field(default_factory=dict[str, str])
    """Reason why no set holds it, by its name: a restore would move something. Not read back."""
    lines: Mapping[str, int] = field(default_factory=dict[str, int])
    """Lines of ``mapping``, the parts of the identity and the values in the file, by name."""

    @property
    def all(self) -> dict[str, Value]:
        """Values of the drive, listed or not."""
        return {**self.values, **self.objects}

    def text(self) -> str:
        lines = [
            "# A parameter set of drivebridge: `drivebridge parameters compare` and `restore` read it.",
            f"format = {_FORMAT}",
            f"mapping = {_quoted(self.mapping)}",
            f"drive = {_quoted(self.drive)}",
            f"saved = {_quoted(self.saved)}",
        ]
        if self.missing:
            lines += ["", "# The drive does not have:", *(f"#   {name}" for name in self.missing)]
        if self.unreadable:
            lines += ["", "# Could not be read:"]
            lines += [f"#   {name}: {_one_line(why)}" for name, why in self.unreadable.items()]
        if self.left_out:
            lines += ["", "# Left out, because a restore would move something:"]
            lines += [f"#   {_one_line(why)}" for why in self.left_out.values()]
        if self.identity:
            lines += ["", "[identity]", *(f"{name} = 0x{self.identity[name]:08X}" for name in self.identity)]
        lines += ["", "[parameters]"]
        for name, value in self.values.items():
            comment = _one_line(self.comments.get(name, ""))
            lines.append(f"{_quoted(name)} = {_written(value)}" + (f"  # {comment}" if comment else ""))
        if self.objects:
            lines += ["", "# What the mapping file does not list, as the drive sends it.", "[objects]"]
            lines += [f"{_quoted(name)} = {_written(value)}" for name, value in self.objects.items()]
        lines += ["", _END]
        return "\n".join(lines) + "\n"


def read_backup(path: Path) -> BackupFile:
    """Read the file at ``path``. Raises ``FileFaults`` with everything that is wrong."""
    return _BackupReader(TomlFile(path)).read()


class _BackupReader:
    """Reading of one file, step by step; each step notes its faults."""

    def __init__(self, file: TomlFile) -> None:
        self._file = file
        self._content = file.data

    def read(self) -> BackupFile:
        form = self._format()
        mapping = self._text("mapping")
        self._check_present(mapping)
        values, objects = self._table("parameters"), self._table("objects")
        for name in values.keys() & objects.keys():
            self._fault(("objects", name), Text.of("backup_file.twice"))
        identity = self._identity()
        self._check_end(form)
        self._file.finish()
        lines = {"mapping": self._file.line(("mapping",))}
        for table, names in (("identity", identity), ("parameters", values), ("objects", objects)):
            lines |= {name: self._file.line((table, name)) for name in names}
        drive, saved = self._text("drive"), self._text("saved")
        return BackupFile(mapping, drive, saved, values, {}, identity=identity, objects=objects, lines=lines)

    def _fault(self, key: tuple[str, ...], said: Text, advice: Said = "") -> None:
        shown = dotted(key if key[0] == "identity" else (key[0], *map(_quoted, key[1:])))
        self._file.faults.append(Fault(str(self._file.path), self._file.line(key), shown, said, advice))

    def _text(self, key: str) -> str:
        return str(self._content.get(key, ""))

    def _format(self) -> object:
        form = self._content.get("format")
        if form not in _READ:
            advice = Text.of("backup_file.format_advice")
            self._fault(("format",), Text.of("backup_file.format", format=_FORMAT), advice)
        return form

    def _check_present(self, mapping: str) -> None:
        if not mapping:
            self._fault(("mapping",), Text.of("toml.missing"), Text.of("backup_file.mapping_advice"))
        if "parameters" not in self._content:
            self._fault(("parameters",), Text.of("toml.missing"), Text.of("backup_file.table_advice"))

    def _table(self, key: str) -> dict[str, Value]:
        """Values of a table by name, without those that no parameter can have."""
        values: dict[str, Value] = {}
        found: object = self._content.get(key, {})
        if not isinstance(found, dict):
            self._fault((key,), Text.of("backup_file.table"))
            return values
        for name, value in cast("dict[str, object]", found).items():
            if not isinstance(value, bool | int | float | str) or (
                isinstance(value, float) and not math.isfinite(value)
            ):
                self._fault((key, name), Text.of("backup_file.value"))
            else:
                values[name] = value
        return values

    def _identity(self) -> dict[str, int]:
        identity: dict[str, int] = {}
        for name, value in self._table("identity").items():
            if name not in IDENTITY or isinstance(value, bool) or not isinstance(value, int):
                self._fault(("identity", name), Text.of("backup_file.identity", names=IDENTITY))
            else:
                identity[name] = value
        return identity

    def _check_end(self, form: object) -> None:
        """Note a file that breaks off."""
        lines = self._file.text.splitlines()
        if not self._file.text.endswith("\n"):
            # Half a number is a number: 12.5 that breaks off is 12.
            said, advice = Text.of("backup_file.line_cut"), Text.of("backup_file.line_cut_advice")
        elif form == _ENDED and _END not in lines:
            said, advice = Text.of("backup_file.cut"), Text.of("backup_file.cut_advice", line=_END)
        else:
            return
        self._file.faults.append(Fault(str(self._file.path), len(lines), "", said, advice))


def _one_line(text: str) -> str:
    """Without what a TOML comment may not have."""
    return "".join(one if one.isprintable() else " " for one in text)


def _quoted(text: str) -> str:
    # TOML's basic strings and JSON's are written alike, but for what lies beyond 16 bits.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _written(value: Value) -> str:
    if isinstance(value, str):
        return _quoted(value)
    return repr(value).lower() if isinstance(value, bool) else repr(value)
