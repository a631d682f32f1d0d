"""The points of a drive's parameters, ``<node>/<drive>/parameter/…``: those that the mapping shows."""

from __future__ import annotations

from bridge.image.point import DataType, Point, WriteKind
from bridge.parameter import Names, ParameterEntry


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
        states=tuple(definition.states.items()) if definition.value_type.is_integer else (),
    )
