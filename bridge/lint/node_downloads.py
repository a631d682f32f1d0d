"""Downloads to a node as numbers, each with its place in the site file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from bridge.canopen import cobid
from bridge.config import NodeTable
from bridge.config.download import Download
from bridge.mapping.alias_places import aliases
from bridge.mapping.model import Family
from bridge.tomlfile import Key

_EMCY: Final = 0x1014
_MOST_PDOS: Final = 512
_ENTRY_BITS: Final = 0xFF
_EXTENDED_ID: Final = cobid.PDO_EXTENDED | 0x1FFF_FFFF
RPDO: Final = (0x1400, 0x1600)
TPDO: Final = (0x1800, 0x1A00)
"""Index of the first communication and the first mapping object."""


@dataclass(frozen=True, slots=True)
class NodeDownload:
    """One object as it will be after all downloads. ``name``: the parameter that is written in its place,
    with its object, or empty."""

    value: int
    key: Key
    name: str = ""


class NodeDownloads:
    """All downloads of one node. If an object is written more than once, under whatever name, the last value
    counts."""

    def __init__(self, node: NodeTable, family: Family, key: Key, from_file: Sequence[Download]) -> None:
        """``from_file`` are the objects of the node's configuration file."""
        listed = [(one, (*key, "configuration")) for one in from_file]
        listed += [(one.download, (*key, "configure", c)) for c, one in enumerate(node.configure)]
        known = {(one.ref.index, one.ref.sub): one for one in aliases(family)}
        found: dict[tuple[int, int], NodeDownload] = {}
        self.related: dict[tuple[int, int], NodeDownload] = {}
        """Objects whose value a download decides in another form; the value is that of the download."""
        for one, where in listed:
            value = int.from_bytes(one.data, "little")
            found[one.index, one.sub] = NodeDownload(value, where)
            alias = known.get((one.index, one.sub))
            for ref in alias.objects if alias else ():
                setting = NodeDownload(value, where, f"{one.name} ({alias.name})" if alias else "")
                (found if alias and alias.is_same else self.related)[ref.index, ref.sub] = setting
        self._found: Mapping[tuple[int, int], NodeDownload] = found

    def __getitem__(self, place: tuple[int, int]) -> NodeDownload | None:
        """The value that ``index, sub`` will have; None if nothing sets it."""
        return self._found.get(place)

    def number(self, index: int, sub: int, default: int) -> int:
        found = self._found.get((index, sub))
        return default if found is None else found.value

    def of(self, index: int) -> Iterator[tuple[int, NodeDownload]]:
        """Settings of an object by sub-index."""
        for (one, sub), setting in self._found.items():
            if one == index:
                yield sub, setting

    @property
    def values(self) -> dict[tuple[int, int], int]:
        """All settings by index and sub-index."""
        return {place: setting.value for place, setting in self._found.items()}

    def pdos(self) -> Iterator[tuple[bool, int]]:
        """PDOs that are given a COB-ID: whether the node receives it, and its number."""
        for receives, (base, _) in ((True, RPDO), (False, TPDO)):
            for index, sub in self._found:
                if sub == 1 and base <= index < base + _MOST_PDOS:
                    yield receives, index - base + 1

    def mapped_bits(self, index: int, have: Sequence[int]) -> int:
        """The bits of a PDO with mapping object ``index``; ``have`` are those of the entries it has now."""
        count = self.number(index, 0, len(have))
        bits = [*have, *([0] * (count - len(have)))][:count]
        return sum(self.number(index, sub, old) & _ENTRY_BITS for sub, old in enumerate(bits, 1))

    def emcy_id(self, default: int) -> int | None:
        """The identifier of emergency messages, None where they are off; ``default`` is 1014h now."""
        value = self.number(_EMCY, 0, default)
        return None if value & cobid.PDO_DISABLED else value & cobid.COB_ID_MASK


def pdo_cob_id(value: int) -> int:
    """The identifier in sub-index 1 of a communication object; one with 29 bits keeps bit 29."""
    return value & (_EXTENDED_ID if value & cobid.PDO_EXTENDED else cobid.COB_ID_MASK)
