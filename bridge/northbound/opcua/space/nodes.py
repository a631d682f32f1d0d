"""The layout: from a list of points to a tree of node descriptions. Knows nothing of the server.

A node that stands for a point has the point's full name as its id. Every other id is its parent's
followed by a PascalCase name, so it can never be that of a point, whose names are lower_snake_case.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cache
from typing import Final, NamedTuple

from bridge.command.messages.request import Action
from bridge.image import Point
from bridge.text import Text, Words

GROUPS: Final = ("command", "status", "actual", "parameter", "supervision", "identity")
"""Folders that every drive has, whether or not they hold a point."""

DEVICE_GROUPS: Final = ("input", "output", "parameter", "supervision")
"""Folders of a node that is no drive, beside ``node``."""
_TELEGRAM_GROUPS: Final = ("command", "output")
"""Groups whose points are written in telegrams: with their bits."""
_IN_DEVICE: Final = 3
"""Words in the name of a point in one of these groups."""


class VariableKind(Enum):
    PLAIN = "BaseDataVariableType"
    ANALOG = "AnalogUnitType"
    MULTI_STATE = "MultiStateDiscreteType"
    MULTI_STATE_VALUE = "MultiStateValueDiscreteType"
    """With codes that are negative, too large for a list of texts, or without one."""
    TWO_STATE = "TwoStateDiscreteType"


class ArgumentType(Enum):
    """Types of method arguments; integers with the range of their values."""

    INT32 = (-0x8000_0000, 0x7FFF_FFFF)
    UINT32 = (0, 0xFFFF_FFFF)
    STRING = "string"
    TEXT = "text"
    """A text for people, in the client's language."""
    ANY = "any"
    """A number, a text, true or false."""


@dataclass(frozen=True, slots=True)
class Argument:
    name: str
    type: ArgumentType
    description: Text


@dataclass(frozen=True, slots=True)
class MethodNode:
    """A method. ``target`` is the drive, node or bus that ``action`` is done to."""

    id: str
    browse_name: str
    action: Action
    target: str
    description: Text
    arguments: tuple[Argument, ...] = ()
    results: tuple[Argument, ...] = ()


@dataclass(frozen=True, slots=True)
class VariableNode:
    """A point, or with ``bit`` one bit of it. ``index`` is the point's place in the image. ``kept``: its past
    values are."""

    id: str
    browse_name: str
    kind: VariableKind
    point: Point
    index: int
    bit: int | None = None
    bits: tuple[VariableNode, ...] = ()
    kept: bool = False

    @property
    def writable(self) -> bool:
        return self.point.writable and (self.bit is None or self.point.path[-2] in _TELEGRAM_GROUPS)


class LiveType(Enum):
    """Types of values that are neither a point's nor always the same."""

    BOOLEAN = "Boolean"
    UINT16 = "UInt16"
    UINT64 = "UInt64"
    STRING = "String"
    DATE_TIME = "DateTime"


@dataclass(frozen=True, slots=True)
class LiveProperty:
    """A property that changes while the server runs. ``standard``: its name is the standard's."""

    id: str
    browse_name: str
    type: LiveType
    standard: bool = True


@dataclass(frozen=True, slots=True)
class FileNode:
    """A file that clients may read (FileType, OPC 10000-20 §4.2): black box of ``drive`` with this number."""

    drive: str
    number: int

    @property
    def id(self) -> str:
        return black_box_id(self.drive, self.number)

    @property
    def browse_name(self) -> str:
        return str(self.number)

    @property
    def properties(self) -> tuple[LiveProperty, ...]:
        return tuple(
            LiveProperty(f"{self.id}/{name}", name, kind, standard)
            for name, kind, standard in _FILE_PROPERTIES
        )


_FILE_PROPERTIES: Final = (
    ("Size", LiveType.UINT64, True),
    ("Writable", LiveType.BOOLEAN, True),
    ("UserWritable", LiveType.BOOLEAN, True),
    ("OpenCount", LiveType.UINT16, True),
    ("MimeType", LiveType.STRING, True),
    ("TripTime", LiveType.DATE_TIME, False),
)


@dataclass(slots=True)
class ObjectNode:
    """A folder or an object. ``notifier`` is true where events are sent from it."""

    id: str
    browse_name: str
    folder: bool = True
    notifier: bool = False
    methods: tuple[MethodNode, ...] = ()
    files: tuple[FileNode, ...] = ()
    variables: list[VariableNode] = field(default_factory=list[VariableNode])
    _below: dict[str, ObjectNode] = field(default_factory=dict[str, "ObjectNode"])

    @property
    def objects(self) -> tuple[ObjectNode, ...]:
        return tuple(self._below.values())

    def below(self, name: str, make: Callable[[], ObjectNode]) -> ObjectNode:
        """The object of this name, which is made where there is none."""
        if name not in self._below:
            self._below[name] = make()
        return self._below[name]

    def folder_below(self, name: str) -> ObjectNode:
        return self.below(name, lambda: ObjectNode(f"{self.id}/{name}", pascal_case(name)))


