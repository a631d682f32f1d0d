"""The small address space that all three servers serve, as plain data.

Namespace 1 has variables of the usual types for reads and subscriptions. Namespace 2 has some of the bridge's
own points: there its Write and Call are compared, which an application of the tests would not show.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Any, Final

READ, WRITE, HISTORY_READ = 1, 2, 4


@dataclass(frozen=True, slots=True)
class Variable:
    """``type`` is that of a Variant; ``value`` as JSON has it. ``range`` is its EURange."""

    id: str
    parent: str
    type: str
    value: Any
    access: int = READ | WRITE
    namespace: int = 1
    range: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class History:
    """Samples of a variable, one a second: values and names of their status codes."""

    variable: Variable
    samples: tuple[tuple[Any, str], ...] = ()

    def at(self, place: int) -> datetime:
        return BEGIN + timedelta(seconds=place)


@dataclass(frozen=True, slots=True)
class Object:
    """``parent`` is the folder Objects where it is empty."""

    id: str
    parent: str
    namespace: int = 1
    is_folder: bool = False
    notifies: bool = False


@dataclass(frozen=True, slots=True)
class Method:
    """``inputs`` and ``outputs`` are names and types of arguments."""

    id: str
    parent: str
    inputs: dict[str, str] = field(default_factory=dict[str, str])
    outputs: dict[str, str] = field(default_factory=dict[str, str])
    namespace: int = 1


OBJECTS: Final = (
    Object("area", "", is_folder=True),
    Object("area/deep", "area", is_folder=True),
    Object("area/deep/box", "area/deep"),
    Object("machine", "", notifies=True),
    Object("past", "", is_folder=True),
    Object("conveyor/fu1", "", 2),
)
SCALARS: Final = (
    Variable("boolean", "area", "Boolean", False),
    Variable("sbyte", "area", "SByte", -3),
    Variable("byte", "area", "Byte", 3),
    Variable("int16", "area", "Int16", -300),
    Variable("uint16", "area", "UInt16", 300),
    Variable("int32", "area", "Int32", -70000),
    Variable("uint32", "area", "UInt32", 70000),
    Variable("float", "area", "Float", 1.5),
    Variable("double", "area", "Double", 2.5),
    Variable("string", "area", "String", "Förderband"),
)
ANALOG: Final = Variable("analog", "area", "Double", 20.0, range=(0.0, 200.0))
ARRAYS: Final = (
    Variable("int32s", "area", "Int32", [1, 2, 3, 4, 5]),
    Variable("strings", "area", "String", ["first", "second", "third"]),
)
READ_ONLY: Final = Variable("read_only", "area", "UInt16", 7, READ)
WRITE_ONLY: Final = Variable("write_only", "area", "UInt16", 8, WRITE)
LIMITED: Final = (READ_ONLY, WRITE_ONLY)
_FU1: Final = "conveyor/fu1"
_OUTCOME: Final = {"outcome": "LocalizedText"}
POINTS: Final = (
    Variable(f"{_FU1}/command/setpoint_1", _FU1, "UInt16", 0, namespace=2),
    Variable(f"{_FU1}/command/frequency", _FU1, "Float", 0.0, namespace=2),
    Variable(f"{_FU1}/status/status_word", _FU1, "UInt16", 0, READ, 2),
    Variable(f"{_FU1}/status/fault_text", _FU1, "String", "", READ, 2),
    Variable(f"{_FU1}/supervision/follows", _FU1, "Boolean", True, READ, 2),
)
VARIABLES: Final = (*SCALARS, ANALOG, *ARRAYS, *LIMITED)
BEGIN: Final = datetime(2024, 1, 1, tzinfo=UTC)
"""Time of the first sample of each history; the others follow second by second."""


def _history(name: str, kind: str, value: Any, samples: list[tuple[Any, str]]) -> History:
    return History(Variable(name, "past", kind, value, READ | HISTORY_READ), tuple(samples))


HISTORIES: Final = (
    _history("numbers", "Double", 0.0, [(number * 1.5, "Good") for number in range(10)]),
    _history("words", "String", "", [("first", "Good"), ("second", "Uncertain"), ("third", "Good")]),
    _history("one", "Int32", 0, [(7, "Good")]),
    _history("none", "Int32", 0, []),
)
"""Variables with a past that stays as it is."""
ADD: Final = Method("machine/add", "machine", {"a": "Int32", "b": "Int32"}, {"sum": "Int32"})
EMIT: Final = Method("machine/emit", "machine", {"severity": "UInt16"})
"""Sends a BaseEventType of that severity from the machine."""
METHODS: Final = (
    ADD,
    EMIT,
    Method(f"{_FU1}/Stop", _FU1, outputs=_OUTCOME, namespace=2),
    Method(f"{_FU1}/Start", _FU1, {"direction": "Int32"}, _OUTCOME, namespace=2),
)

ALARM: Final = "alarms/source/Alarm"
"""Condition of an object that tells its events to the Server object. open62541 (o6) has none."""
RAISE: Final = "alarms/raise"
"""Method that makes the alarm active and not acknowledged; its output is the EventId."""


def timestamp(time: datetime) -> str:
    return time.isoformat().replace("+00:00", "Z")


def as_json() -> str:
    """All nodes, for a server that is not in Python."""
    made = {
        "objects": [asdict(one) for one in OBJECTS],
        "variables": [asdict(one) for one in (*VARIABLES, *POINTS)],
        "alarm": ALARM,
        "raise": RAISE,
        "histories": [
            {
                "variable": asdict(one.variable),
                "samples": [
                    {"at": timestamp(one.at(place)), "value": value, "status": code}
                    for place, (value, code) in enumerate(one.samples)
                ],
            }
            for one in HISTORIES
        ],
        "methods": [asdict(one) for one in METHODS],
    }
    return json.dumps(made)
