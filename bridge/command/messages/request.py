"""A request to command a drive or a node, and its one outcome."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum, StrEnum
from typing import Any, ClassVar, Final

from bridge.catalogue.codes import Source as Source
from bridge.image import Value
from bridge.text import Said, Text, render


class Role(IntEnum):
    """Rights of an identity; a higher role has those of all lower ones."""

    OBSERVER = 0
    OPERATOR = 1
    ENGINEER = 2
    ADMIN = 3
    """Also the certificates of the OPC UA server, and who is trusted."""

    @classmethod
    def named(cls, name: str) -> Role | None:
        """Role that the site file calls so; None for "none"."""
        return cls.__members__.get(name.upper())


@dataclass(frozen=True, slots=True)
class Identity:
    """Sender of a request, and the connection that it came over.

    ``user`` is the session's user on OPC UA, the client's IP address on Modbus, the controller's name on
    zenoh. ``address`` is for the log only. ``sets_parameters``: may write parameters of drives without being
    an engineer, where a protocol knows no roles. ``connection`` is the name of the client's connection
    (``port 51234`` on Modbus, ``session 1f3a9c02`` on OPC UA and zenoh), empty where the protocol knows none
    and of an owner whose connection has ended.
    """

    source: Source
    user: str
    role: Role = Role.OPERATOR
    address: str = ""
    sets_parameters: bool = False
    connection: str = ""

    @property
    def may_set_parameters(self) -> bool:
        return self.sets_parameters or self.role >= Role.ENGINEER

    def is_same(self, other: Identity | None) -> bool:
        """Same user of the same protocol, over any connection."""
        return other is not None and self.source is other.source and self.user == other.user

    def goes_on_as(self, other: Identity | None) -> bool:
        """Same user over the same connection, or over any where that of ``other`` has ended."""
        return other is not None and other.connection in ("", self.connection) and self.is_same(other)

    def without_connection(self) -> Identity:
        """The same user, whose connection has ended."""
        return replace(self, connection="")

    def named_beside(self, other: Identity | None) -> str:
        """Name that tells it from ``other``: with its connection where both are the same user."""
        return f"{self} {self.connection}".rstrip() if self.is_same(other) else str(self)

    def __str__(self) -> str:
        return f"{self.source.label}:{self.user}"


class Action(StrEnum):
    __hash__ = str.__hash__  # in C: each telegram is looked up by it

    # on a drive
    WRITE = "write"
    KEEP_ALIVE = "keep_alive"
    RESET_FAULT = "reset_fault"
    START = "start"
    STOP = "stop"
    QUICK_STOP = "quick_stop"
    DISABLE_VOLTAGE = "disable_voltage"
    TAKE_CONTROL = "take_control"
    RELEASE_CONTROL = "release_control"
    SET_TIMEOUT = "set_timeout"
    READ_PARAMETER = "read_parameter"
    WRITE_PARAMETER = "write_parameter"
    SAVE_PARAMETERS = "save_parameters"
    # on a node
    RESET = "reset"
    RESET_COMMUNICATION = "reset_communication"
    START_NODE = "start_node"
    STOP_NODE = "stop_node"
    ENTER_PRE_OPERATIONAL = "enter_pre_operational"
    ENABLE = "enable"
    DISABLE = "disable"


NMT_ACTIONS = frozenset(
    (
        Action.RESET,
        Action.RESET_COMMUNICATION,
        Action.START_NODE,
        Action.STOP_NODE,
        Action.ENTER_PRE_OPERATIONAL,
    )
)
"""The five commands of NMT (CiA 301 §7.2.8.2.1), on a node or on all nodes of a bus."""
NODE_ACTIONS = NMT_ACTIONS | {Action.ENABLE, Action.DISABLE}
PARAMETER_ACTIONS = frozenset((Action.READ_PARAMETER, Action.WRITE_PARAMETER, Action.SAVE_PARAMETERS))
LEAST_ROLE = dict.fromkeys(Action, Role.OPERATOR) | {
    Action.READ_PARAMETER: Role.OBSERVER,
    Action.WRITE_PARAMETER: Role.ENGINEER,
    Action.SAVE_PARAMETERS: Role.ENGINEER,
}
"""The role that a user of a protocol with roles needs, whoever controls the drive."""
STOP_ACTIONS = frozenset((Action.STOP, Action.QUICK_STOP, Action.DISABLE_VOLTAGE))


class Code(StrEnum):
    """Code of a request's outcome."""

    OK = "ok"
    UNKNOWN_TARGET = "unknown_target"
    UNKNOWN_POINT = "unknown_point"
    READ_ONLY = "read_only"
    OUT_OF_RANGE = "out_of_range"
    NOT_VALID = "not_valid"
    NOT_ALLOWED = "not_allowed"
    ACKNOWLEDGE_FIRST = "acknowledge_first"
    NOT_READY = "not_ready"
    STALE = "stale"
    NOT_CONFIGURED = "not_configured"
    TIMED_OUT = "timed_out"
    CANCELLED = "cancelled"
    UNKNOWN_PARAMETER = "unknown_parameter"
    WRITE_ONLY = "write_only"
    BUSY = "busy"
    OTHER_VALUE = "other_value"
    TOO_OFTEN = "too_often"
    REFUSED_BY_DRIVE = "refused_by_drive"


