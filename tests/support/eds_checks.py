"""Checks of every EDS file of ours: another tool opens it, the simulated node has what it says."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import canopen

from bridge.eds import Description, Entry
from bridge.sim.core.dictionary import Number, VisibleString

Find = Callable[[int, int], object]
"""The simulated node's object of this index and subindex."""


def entries(description: Description) -> list[Entry]:
    return [entry for one in description.objects for entry in one.entries]


def open_with_canopen(file: Path, description: Description, node_id: int) -> canopen.ObjectDictionary:
    """Object dictionary that canopen reads from the file, after it was compared with what we read."""
    other = canopen.import_od(str(file), node_id)
    for one in description.objects:
        for entry in one.entries:
            member = other[one.index] if one.object_type == 7 else other[one.index][entry.sub]
            assert (member.data_type, member.access_type) == (entry.data_type, entry.access), one.name
    return other


def compare_types_and_access(listed: Iterable[Entry], find: Find, *, static: bool = False) -> int:
    """Number of compared entries. ``static``: what is mapped is fixed, nothing is said to be mappable."""
    checked = 0
    for entry in listed:
        node = find(entry.index, entry.sub)
        assert entry.data_type
        if isinstance(node, VisibleString):
            assert entry.data_type.name == "VISIBLE_STRING"
            continue
        assert isinstance(node, Number)
        assert node.data_type.name == entry.data_type.name, entry
        access = (entry.access.readable, entry.access.writable)
        assert (node.read is not None, node.write is not None) == access, entry
        assert static or (node.in_tpdo or node.in_rpdo) == entry.pdo_mappable, entry
        checked += 1
    return checked


def compare_defaults(listed: Iterable[Entry], find: Find, node_id: int) -> int:
    """Number of defaults that were compared with the answers of a fresh node."""
    checked = 0
    for entry in listed:
        if entry.default:
            node = find(entry.index, entry.sub)
            assert isinstance(node, Number)
            assert node.read
            assert node.read() == entry.default.at(node_id), entry
            checked += 1
    return checked
