"""Sign and format of an object that no mapping file explains, by its data type in the device description."""

from __future__ import annotations

from typing import Final, NamedTuple

from bridge.eds import Description, StaticDataType

_SIGNED: Final = frozenset(
    (
        *(
            StaticDataType.INTEGER8,
            StaticDataType.INTEGER16,
            StaticDataType.INTEGER24,
            StaticDataType.INTEGER32,
        ),
        *(
            StaticDataType.INTEGER40,
            StaticDataType.INTEGER48,
            StaticDataType.INTEGER56,
            StaticDataType.INTEGER64,
        ),
    )
)
_REALS: Final = {StaticDataType.REAL32: 32, StaticDataType.REAL64: 64}


class ObjectFormat(NamedTuple):
    """Reading of the bits of an object; ``title`` is empty where nothing describes it."""

    is_signed: bool = False
    is_float: bool = False
    title: str = ""


def kind_of(description: Description | None, index: int, sub: int, bits: int) -> ObjectFormat:
    """The kind of an object that is mapped with so many ``bits``: part of a real number is none."""
    entry = description.entry(index, sub) if description else None
    if entry is None or entry.data_type is None:
        return ObjectFormat(title=entry.name if entry else "")
    is_float = _REALS.get(entry.data_type) == bits
    return ObjectFormat(entry.data_type in _SIGNED, is_float, entry.name)