_DIRECTION: Final = Argument("direction", ArgumentType.INT32, Text.of("method.direction"))
_TTL: Final = Argument("ttl_ms", ArgumentType.UINT32, Text.of("method.ttl"))

_PARAMETER: Final = Argument("name", ArgumentType.STRING, Text.of("method.parameter"))
_VALUE: Final = Argument("value", ArgumentType.ANY, Text.of("method.value"))
EXPECTED: Final = Argument("expected", ArgumentType.ANY, Text.of("method.expected"))

OUTCOME: Final = Argument("outcome", ArgumentType.TEXT, Text.of("method.outcome"))
"""Output argument of each method that has no other."""


class _Method(NamedTuple):
    """``name`` is its BrowseName where that does not follow from the action."""

    action: Action
    arguments: tuple[Argument, ...]
    results: tuple[Argument, ...]
    description: Text
    name: str = ""


_Methods = Sequence[_Method]

_PARAMETER_METHODS: Final[_Methods] = (
    _Method(Action.READ_PARAMETER, (_PARAMETER,), (_VALUE,), Text.of("method.read_parameter")),
    _Method(Action.WRITE_PARAMETER, (_PARAMETER, _VALUE), (), Text.of("method.write_parameter")),
    _Method(
        Action.WRITE_PARAMETER,
        (_PARAMETER, EXPECTED, _VALUE),
        (),
        Text.of("method.write_parameter_if"),
        "WriteParameterIf",
    ),
    _Method(Action.SAVE_PARAMETERS, (), (), Text.of("method.save_parameters")),
)
_DRIVE_METHODS: Final[_Methods] = (
    _Method(Action.START, (_DIRECTION,), (), Text.of("method.start")),
    _Method(Action.STOP, (), (), Text.of("method.stop")),
    _Method(Action.QUICK_STOP, (), (), Text.of("method.quick_stop")),
    _Method(Action.DISABLE_VOLTAGE, (), (), Text.of("method.disable_voltage")),
    _Method(Action.RESET_FAULT, (), (), Text.of("method.reset_fault")),
    _Method(Action.TAKE_CONTROL, (_TTL,), (), Text.of("method.take_control")),
    _Method(Action.RELEASE_CONTROL, (), (), Text.of("method.release_control")),
    _Method(Action.KEEP_ALIVE, (), (), Text.of("method.keep_alive")),
    *_PARAMETER_METHODS,
)
_NODE_METHODS: Final[_Methods] = (
    _Method(Action.RESET, (), (), Text.of("method.reset")),
    _Method(Action.RESET_COMMUNICATION, (), (), Text.of("method.reset_communication")),
    _Method(Action.START_NODE, (), (), Text.of("method.start_node")),
    _Method(Action.STOP_NODE, (), (), Text.of("method.stop_node")),
    _Method(Action.ENTER_PRE_OPERATIONAL, (), (), Text.of("method.enter_pre_operational")),
    _Method(Action.ENABLE, (), (), Text.of("method.enable")),
    _Method(Action.DISABLE, (), (), Text.of("method.disable")),
)
_DEVICE_METHODS: Final[_Methods] = (*_NODE_METHODS, *_PARAMETER_METHODS)
"""Methods of a node that is no drive."""
_OUTPUT_METHODS: Final[_Methods] = (
    _Method(Action.STOP, (), (), Text.of("method.outputs_stop")),
    _Method(Action.RESET_FAULT, (), (), Text.of("method.outputs_reset_fault")),
    _Method(Action.TAKE_CONTROL, (_TTL,), (), Text.of("method.outputs_take_control")),
    _Method(Action.RELEASE_CONTROL, (), (), Text.of("method.outputs_release_control")),
    _Method(Action.KEEP_ALIVE, (), (), Text.of("method.outputs_keep_alive")),
    *_DEVICE_METHODS,
)
"""Methods of a node that is no drive and has outputs."""
_BUS_METHODS: Final[_Methods] = (
    _Method(Action.RESET, (), (), Text.of("method.bus_reset")),
    _Method(Action.RESET_COMMUNICATION, (), (), Text.of("method.bus_reset_communication")),
    _Method(Action.START_NODE, (), (), Text.of("method.bus_start_node")),
    _Method(Action.STOP_NODE, (), (), Text.of("method.bus_stop_node")),
    _Method(Action.ENTER_PRE_OPERATIONAL, (), (), Text.of("method.bus_enter_pre_operational")),
)


