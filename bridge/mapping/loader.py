"""Search and reading of drive-family files.

Mappings are looked up in the folder ``mappings/`` beside the site file first, then in the program's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from bridge.base.errors import Fault, FileFaults
from bridge.mapping.checks import check
from bridge.mapping.merge import MergedFile
from bridge.mapping.model import Family
from bridge.text import Text
from bridge.tomlfile import TomlFile

_SITE_FOLDER: Final = "mappings"


def mappings_dir() -> Path:
    """Folder of the families that come with the program: inside the installed package, or at the top of a
    checkout."""
    package = Path(__file__).resolve().parents[1]
    installed = package / "families"
    return installed if installed.is_dir() else package.parent / "mappings"


def mapping_folders(site: Path | None = None) -> tuple[Path, ...]:
    """Folders in which the mappings of a site are looked up, in this order."""
    own = mappings_dir()
    beside = None if site is None else site.resolve().parent / _SITE_FOLDER
    return (own,) if beside is None or beside == own or not beside.is_dir() else (beside, own)


def _files(folders: Sequence[Path]) -> dict[str, list[Path]]:
    """Files of each mapping by its name, in the order of the folders."""
    found: dict[str, list[Path]] = {}
    for folder in folders:
        for path in sorted(folder.rglob("*.toml")):
            found.setdefault(path.relative_to(folder).with_suffix("").as_posix(), []).append(path)
    return found


def is_template(path: Path) -> bool:
    """Whether a mapping file says that it can only be extended. A file that cannot be read is no such
    template."""
    try:
        family = TomlFile(path).root.table("family")
    except FileFaults:
        return False
    return family.content.get("template") is True


def family_names(folders: Sequence[Path] = ()) -> list[str]:
    """Families that a site can use, as the site file names them."""
    files = _files(folders or mapping_folders())
    return sorted(name for name, paths in files.items() if not is_template(paths[0]))


def load_family(name: str, folders: Sequence[Path] = ()) -> Family:
    """Family called ``name`` (``nord/sk-tu4-cao``). Raises ``FileFaults`` with every fault in it."""
    folders = folders or mapping_folders()
    paths = _files(folders).get(name)
    if not paths or is_template(paths[0]):
        path = paths[0] if paths else folders[0] / f"{name}.toml"
        hint = Text.of("mapping.there_are", names=tuple(family_names(folders)))
        raise FileFaults([Fault(str(path), 0, "", missing(name, template=bool(paths)), hint)])
    return read_family(paths[0], folders)


def is_family(name: str, folders: Sequence[Path]) -> bool:
    """Whether a site can use a mapping of this name."""
    paths = _files(folders).get(name)
    return bool(paths) and not is_template(paths[0])


def missing(name: str, *, template: bool) -> Text:
    """Reason why no site can use a mapping of this name."""
    return Text.of("mapping.is_template" if template else "mapping.none", mapping=name)


def template_names(folders: Sequence[Path] = ()) -> list[str]:
    """Mappings that can only be extended."""
    files = _files(folders or mapping_folders())
    return sorted(name for name, paths in files.items() if is_template(paths[0]))


def read_family(path: Path, folders: Sequence[Path] = ()) -> Family:
    """Read and check one mapping file and those it extends. Raises ``FileFaults`` with every fault."""
    return _checked(MergedFile(_chain(TomlFile(path), folders or mapping_folders())))


def _checked(file: MergedFile) -> Family:
    family = file.validate(Family)
    if family is not None:
        check(family, file)
    file.finish()
    if family is None:
        raise AssertionError("a mapping file without a model always has faults")
    return family


def family_of(text: str, path: Path, folders: Sequence[Path] = ()) -> Family:
    """Family in the mapping ``text`` that was made of the file in ``path``. Raises ``FileFaults``."""
    return _checked(MergedFile(_chain(TomlFile(path, text), folders or mapping_folders())))


def lineage(name: str, folders: Sequence[Path] = ()) -> list[str]:
    """Names of the mapping ``name`` and of those it extends. Raises ``FileFaults`` where one is missing;
    there must be a mapping of this name."""
    folders = folders or mapping_folders()
    files = _files(folders)
    by_path = {path.resolve(): known for known, paths in files.items() for path in paths}
    chain = _chain(TomlFile(files[name][0]), folders)
    return list(dict.fromkeys(by_path[file.path.resolve()] for file in reversed(chain)))


def _chain(first: TomlFile, folders: Sequence[Path]) -> list[TomlFile]:
    """Files from the one that extends nothing to ``first``, each extended by the next."""
    chain = [first]
    files = _files(folders)
    while isinstance(name := chain[0].data.get("extends"), str):
        file = chain[0]
        # A file may extend the one of its own name in the next folder.
        candidates = files.get(name, [])
        here = file.path.resolve()
        own = next((n for n, each in enumerate(candidates) if each.resolve() == here), None)
        following = candidates if own is None else candidates[own + 1 :]
        if not following:
            said = Text.of("mapping.extends_itself") if own is not None else missing(name, template=False)
            others = tuple(other for other in sorted(files) if other != name)
            file.fault(("extends",), said, Text.of("mapping.there_are", names=others))
            file.finish()
        base = following[0]
        if any(base.resolve() == each.path.resolve() for each in chain):
            file.fault(("extends",), Text.of("mapping.extends_in_turn", mapping=name))
            file.finish()
        chain.insert(0, TomlFile(base))
    return chain
