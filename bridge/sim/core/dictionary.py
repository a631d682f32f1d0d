"""The object dictionary of a simulated node.

An entry does not store its value: it reads and writes through functions, so that one value under several
indices (such as NORD's P161 and 1400h:1) is always the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from enum import Enum
from typing import Final, Protocol

from bridge.sim.core.sdo_abort import AbortCode, SdoAbort

DUMMY_BITS: Final = {2: 8, 3: 16, 4: 32, 5: 8, 6: 16, 7: 32}
"""Objects 0002h…0007h may fill a gap in an RPDO; value: their length in bits (CiA 301 §7.4.7)."""


class IntegerType(Enum):
    """Integer types with their length in bytes and sign. Simulated reals are their bit patterns."""

    UNSIGNED8 = (1, False)
    UNSIGNED16 = (2, False)
    UNSIGNED32 = (4, False)
    INTEGER8 = (1, True)
    INTEGER16 = (2, True)
    INTEGER32 = (4, True)
    UNSIGNED24 = (3, False)
    UNSIGNED40 = (5, False)
    UNSIGNED48 = (6, False)
    UNSIGNED56 = (7, False)
    UNSIGNED64 = (8, False)
    INTEGER24 = (3, True)
    INTEGER40 = (5, True)
    INTEGER48 = (6, True)
    INTEGER56 = (7, True)
    INTEGER64 = (8, True)

    def __init__(self, size: int, signed: bool) -> None:
        self.size = size
        self.signed = signed

    def encode(self, value: int) -> bytes:
        """``value`` as little-endian bytes; a value beyond the type wraps as it would in a register."""
        return (value & ((1 << 8 * self.size) - 1)).to_bytes(self.size, "little")

    def decode(self, data: bytes) -> int:
        return int.from_bytes(data, "little", signed=self.signed)


@dataclass(slots=True)
class Cell:
    """A plain variable behind an entry."""

    value: int = 0

    def get(self) -> int:
        return self.value

    def set(self, value: int) -> None:
        self.value = value


@dataclass(frozen=True, slots=True)
class Number:
    """An integer object. No ``read`` makes it write-only, no ``write`` read-only.

    ``write`` raises ``SdoAbort`` to refuse a value, and must have changed nothing then.
    """

    data_type: IntegerType
    read: Callable[[], int] | None
    write: Callable[[int], None] | None = None
    low: int | None = None
    high: int | None = None
    in_rpdo: bool = False
    in_tpdo: bool = False

    @property
    def max_size(self) -> int:
        return self.data_type.size

    @property
    def limits(self) -> tuple[int, int]:
        """The least and the greatest value: its own limits, or those of its type."""
        bits = 8 * self.data_type.size
        low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if self.data_type.signed else (0, (1 << bits) - 1)
        return (low if self.low is None else self.low, high if self.high is None else self.high)

    def upload(self) -> bytes:
        if self.read is None:
            raise SdoAbort(AbortCode.WRITE_ONLY)
        return self.data_type.encode(self.read())

    def check_writable(self) -> None:
        if self.write is None:
            raise SdoAbort(AbortCode.READ_ONLY)

    def download(self, data: bytes) -> None:
        if self.write is None:
            raise SdoAbort(AbortCode.READ_ONLY)
        if len(data) > self.data_type.size:
            raise SdoAbort(AbortCode.LENGTH_TOO_HIGH)
        if len(data) < self.data_type.size:
            raise SdoAbort(AbortCode.LENGTH_TOO_LOW)
        value = self.data_type.decode(data)
        if (self.low is not None and value < self.low) or (self.high is not None and value > self.high):
            raise SdoAbort(AbortCode.VALUE_RANGE)
        self.write(value)


@dataclass(frozen=True, slots=True)
class VisibleString:
    """A VISIBLE_STRING, read-only. It maps into no PDO."""

    text: str
    in_rpdo: bool = field(default=False, init=False)
    in_tpdo: bool = field(default=False, init=False)

    @property
    def max_size(self) -> int:
        return 0

    def upload(self) -> bytes:
        return self.text.encode("ascii")

    def check_writable(self) -> None:
        raise SdoAbort(AbortCode.READ_ONLY)

    def download(self, data: bytes) -> None:
        del data
        self.check_writable()


@dataclass(frozen=True, slots=True)
class Domain:
    """A DOMAIN: bytes of any length up to ``max_size``. It maps into no PDO."""

    max_size: int
    read: Callable[[], bytes]
    write: Callable[[bytes], None]
    in_rpdo: bool = field(default=False, init=False)
    in_tpdo: bool = field(default=False, init=False)

    def upload(self) -> bytes:
        return self.read()

    def check_writable(self) -> None:
        """It is always writable."""

    def download(self, data: bytes) -> None:
        if len(data) > self.max_size:
            raise SdoAbort(AbortCode.LENGTH_TOO_HIGH)
        self.write(data)


Entry = Number | VisibleString | Domain


class ServedObject(Protocol):
    """An object as an SDO server has it. All of its methods raise ``SdoAbort``."""

    @property
    def max_size(self) -> int: ...

    def upload(self) -> bytes: ...

    def check_writable(self) -> None: ...

    def download(self, data: bytes) -> None: ...


class ServedObjects(Protocol):
    """Objects as an SDO server needs them."""

    def find(self, index: int, sub: int) -> ServedObject: ...


class ObjectAccess(Protocol):
    """A dictionary, or what stands before one."""

    def has_object(self, index: int) -> bool: ...

    def find(self, index: int, sub: int) -> Entry: ...


class Dictionary:
    """Objects by index and sub-index."""

    def __init__(self) -> None:
        self._objects: dict[int, dict[int, Entry]] = {}

    def add(self, index: int, sub: int, entry: Entry) -> None:
        self._objects.setdefault(index, {})[sub] = entry

    def add_array(self, index: int, entries: Iterable[Entry]) -> None:
        """Sub 0 is their number; the entries begin at sub 1."""
        count = 0
        for sub, entry in enumerate(entries, start=1):
            self.add(index, sub, entry)
            count = sub
        self.add(index, 0, constant(IntegerType.UNSIGNED8, count))

    def has_object(self, index: int) -> bool:
        return index in self._objects

    def find(self, index: int, sub: int) -> Entry:
        """The entry. Raises ``SdoAbort``, which says whether the object or only the sub-index is missing."""
        subs = self._objects.get(index)
        if subs is None:
            raise SdoAbort(AbortCode.OBJECT_MISSING)
        entry = subs.get(sub)
        if entry is None:
            raise SdoAbort(AbortCode.SUBINDEX_MISSING)
        return entry


def variable(
    data_type: IntegerType,
    holder: Callable[[], object],
    name: str,
    low: int | None = None,
    high: int | None = None,
    *,
    in_pdos: bool = False,
) -> Number:
    """The attribute ``name`` of what ``holder`` returns at each access."""

    def read() -> int:
        value: int = getattr(holder(), name)
        return value

    def write(value: int) -> None:
        setattr(holder(), name, value)

    return Number(data_type, read, write, low, high, in_rpdo=in_pdos, in_tpdo=in_pdos)


def item(
    data_type: IntegerType,
    values: Callable[[], list[int] | dict[int, int]],
    place: int,
    low: int | None = None,
    high: int | None = None,
) -> Number:
    """One of the numbers that ``values`` returns at each access."""

    def write(value: int) -> None:
        values()[place] = value

    return Number(data_type, lambda: values()[place], write, low, high)


def constant(data_type: IntegerType, value: int) -> Number:
    """A read-only number that never changes."""
    return Number(data_type, lambda: value)
