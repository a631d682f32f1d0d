"""The points of a drive's parameters, ``<node>/<drive>/parameter/…``: those that the mapping shows."""

from __future__ import annotations

from functools import cache

from bridge.image.point import DataType, Point, WriteKind
from bridge.parameter import Names, ParameterEntry
from bridge.text import Text, Words


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
        description=_described(entry.name, definition.title, definition.german),
        states=_shared(definition.said_states) if definition.value_type.is_integer else (),
    )


@cache
def _described(name: str, title: str, german: str) -> Words:
    """Description in the reader's language: one object, however many drives of a family there are."""
    english = f"{name} {title}"
    return Text.both(english, f"{name} {german}") if german else english


@cache
def _shared(states: tuple[tuple[int, Words], ...]) -> tuple[tuple[int, Words], ...]:
    """The states, one object for all drives as well."""
    return states
