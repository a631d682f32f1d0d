"""Sign and format of an object that no mapping file explains, by its data type in the device description."""

from __future__ import annotations

from typing import Final, NamedTuple

from bridge.eds import DataType, Description

_SIGNED: Final = frozenset(
    (
        *(DataType.INTEGER8, DataType.INTEGER16, DataType.INTEGER24, DataType.INTEGER32),
        *(DataType.INTEGER40, DataType.INTEGER48, DataType.INTEGER56, DataType.INTEGER64),
    )
)
_REALS: Final = {DataType.REAL32: 32, DataType.REAL64: 64}


class Kind(NamedTuple):
    """Reading of the bits of an object; ``title`` is empty where nothing describes it."""

    is_signed: bool = False
    is_float: bool = False
    title: str = ""


def kind_of(description: Description | None, index: int, sub: int, bits: int) -> Kind:
    """The kind of an object that is mapped with so many ``bits``: part of a real number is none."""
    entry = description.entry(index, sub) if description else None
    if entry is None or entry.data_type is None:
        return Kind(title=entry.name if entry else "")
    is_float = _REALS.get(entry.data_type) == bits
    return Kind(entry.data_type in _SIGNED, is_float, entry.name)
