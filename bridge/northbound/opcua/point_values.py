"""Values of points as asyncua's address space holds them: made when somebody looks at them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from asyncua.server.address_space import AttributeValue

from bridge.image import Image
from bridge.northbound.opcua.data_values import EpochNs, present_value
from bridge.northbound.opcua.nodes import VariableNode
from bridge.northbound.opcua.structures import value_type
from bridge.uaserver.address_space import Watchers
from bridge.uaserver.library import ua

_WHOLE_POINT: Final = -1


@dataclass(frozen=True, slots=True)
class WatchedVariable:
    """A variable that is watched, or was once, and how to read it."""

    watchers: Watchers
    read: Callable[[], ua.DataValue]


AllWatched = dict[int, dict[int, WatchedVariable]]
"""Watched variables by index of the point, then by bit, -1 for the whole point."""


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
