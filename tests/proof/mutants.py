"""The seeded faults of ``make proof-mutants``: a table (``mutants.toml``), and a program with one."""

from __future__ import annotations

import shutil
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tests.support.process import REPOSITORY

TABLE: Final = Path(__file__).with_name("mutants.toml")
_PACKAGE: Final = "bridge"


@dataclass(frozen=True, slots=True)
class Edit:
    """``find`` stands exactly once in ``file``, below ``bridge/``."""

    file: str
    find: str
    replace: str

    def apply(self, text: str) -> str:
        """Raises ``ValueError`` where there is not exactly one place for it."""
        found = text.count(self.find)
        if found != 1:
            raise ValueError(f"bridge/{self.file}: there {found} times instead of once: {self.find!r}")
        return text.replace(self.find, self.replace)


@dataclass(frozen=True, slots=True)
class Mutant:
    name: str
    breaks: str
    first: str
    """The fault that is tried first; the others follow in their order."""
    edits: tuple[Edit, ...]


def load(path: Path = TABLE) -> tuple[Mutant, ...]:
    def made(record: dict[str, Any]) -> Mutant:
        edits = tuple(Edit(**edit) for edit in record.pop("edit"))
        return Mutant(**record, edits=edits)

    return tuple(made(record) for record in tomllib.loads(path.read_text(encoding="utf-8"))["mutant"])


def files_of(mutant: Mutant, package: Path = REPOSITORY / _PACKAGE) -> dict[str, str]:
    """The mutant's files, by their place below ``bridge/``. Raises ``ValueError``."""
    texts: dict[str, str] = {}
    for edit in mutant.edits:
        text = texts.get(edit.file) or (package / edit.file).read_text(encoding="utf-8")
        texts[edit.file] = edit.apply(text)
    return texts


class Tree:
    """A copy of the program in ``folder``, that can hold one mutant at a time. What is compiled of it is
    copied as well: only the mutant's files are compiled anew."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        shutil.copytree(REPOSITORY / _PACKAGE, folder / _PACKAGE)
        (folder / "mappings").symlink_to(REPOSITORY / "mappings")
        self._changed: list[str] = []

    def hold(self, mutant: Mutant | None) -> None:
        """This one and no other; with None the program as it is."""
        for file in self._changed:
            shutil.copy2(REPOSITORY / _PACKAGE / file, self.folder / _PACKAGE / file)
        texts = files_of(mutant) if mutant else {}
        for file, text in texts.items():
            (self.folder / _PACKAGE / file).write_text(text, encoding="utf-8")
        self._changed = list(texts)