@cache
def pascal_case(name: str) -> str:
    """``worst_case_stop_ms`` as ``WorstCaseStopMs``."""
    return "".join(word[:1].upper() + word[1:] for word in name.split("_"))


BLACK_BOX: Final = "BlackBox"


def black_box_id(drive: str, number: int) -> str:
    """Id of one of a drive's files, the newest of which is 1."""
    return f"{drive}/{BLACK_BOX}/{number}"


def layout(
    points: Sequence[Point], kept: Collection[int] = (), black_boxes: int = 0
) -> tuple[ObjectNode, ObjectNode, ObjectNode]:
    """The folders ``Drives``, ``Buses`` and the object ``Bridge`` with everything below them. ``kept`` are
    the places of points whose past values are, ``black_boxes`` the files of each drive.

    Nodes, drives and buses are called as the site file calls them; all other BrowseNames are
    PascalCase. Raises ValueError for a point that has no place here.
    """
    drives = ObjectNode("Drives", "Drives")
    buses = ObjectNode("Buses", "Buses")
    bridge = ObjectNode("bridge", "Bridge", folder=False, notifier=True)

    devices = {point.path[0] for point in points if len(point.path) == _IN_DEVICE and point.path[1] != "node"}

    with_outputs = {point.path[0] for point in points if point.path[1:2] == ("output",)}

    def node(name: str) -> ObjectNode:
        methods = _DEVICE_METHODS if name in devices else _NODE_METHODS
        methods = _OUTPUT_METHODS if name in with_outputs else methods
        return _owner(drives, name, name, methods, ("node",))

    for index, point in enumerate(points):
        match point.path:
            case ("bridge", *rest) if rest:
                home = bridge
            case ("bus", name, *rest) if rest:
                home = _owner(buses, f"bus/{name}", name, _BUS_METHODS)
            case (name, "node", *rest) if rest:
                home = node(name).folder_below("node")
            case (name, group, *rest) if len(rest) == 1 and group in DEVICE_GROUPS:
                home = node(name).folder_below(group)
            case (name, drive, *rest) if len(rest) > 1 and rest[0] in GROUPS:
                home = _owner(node(name), f"{name}/{drive}", drive, _DRIVE_METHODS, GROUPS)
                _add_black_boxes(home, black_boxes)
            case _:
                raise ValueError(f"the point {point.name!r} has no place in the address space")
        for name in rest[:-1]:
            home = home.folder_below(name)
        home.variables.append(_variable(point, index, kept=index in kept))
    return drives, buses, bridge


def _owner(
    above: ObjectNode, id_: str, name: str, methods: _Methods, folders: Sequence[str] = ()
) -> ObjectNode:
    """A drive, a node or a bus, with the folders that it has in any case."""

    def make() -> ObjectNode:
        made = ObjectNode(id_, name, folder=False, notifier=True, methods=_methods(id_, methods))
        for folder in folders:
            made.folder_below(folder)
        return made

    return above.below(name, make)


def _add_black_boxes(drive: ObjectNode, count: int) -> None:
    if count:
        folder = drive.folder_below(BLACK_BOX)
        folder.files = tuple(FileNode(drive.id, number) for number in range(1, count + 1))


def _methods(target: str, table: _Methods) -> tuple[MethodNode, ...]:
    named = [(one.name or pascal_case(one.action.value), one) for one in table]
    return tuple(
        MethodNode(
            f"{target}/{name}",
            name,
            one.action,
            target,
            one.description,
            one.arguments,
            one.results or (OUTCOME,),
        )
        for name, one in named
    )


_MOST_STATES: Final = 256
"""Highest code with an entry in EnumStrings, a list from code 0 on (Part 8 §5.3.3.3)."""


def _variable(point: Point, index: int, *, kept: bool) -> VariableNode:
    kind = VariableKind.PLAIN
    if point.states:
        has_others = point.low is not None and point.high is not None
        is_list = not has_others and all(0 <= code < _MOST_STATES for code, _ in point.states)
        kind = VariableKind.MULTI_STATE if is_list else VariableKind.MULTI_STATE_VALUE
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
    return VariableNode(point.name, pascal_case(point.leaf), kind, point, index, bits=bits, kept=kept)


def enum_strings(states: Sequence[tuple[int, Words]]) -> tuple[Words, ...]:
    """EnumStrings of sparse codes: the index is the code, a code without a state is empty."""
    strings: list[Words] = [""] * (max(code for code, _ in states) + 1)
    for code, text in states:
        strings[code] = text
    return tuple(strings)
