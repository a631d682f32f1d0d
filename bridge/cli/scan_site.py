"""Output of ``scan --write``: a site file, and mappings made of EDS files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridge.base.errors import BridgeError, FileFaults, OperationFailed
from bridge.bustools.scan import FoundNode
from bridge.config import BusTable
from bridge.derive import Derived, ProposedBus, ProposedNode, derive_family, describe, propose_site
from bridge.derive.device_family import is_of
from bridge.derive.toml import file_name
from bridge.eds import Description, read_device_file, read_whole_device_file
from bridge.mapping import Family
from bridge.mapping.loader import mappings_dir, read_family
from bridge.mapping.match import Match
from bridge.mapping.site_families import DESCRIBED

_SUFFIXES: Final = (".eds", ".dcf", ".xdd", ".xdc")
_PROFILE_ONLY: Final = ("device_type",)


@dataclass(frozen=True, slots=True)
class _DescriptionFile:
    path: Path
    description: Description


def write_site(
    path: Path,
    eds: Path | None,
    bus: BusTable,
    found: Sequence[tuple[FoundNode, Match | None]],
    families: Mapping[str, Family],
) -> str:
    """Write the site file, and beside it in ``mappings/`` what was made of the files in ``eds`` for nodes
    that no mapping is meant for and that do not name their file itself. Returns what was written, in words.
    Raises ``OperationFailed``."""
    if path.exists():
        raise OperationFailed(f"{path} is there already")
    files = list(_files(eds)) if eds else []
    known = dict(families)
    made: dict[str, Derived] = {}
    nodes: list[ProposedNode] = []
    for node, match in found:
        mapping, why = (match.mapping, "") if match else (None, "no mapping fits")
        if match is None or match.by == _PROFILE_ONLY:
            file = next((one for one in files if is_of(one.description, node.vendor, node.product)), None)
            if files and file is None and not node.vendor and not node.product:
                why = f"{why or 'known by its profile alone'}: it says neither vendor nor product (0/0), by "
                why += "which its file would be found"
            if file is not None:
                try:
                    derived = derive_family(read_whole_device_file(file.path), file.path.name)
                    mapping = _name(path, file, derived)
                    why = f"only read: {derived.read_only}" if derived.read_only else ""
                    if mapping not in known and mapping.startswith(DESCRIBED):
                        known[mapping] = describe(file.path)
                    elif mapping not in known:
                        made[mapping] = derived
                        known[mapping] = _written(path.parent / "mappings", derived)
                except (OperationFailed, FileFaults) as error:
                    why = str(error)
        says = _says(node)
        control = node.has_heartbeat, node.has_guarding
        nodes.append(ProposedNode(node.id, node.name, says, mapping, *control, why))
    where = ProposedBus(bus.interface, bus.channel, bus.bitrate)
    text = propose_site(file_name(path.stem) or "site", where, nodes, known)
    _write(path, text)
    beside = "".join(f", mappings/{name}.toml" for name in made)
    served = sum(node.mapping is not None for node in nodes)
    return f"{path}{beside}: {served} of {len(nodes)} nodes have a mapping"


def _name(site: Path, file: _DescriptionFile, derived: Derived) -> str:
    """Name of the mapping in the site file. A device that is no drive has its file itself, where that lies
    with the site; a drive has a mapping file, because its words want to be looked through."""
    folder, described = site.resolve().parent, file.path.resolve()
    if derived.is_drive or not described.is_relative_to(folder):
        return derived.name
    return f"{DESCRIBED}{described.relative_to(folder).as_posix()}"


def _files(folder: Path) -> Iterator[_DescriptionFile]:
    """Readable device files in ``folder``; all others are somebody else's."""
    for path in sorted(folder.rglob("*")):
        if path.suffix.lower() in _SUFFIXES:
            try:
                yield _DescriptionFile(path, read_device_file(path))
            except BridgeError:
                continue


def _says(node: FoundNode) -> str:
    numbers = (
        ("1000h", node.device_type),
        ("vendor", node.vendor),
        ("product", node.product),
        ("revision", node.revision),
        ("serial", node.serial),
    )
    told = ", ".join(f"{name} {number:X}h" for name, number in numbers if number is not None)
    return f"node {node.id}, {told}" if told else f"node {node.id}"


def _written(folder: Path, derived: Derived) -> Family:
    path = folder / f"{derived.name}.toml"
    _write(path, derived.text)
    return read_family(path, (folder, mappings_dir()))


def _write(path: Path, text: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8") as out:
            out.write(text)
    except FileExistsError:
        raise OperationFailed(f"{path} is there already") from None
    except OSError as error:
        raise OperationFailed(f"{path} cannot be written: {error.strerror}") from error
