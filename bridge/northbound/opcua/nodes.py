"""The layout: from a list of points to a tree of node descriptions. Knows nothing of the server.

A node that stands for a point has the point's full name as its id. Every other id is its parent's
followed by a PascalCase name, so it can never be that of a point, whose names are lower_snake_case.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from bridge.command.request import Action
from bridge.image import Point

GROUPS: Final = ("command", "status", "actual", "parameter", "supervision", "identity")
"""Every drive has these folders, whether or not they hold a point."""


class VariableKind(Enum):
    PLAIN = "BaseDataVariableType"
    ANALOG = "AnalogUnitType"
    MULTI_STATE = "MultiStateDiscreteType"
    TWO_STATE = "TwoStateDiscreteType"


class ArgumentType(Enum):
    """Types of method arguments; integers with the range of their values."""

    INT32 = (-0x8000_0000, 0x7FFF_FFFF)
    UINT32 = (0, 0xFFFF_FFFF)
    STRING = "string"
    ANY = "any"
    """A number, a text, true or false."""


@dataclass(frozen=True, slots=True)
class Argument:
    name: str
    type: ArgumentType
    description: str


@dataclass(frozen=True, slots=True)
class MethodNode:
    """``target`` is the drive, node or bus that ``action`` is done to."""

    id: str
    browse_name: str
    action: Action
    target: str
    description: str
    arguments: tuple[Argument, ...] = ()
    results: tuple[Argument, ...] = ()


@dataclass(frozen=True, slots=True)
class VariableNode:
    """A point, or with ``bit`` one bit of it. ``index`` is the point's place in the image."""

    id: str
    browse_name: str
    kind: VariableKind
    point: Point
    index: int
    bit: int | None = None
    bits: tuple[VariableNode, ...] = ()

    @property
    def writable(self) -> bool:
        return self.bit is None and self.point.writable


@dataclass(frozen=True, slots=True)
class ObjectNode:
    """A folder or an object. ``notifier`` is true where events are sent from it."""

    id: str
    browse_name: str
    folder: bool = True
    notifier: bool = False
    objects: tuple[ObjectNode, ...] = ()
    variables: tuple[VariableNode, ...] = ()
    methods: tuple[MethodNode, ...] = ()


_DIRECTION: Final = Argument("direction", ArgumentType.INT32, "1 forward, -1 reverse, 0 as the drive is set")
_TTL: Final = Argument("ttl_ms", ArgumentType.UINT32, "length of the lease in ms")

_PARAMETER: Final = Argument(
    "name", ArgumentType.STRING, "as the vendor calls it, such as P102[2], or an object such as 2066:01"
)
_VALUE: Final = Argument("value", ArgumentType.ANY, "in the parameter's unit")

_Methods = Sequence[tuple[Action, tuple[Argument, ...], tuple[Argument, ...], str]]

_DRIVE_METHODS: Final[_Methods] = (
    (Action.START, (_DIRECTION,), (), "through the drive's states to operation enabled; takes up to 3 s"),
    (Action.STOP, (), (), "ramp down, then no voltage"),
    (Action.QUICK_STOP, (), (), "quick stop ramp, then no voltage"),
    (Action.DISABLE_VOLTAGE, (), (), "no voltage at once: the drive coasts"),
    (Action.RESET_FAULT, (), (), "acknowledge a fault or a watchdog trip; the drive stays stopped"),
    (Action.TAKE_CONTROL, (_TTL,), (), "become the controller of the drive"),
    (Action.RELEASE_CONTROL, (), (), "give control back; a running drive is stopped"),
    (Action.KEEP_ALIVE, (), (), "a telegram without a command: restarts the watchdog's timer"),
    (Action.READ_PARAMETER, (_PARAMETER,), (_VALUE,), "read a parameter from the drive"),
    (Action.WRITE_PARAMETER, (_PARAMETER, _VALUE), (), "write a parameter and read it back; for engineers"),
    (Action.SAVE_PARAMETERS, (), (), "keep the node's parameters in its EEPROM; for engineers"),
)
_NODE_METHODS: Final[_Methods] = (
    (Action.RESET, (), (), "NMT reset node"),
    (Action.RESET_COMMUNICATION, (), (), "NMT reset communication"),
    (Action.START_NODE, (), (), "NMT start: the node is checked first"),
    (Action.STOP_NODE, (), (), "NMT stop; the node stays stopped until it is started or starts again"),
    (Action.ENTER_PRE_OPERATIONAL, (), (), "NMT enter pre-operational; the node stays there"),
    (Action.ENABLE, (), (), "put the node in service"),
    (Action.DISABLE, (), (), "take the node out of service"),
)
_BUS_METHODS: Final[_Methods] = (
    (Action.RESET, (), (), "NMT reset node to all nodes"),
    (Action.RESET_COMMUNICATION, (), (), "NMT reset communication to all nodes"),
    (Action.START_NODE, (), (), "NMT start for every node of the site file, each checked first"),
    (Action.STOP_NODE, (), (), "NMT stop to all nodes"),
    (Action.ENTER_PRE_OPERATIONAL, (), (), "NMT enter pre-operational to all nodes"),
)


