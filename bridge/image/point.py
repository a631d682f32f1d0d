"""A point: one value that a user can see, defined in one place."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from bridge.canopen.datatypes import INTEGERS
from bridge.text import Words

Value = bool | int | float | str


class DataType(StrEnum):
    BOOL = "bool"
    UINT8 = "uint8"
    UINT16 = "uint16"
    UINT32 = "uint32"
    INT16 = "int16"
    INT32 = "int32"
    FLOAT = "float"
    STRING = "string"

    @property
    def is_integer(self) -> bool:
        return self in INTEGERS and self is not DataType.BOOL

    @property
    def zero(self) -> Value:
        """The value of a point that has never had one."""
        if self is DataType.STRING:
            return ""
        if self is DataType.BOOL:
            return False
        return 0.0 if self is DataType.FLOAT else 0


class WriteKind(StrEnum):
    """Kinds of requests that writes of points are."""

    TELEGRAM = "telegram"
    """With others of its drive."""
    PARAMETER = "parameter"
    TIMEOUT = "timeout"


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """Name and nature of one value; the value itself is in the image.

    ``name`` is the full name, ``<node>/<drive>/<group>/<leaf>`` for what belongs to a drive. ``low``
    and ``high`` are in ``unit``. ``write`` is what a write of it is, where it is ``writable``. ``states`` are
    the codes of an enumeration with their text; one with ``low`` and ``high`` may have other codes between
    them, too. ``bits`` are the names of a word's bits from bit 0 on ("" where a bit has no meaning).
    ``added`` is the number of the addition by which the point came, 0 for the first points: registers, which
    are in the order of the points, put those of each addition behind all before, so that none of these moves.
    """

    name: str
    data_type: DataType
    unit: str = ""
    low: float | None = None
    high: float | None = None
    writable: bool = False
    write: WriteKind = WriteKind.TELEGRAM
    description: Words = ""
    states: tuple[tuple[int, Words], ...] = ()
    bits: tuple[str, ...] = ()
    added: int = 0

    @property
    def path(self) -> tuple[str, ...]:
        return tuple(self.name.split("/"))

    @property
    def leaf(self) -> str:
        return self.name.rpartition("/")[2]
