"""Values of points as asyncua's address space holds them: made when somebody looks at them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from asyncua.server.address_space import AttributeValue

from bridge.image import Image
from bridge.northbound.opcua.space.data_values import EpochNs, present_value
from bridge.northbound.opcua.space.nodes import VariableNode
from bridge.northbound.opcua.space.structures import value_type
from bridge.uaserver.address_space import Watchers
from bridge.uaserver.library import ua

_WHOLE_POINT: Final = -1
# Places of what is made of a point.
SAME, TEXT_OF_NUMBER, HEALTH, TEXT_OF_STATE = -2, -3, -4, -5


@dataclass(frozen=True, slots=True)
class WatchedVariable:
    """A variable that is watched, or was once, and how to read it."""

    watchers: Watchers
    read: Callable[[], ua.DataValue]


AllWatched = dict[int, dict[int, WatchedVariable]]
"""Watched variables by index of the point, then by bit, -1 for the whole point, below that for what is made
of it."""


class PointValue(AttributeValue):
    """The attribute Value of a variable, read from ``image`` whenever somebody asks. It is made anew for
    everybody who looks, and ``watched`` keeps who watches it."""

    value = None
    value_setter = None

    def __init__(self, image: Image, epoch_ns: EpochNs, node: VariableNode, watched: AllWatched) -> None:
        self._image = image
        self._epoch_ns = epoch_ns
        self._node = node
        self._watched = watched

    def read(self, *_: object) -> ua.DataValue:
        node = self._node
        return present_value(self._image, node.index, value_type(node), self._epoch_ns, node.bit)

    value_callback = read  # pyright: ignore[reportAssignmentType]

    @property
    def datachange_callbacks(self) -> Watchers:  # pyright: ignore[reportIncompatibleVariableOverride]
        node = self._node
        place = _WHOLE_POINT if node.bit is None else node.bit
        of_point = self._watched.setdefault(node.index, {})
        return of_point.setdefault(place, WatchedVariable({}, self.read)).watchers


class DerivedValue(AttributeValue):
    """The attribute Value of a variable that is made of several ``points``: ``read`` makes it. ``place`` is
    that of the conversion among the variables of a point; nodes with the same one have the same value."""

    value = None
    value_setter = None

    def __init__(
        self,
        points: Sequence[VariableNode],
        place: int,
        read: Callable[[], ua.DataValue],
        watched: AllWatched,
    ) -> None:
        self._points = points
        self._place = place
        self._read = read
        self._watched = watched

    def value_callback(self, *_: object) -> ua.DataValue:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self._read()

    @property
    def datachange_callbacks(self) -> Watchers:  # pyright: ignore[reportIncompatibleVariableOverride]
        known = self._watched.get(self._points[0].index, {}).get(self._place)
        variable = known or WatchedVariable({}, self._read)
        for point in self._points:
            self._watched.setdefault(point.index, {})[self._place] = variable
        return variable.watchers
