"""Objects of PDOs in a downloaded configuration: a DCF lists them, the order is CiA 301's.

A DCF has the values that differ from the device's defaults, so a mapping may come without its sub-index 0
or with some of its entries; what is not listed stays.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import Final

from bridge.canopen.dialogue import optional
from bridge.config.download import Download
from bridge.node.boot.actions import U8, Action, number, same
from bridge.node.boot.error_status import BootError
from bridge.node.boot.memory import BootMemory
from bridge.node.boot.pdo_settings import FIXED_BITS, Change, NotTaken, PdoObjects, write_pdo

_PDOS: Final = (range(0x1400, 0x1800), range(0x1800, 0x1C00))
_MAPPING: Final = 0x0200
"""Offset of a mapping object from its communication object."""


def is_pdo(index: int) -> bool:
    """Whether the object sets a PDO: 14xxh…17xxh and 18xxh…1Bxxh."""
    return any(index in indices for indices in _PDOS)


def pdo_parameter(index: int) -> int:
    """Communication object of the PDO that an object belongs to."""
    return index & ~_MAPPING


def download_pdo(downloads: Sequence[Download], memory: BootMemory) -> Generator[Action, bytes | None, int]:
    """Download the objects of one PDO, only if one differs; returns how many did. Raises BootError J."""
    parameter = pdo_parameter(downloads[0].index)
    objects = PdoObjects(parameter, parameter + _MAPPING, 0)
    wanted = {
        (one.index, one.sub): Change(one.index, one.sub, len(one.data), number(one.data)) for one in downloads
    }
    different = 0
    for one in downloads:
        have = yield from optional(one.index, one.sub)
        if (one.index, one.sub) == (parameter, 1):
            different += have is None or bool((number(have) ^ number(one.data)) & ~FIXED_BITS)
        else:
            different += not same(have, one.data)
    if not different:
        return 0
    have_id = number((yield from optional(parameter, 1)))
    want_id = wanted.pop((parameter, 1), None)
    count = wanted.pop((objects.mapping, 0), None)
    mapped = [change for change in wanted.values() if change.index == objects.mapping]
    # Sub-index 0 of a communication object says how many there are: nothing to be set.
    changes = [change for change in wanted.values() if change.index == parameter and change.sub]
    entries = number((yield from optional(objects.mapping, 0)), size=U8) if count is None else count.value
    if count is not None and not mapped:
        mapped = [count]
    memory.unsaved = True
    target_id = have_id if want_id is None else want_id.value
    try:
        yield from write_pdo(objects, have_id, target_id, mapped, entries, changes, memory)
    except NotTaken as error:
        raise BootError("J", error.what) from None
    return different
