"""Finding and reading drive-family files."""

from __future__ import annotations

from pathlib import Path

from bridge.errors import Fault, FileFaults
from bridge.mapping.checks import check
from bridge.mapping.model import Family
from bridge.tomlfile import TomlFile


def mappings_dir() -> Path:
    """The folder of the families: inside the installed package, or at the top of a checkout."""
    package = Path(__file__).resolve().parents[1]
    installed = package / "families"
    return installed if installed.is_dir() else package.parent / "mappings"


def family_names() -> list[str]:
    """Every family that is there, as the site file names them."""
    top = mappings_dir()
    return sorted(str(file.relative_to(top).with_suffix("")) for file in top.rglob("*.toml"))


def load_family(name: str) -> Family:
    """The family called ``name`` (``nord/sk-tu4-cao``). Raises ``FileFaults`` with every fault in it."""
    path = mappings_dir() / f"{name}.toml"
    known = family_names()
    if name not in known:
        raise FileFaults(
            [Fault(str(path), 0, "", f"there is no mapping {name!r}", f"there are: {', '.join(known)}")]
        )
    return read_family(path)


def read_family(path: Path) -> Family:
    """Read and check one mapping file. Raises ``FileFaults`` with every fault in it."""
    file = TomlFile(path)
    family = file.validate(Family)
    if family is not None:
        check(family, file)
    file.finish()
    if family is None:
        raise AssertionError("a mapping file without a model always has faults")
    return family
