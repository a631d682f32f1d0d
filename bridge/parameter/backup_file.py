"""A backup as a file: TOML, one line a value, to be read, compared and kept by people."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, cast

from bridge.errors import Fault, FileFaults
from bridge.image import Value

_FORMAT: Final = 1


@dataclass(frozen=True, slots=True)
class BackupFile:
    """What a file holds. ``mapping`` is the family, such as nord/sk-tu4-cao; ``drive`` where the values
    come from, ``saved`` when, both for people."""

    mapping: str
    drive: str
    saved: str
    values: Mapping[str, Value]
    comments: Mapping[str, str]
    """What a value means, by its name; not read back."""
    missing: Sequence[str] = ()

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
        lines += ["", "[parameters]"]
        for name, value in self.values.items():
            comment = self.comments.get(name, "").replace("\n", " ")
            lines.append(f"{_quoted(name)} = {_written(value)}" + (f"  # {comment}" if comment else ""))
        return "\n".join(lines) + "\n"


def read_backup(path: Path) -> BackupFile:
    """Raises ``FileFaults`` with everything that is wrong."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FileFaults([Fault(str(path), 0, "", f"cannot be read: {error.strerror or error}")]) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FileFaults([Fault(str(path), 0, "", f"is not TOML: {error}")]) from None
    faults: list[Fault] = []

    def fault(key: str, message: str, hint: str = "") -> None:
        faults.append(Fault(str(path), 0, key, message, hint))

    if content.get("format") != _FORMAT:
        fault("format", f"must be {_FORMAT}", "is this a file of `drivebridge parameters backup`?")
    texts: dict[str, str] = {}
    for key in ("mapping", "drive", "saved"):
        texts[key] = str(content.get(key, ""))
    if not texts["mapping"]:
        fault("mapping", "is missing", "the mapping that the parameters are named by")
    values: dict[str, Value] = {}
    found: object = content.get("parameters")
    if not isinstance(found, dict):
        fault("parameters", "is missing", "a table of names and values")
    else:
        for name, value in cast("dict[str, object]", found).items():
            if not isinstance(value, bool | int | float | str) or (
                isinstance(value, float) and not math.isfinite(value)
            ):
                fault(f'parameters."{name}"', "must be a number, a text, true or false")
            else:
                values[name] = value
    if faults:
        raise FileFaults(faults)
    return BackupFile(texts["mapping"], texts["drive"], texts["saved"], values, {})


def _quoted(text: str) -> str:
    # TOML's basic strings and JSON's are written alike, but for what lies beyond 16 bits.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _written(value: Value) -> str:
    if isinstance(value, str):
        return _quoted(value)
    return repr(value).lower() if isinstance(value, bool) else repr(value)
