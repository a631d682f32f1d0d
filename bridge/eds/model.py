"""The content of a device description, whatever its format."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum
from typing import Final

from bridge.text import Text


class StaticDataType(IntEnum):
    """Static data types by their index (CiA 301 §7.4.7, table 44)."""

    BOOLEAN = 0x01
    INTEGER8 = 0x02
    INTEGER16 = 0x03
    INTEGER32 = 0x04
    UNSIGNED8 = 0x05
    UNSIGNED16 = 0x06
    UNSIGNED32 = 0x07
    REAL32 = 0x08
    VISIBLE_STRING = 0x09
    OCTET_STRING = 0x0A
    UNICODE_STRING = 0x0B
    TIME_OF_DAY = 0x0C
    TIME_DIFFERENCE = 0x0D
    DOMAIN = 0x0F
    INTEGER24 = 0x10
    REAL64 = 0x11
    INTEGER40 = 0x12
    INTEGER48 = 0x13
    INTEGER56 = 0x14
    INTEGER64 = 0x15
    UNSIGNED24 = 0x16
    UNSIGNED40 = 0x18
    UNSIGNED48 = 0x19
    UNSIGNED56 = 0x1A
    UNSIGNED64 = 0x1B


class ObjectType(IntEnum):
    """CiA 301 §7.4.3, table 42."""

    NULL = 0x0
    DOMAIN = 0x2
    DEFTYPE = 0x5
    DEFSTRUCT = 0x6
    VAR = 0x7
    ARRAY = 0x8
    RECORD = 0x9

    @property
    def has_subs(self) -> bool:
        return self in (ObjectType.DEFSTRUCT, ObjectType.ARRAY, ObjectType.RECORD)


class Access(StrEnum):
    """``RWR`` can be mapped into a TPDO, ``RWW`` into an RPDO (CiA 306 §4.6.3.2)."""

    RO = "ro"
    WO = "wo"
    RW = "rw"
    RWR = "rwr"
    RWW = "rww"
    CONST = "const"

    @property
    def readable(self) -> bool:
        return self is not Access.WO

    @property
    def writable(self) -> bool:
        return self not in (Access.RO, Access.CONST)


class FindingSeverity(StrEnum):
    ERROR = "error"
    """Something could not be read and was left out."""
    WARNING = "warning"
    """Something differs from the standard; the text says how it was understood."""


@dataclass(frozen=True, slots=True)
class Finding:
    """An oddity of a file. ``line`` counts from 1; 0 means the file as a whole."""

    line: int
    severity: FindingSeverity
    said: Text

    def __str__(self) -> str:
        place = f"line {self.line}: " if self.line else ""
        return f"{self.severity}: {place}{self.said}"


Plain = int | float | str | bytes


@dataclass(frozen=True, slots=True)
class Value:
    """A value of the file. With ``plus_node_id`` the node id has to be added to it."""

    plain: Plain
    plus_node_id: bool = False

    def at(self, node_id: int | None) -> Plain | None:
        """The value on the node ``node_id``; None if it depends on the node id and that is unknown."""
        if not self.plus_node_id or not isinstance(self.plain, int):
            return self.plain
        return None if node_id is None else self.plain + node_id

    def __str__(self) -> str:
        if isinstance(self.plain, bytes):
            return self.plain.hex(" ")
        if self.plus_node_id and isinstance(self.plain, int):
            return f"$NODEID+0x{self.plain:X}" if self.plain >= 0 else f"$NODEID-0x{-self.plain:X}"
        return str(self.plain)


@dataclass(frozen=True, slots=True)
class Entry:
    """One index and sub-index. ``data_type`` is None if the file does not say or we do not know it.

    ``parameter_value`` is what a DCF or XDC configures; ``refuses_download`` is bit 0 of ObjFlags.
    """

    index: int
    sub: int
    name: str
    data_type: StaticDataType | None
    access: Access
    default: Value | None = None
    parameter_value: Value | None = None
    low: Value | None = None
    high: Value | None = None
    pdo_mappable: bool = False
    refuses_download: bool = False
    line: int = 0

    @property
    def current(self) -> Value | None:
        """The node's value once it is configured by this file."""
        return self.default if self.parameter_value is None else self.parameter_value