def pascal_case(name: str) -> str:
    """``worst_case_stop_ms`` as ``WorstCaseStopMs``."""
    return "".join(word[:1].upper() + word[1:] for word in name.split("_"))


@dataclass(slots=True)
class _Branch:
    """One object while the tree grows."""

    id: str
    browse_name: str
    folder: bool = True
    notifier: bool = False
    branches: dict[str, _Branch] = field(default_factory=dict[str, "_Branch"])
    variables: list[VariableNode] = field(default_factory=list[VariableNode])
    methods: tuple[MethodNode, ...] = ()

    def branch(self, name: str, make: Callable[[], _Branch]) -> _Branch:
        found = self.branches.get(name)
        if found is None:
            found = self.branches[name] = make()
        return found

    def folder_below(self, name: str) -> _Branch:
        return self.branch(name, lambda: _Branch(f"{self.id}/{name}", pascal_case(name)))

    def finish(self) -> ObjectNode:
        return ObjectNode(
            self.id,
            self.browse_name,
            self.folder,
            self.notifier,
            tuple(branch.finish() for branch in self.branches.values()),
            tuple(self.variables),
            self.methods,
        )


def layout(points: Sequence[Point]) -> tuple[ObjectNode, ObjectNode, ObjectNode]:
    """The folders ``Drives``, ``Buses`` and the object ``Bridge`` with everything below them.

    Nodes, drives and buses are called as the site file calls them; all other BrowseNames are
    PascalCase. Raises ValueError for a point that has no place here.
    """
    drives = _Branch("Drives", "Drives")
    buses = _Branch("Buses", "Buses")
    bridge = _Branch("bridge", "Bridge", folder=False, notifier=True)
    for index, point in enumerate(points):
        match point.path:
            case ("bridge", *rest) if rest:
                home = bridge
            case ("bus", name, *rest) if rest:
                home = _bus(buses, name)
            case (name, "node", *rest) if rest:
                home = _node(drives, name).folder_below("node")
            case (name, drive, *rest) if len(rest) > 1 and rest[0] in GROUPS:
                home = _drive(_node(drives, name), drive)
            case _:
                raise ValueError(f"the point {point.name!r} has no place in the address space")
        for name in rest[:-1]:
            home = home.folder_below(name)
        home.variables.append(_variable(point, index))
    return drives.finish(), buses.finish(), bridge.finish()


def _bus(buses: _Branch, name: str) -> _Branch:
    full = f"bus/{name}"
    return buses.branch(
        name,
        lambda: _Branch(full, name, folder=False, notifier=True, methods=_methods(full, _BUS_METHODS)),
    )


def _node(drives: _Branch, name: str) -> _Branch:
    def make() -> _Branch:
        node = _Branch(name, name, folder=False, notifier=True, methods=_methods(name, _NODE_METHODS))
        node.folder_below("node")
        return node

    return drives.branch(name, make)


def _drive(node: _Branch, name: str) -> _Branch:
    full = f"{node.id}/{name}"

    def make() -> _Branch:
        drive = _Branch(full, name, folder=False, notifier=True, methods=_methods(full, _DRIVE_METHODS))
        for group in GROUPS:
            drive.folder_below(group)
        return drive

    return node.branch(name, make)


def _methods(target: str, table: _Methods) -> tuple[MethodNode, ...]:
    return tuple(
        MethodNode(
            f"{target}/{pascal_case(action.value)}",
            pascal_case(action.value),
            action,
            target,
            description,
            arguments,
            results,
        )
        for action, arguments, results, description in table
    )


_MOST_STATES: Final = 256
"""EnumStrings is a list from code 0 on (Part 8 §5.3.3.3): for codes beyond this one it says nothing."""


def _variable(point: Point, index: int) -> VariableNode:
    kind = VariableKind.PLAIN
    if point.states and all(0 <= code < _MOST_STATES for code, _ in point.states):
        kind = VariableKind.MULTI_STATE
    elif point.unit:
        kind = VariableKind.ANALOG
    bits = tuple(
        VariableNode(
            f"{point.name}/{name}", pascal_case(name), VariableKind.TWO_STATE, point, index, bit=position
        )
        for position, name in enumerate(point.bits)
        if name
    )
    if len({bit.id for bit in bits}) != len(bits):
        raise ValueError(f"the point {point.name!r} has two bits of one name")
    return VariableNode(point.name, pascal_case(point.leaf), kind, point, index, bits=bits)


def enum_strings(states: Sequence[tuple[int, str]]) -> tuple[str, ...]:
    """EnumStrings of sparse codes: the index is the code, a code without a state is empty."""
    strings = [""] * (max(code for code, _ in states) + 1)
    for code, text in states:
        strings[code] = text
    return tuple(strings)