@dataclass(frozen=True, slots=True)
class Outcome:
    """The end of a request. ``forwarded`` is False where a write was taken but not sent to the drive
    (while tripped or interlocked); ``said`` is one sentence for a human.

    ``value`` is what a parameter holds, as it was read (back) at ``time`` in seconds of the monotonic
    clock; ``abort_code`` is the drive's, where it has refused.
    """

    code: Code
    said: Said = ""
    forwarded: bool = True
    value: Value | None = None
    time: float = 0.0
    abort_code: int = 0

    @property
    def ok(self) -> bool:
        return self.code is Code.OK

    @property
    def message(self) -> str:
        """The message in English."""
        return render(self.said)


DONE = Outcome(Code.OK)


def refused(action: Action, who: str, why: Said) -> Text:
    """Text of the event about a refused request."""
    return Text.of("request.refused", action=Text.word("action", action), who=who, why=why)


@dataclass(frozen=True, slots=True)
class Write:
    """One telegram. ``values`` maps names of the command group to values:
    ``{"control_word": 0x047F, "setpoint_1": 0x2000}``."""

    action: ClassVar[Action] = Action.WRITE
    values: Mapping[str, Value] = field(default_factory=dict[str, Value])


@dataclass(frozen=True, slots=True)
class Start:
    """Start of a drive; ``direction`` is 1 forward, -1 reverse, 0 as the drive's own setting."""

    action: ClassVar[Action] = Action.START
    direction: int = 0


@dataclass(frozen=True, slots=True)
class TakeControl:
    """Claim of control; ``ttl_ms`` is the lease's length."""

    action: ClassVar[Action] = Action.TAKE_CONTROL
    ttl_ms: int = 0


@dataclass(frozen=True, slots=True)
class SetTimeout:
    action: ClassVar[Action] = Action.SET_TIMEOUT
    timeout_ms: int


@dataclass(frozen=True, slots=True)
class ReadParameter:
    """Reading of a parameter, by a vendor's name, an object or the name of a point; ``max_age_ms`` is how old
    a value read earlier may be. ``raw``: the outcome's value is the bytes of the object, in hexadecimal."""

    action: ClassVar[Action] = Action.READ_PARAMETER
    parameter: str
    max_age_ms: int = 0
    raw: bool = False


@dataclass(frozen=True, slots=True)
class WriteParameter:
    """Writing of a parameter, named as in ``ReadParameter``; of a raw write ``value`` is the bytes. Where it
    does not hold ``expected``, if that is given, nothing is written."""

    action: ClassVar[Action] = Action.WRITE_PARAMETER
    parameter: str
    value: Value
    raw: bool = False
    expected: Value | None = None


@dataclass(frozen=True, slots=True)
class Do:
    """An action without fields."""

    action: Action


Command = Write | Start | TakeControl | SetTimeout | ReadParameter | WriteParameter | Do

COMMANDS: Final = {
    kind.action: kind for kind in (Write, Start, TakeControl, SetTimeout, ReadParameter, WriteParameter)
}
"""The commands that have fields, by their action."""


def command_of(action: Action, *values: Any, **fields: Any) -> Command:
    """The command for ``action``, which has these fields, the first of them by their order."""
    kind = COMMANDS.get(action)
    return Do(action) if kind is None else kind(*values, **fields)


@dataclass(frozen=True, slots=True)
class Request:
    """One command and who gives it.

    ``target`` is ``<node>/<drive>``, ``<node>`` or, for NMT, ``bus/<bus>``. ``received_at`` is when it can
    have come at the earliest, in monotonic seconds of the clock of whoever has it (the view between a server
    and its plant sees to that); None for one that was made in this process just now. ``pressed`` is what the
    telegram says of an acknowledge register, None where its protocol has none or another request of the same
    telegram says it.
    """

    identity: Identity
    target: str
    command: Command
    received_at: float | None = None
    pressed: bool | None = None

    @property
    def action(self) -> Action:
        return self.command.action


Reply = Callable[[Outcome], None]