def count_entry(index: int, highest: int, line: int, access: Access = Access.RO) -> Entry:
    """Sub-index 0."""
    name = "Highest sub-index supported"
    return Entry(index, 0, name, StaticDataType.UNSIGNED8, access, default=Value(highest), line=line)


@dataclass(frozen=True, slots=True)
class Object:
    """All entries of one index, by sub-index."""

    index: int
    name: str
    object_type: ObjectType
    entries: tuple[Entry, ...]

    def entry(self, sub: int) -> Entry | None:
        for entry in self.entries:
            if entry.sub == sub:
                return entry
        return None


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """Vendor and product, as in [DeviceInfo] of an EDS (CiA 306) or DeviceIdentity of an XDD (CiA 311).
    Numbers are None and texts empty if the file does not say."""

    vendor: str = ""
    vendor_id: int | None = None
    product: str = ""
    product_code: int | None = None
    revision: int | None = None
    order_code: str = ""
    bitrates: tuple[int, ...] = ()
    """Bit rates in bit/s."""


@dataclass(frozen=True, slots=True)
class Module:
    """A module that a modular device may have plugged in; ``number`` is that of the file."""

    number: int
    product: str = ""
    order_code: str = ""

    def __str__(self) -> str:
        names = ", ".join(name for name in (self.order_code, self.product) if name)
        return f"{self.number} ({names})" if names else f"{self.number}"


@dataclass(frozen=True, slots=True)
class Commissioning:
    """The node that a DCF or XDC is for."""

    node_id: int | None = None
    node_name: str = ""
    bitrate: int | None = None
    """Bit rate in bit/s."""


@dataclass(frozen=True, slots=True)
class Description:
    """A whole file: the device, its objects by index, and the oddities found. ``modules`` are those that it
    knows, ``plugged`` the numbers of those whose objects are here, and ``extended`` their elements of shared
    objects, by index and sub-index."""

    format: str
    device_info: DeviceInfo = field(default_factory=DeviceInfo)
    commissioning: Commissioning = field(default_factory=Commissioning)
    objects: tuple[Object, ...] = ()
    findings: tuple[Finding, ...] = ()
    modules: tuple[Module, ...] = ()
    plugged: tuple[int, ...] = ()
    extended: frozenset[tuple[int, int]] = frozenset()
    broken_off_at: int | None = None
    """The line in which the file ends before it is complete."""

    def object(self, index: int) -> Object | None:
        place = bisect_left(self.objects, index, key=lambda one: one.index)
        found = self.objects[place] if place < len(self.objects) else None
        return found if found and found.index == index else None

    def entry(self, index: int, sub: int = 0) -> Entry | None:
        found = self.object(index)
        return found.entry(sub) if found else None

    def number(self, index: int, sub: int = 0, node_id: int | None = None) -> int | None:
        """The integer that the object holds as configured by this file, or None."""
        entry = self.entry(index, sub)
        value = entry.current.at(node_id) if entry and entry.current else None
        return value if isinstance(value, int) else None


class Report:
    """Collects findings; beyond ``most`` they are only counted."""

    most: Final = 500

    def __init__(self) -> None:
        self._findings: list[Finding] = []
        self._more = 0
        self.broken_off_at: int | None = None

    def error(self, line: int, said: Text) -> None:
        self._add(Finding(line, FindingSeverity.ERROR, said))

    def breaks_off(self, line: int, said: Text) -> None:
        """Report that the file has been lost from behind ``line`` on."""
        self.broken_off_at = line
        self.error(line, said)

    def warning(self, line: int, said: Text) -> None:
        self._add(Finding(line, FindingSeverity.WARNING, said))

    def _add(self, finding: Finding) -> None:
        if len(self._findings) < self.most:
            self._findings.append(finding)
        else:
            self._more += 1

    def findings(self) -> tuple[Finding, ...]:
        """Findings in the order of the file."""
        found = sorted(self._findings, key=lambda finding: finding.line)
        if self._more:
            found.append(Finding(0, FindingSeverity.WARNING, Text.of("eds.more", count=self._more)))
        return tuple(found)
