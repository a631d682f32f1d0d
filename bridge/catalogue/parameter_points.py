"""The points of a drive's parameters, ``<node>/<drive>/parameter/…``: those that the mapping shows."""

from __future__ import annotations

from typing import Final

from bridge.image.point import DataType, Point, WriteKind
from bridge.mapping.model import Parameter
from bridge.parameter import Names, ParameterEntry

_MOST_STATES: Final = 256
"""An enumeration is shown as a list of texts from code 0 on (OPC UA Part 8 §5.3.3.3)."""


def parameter_points(name: str, names: Names) -> list[Point]:
    """The points of the drive called ``<node>/<drive>``, in the order of the mapping file."""
    return [_point(f"{name}/parameter/{entry.leaf}", entry) for entry in names.points()]


def _point(name: str, entry: ParameterEntry) -> Point:
    definition = entry.definition
    if definition is None:
        return Point(name=name, data_type=DataType.UINT32, description=entry.name)
    return Point(
        name=name,
        data_type=definition.value_type,
        unit=definition.unit,
        low=definition.low,
        high=definition.high,
        writable=definition.writable,
        write=WriteKind.PARAMETER,
        description=f"{entry.name} {definition.title}",
        states=tuple(definition.states.items()) if _can_be_listed(definition) else (),
    )


def _can_be_listed(definition: Parameter) -> bool:
    is_integer = definition.value_type.is_integer
    return is_integer and all(0 <= code < _MOST_STATES for code in definition.states)
