"""What asyncua's address space needs to be told to hold nodes that are made when somebody looks at them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from asyncua.server.address_space import AttributeValue, NodeData

from bridge.image import Image
from bridge.northbound.opcua.library import AttributeIds, ua
from bridge.northbound.opcua.nodes import VariableNode
from bridge.northbound.opcua.structures import value_type
from bridge.northbound.opcua.values import EpochNs, present_value

Callbacks = dict[int, Callable[..., Any]]
"""Whom to tell of a change, by handle."""

_WHOLE_POINT: Final = -1


def is_empty(held: AttributeValue) -> bool:
    """Good, and null: what nobody has given a value."""
    value = held.value
    if held.value_callback is not None or (value and value.StatusCode and value.StatusCode.is_bad()):
        return False
    return value is None or value.Value is None or value.Value.Value is None


@dataclass(frozen=True, slots=True)
class Watched:
    """A variable that is watched, or was once, and how to read it."""

    callbacks: Callbacks
    read: Callable[[], ua.DataValue]


AllWatched = dict[int, dict[int, Watched]]
"""By the index of the point, and then by the bit, -1 for the whole point."""


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
    def datachange_callbacks(self) -> Callbacks:  # pyright: ignore[reportIncompatibleVariableOverride]
        node = self._node
        place = _WHOLE_POINT if node.bit is None else node.bit
        of_point = self._watched.setdefault(node.index, {})
        return of_point.setdefault(place, Watched({}, self.read)).callbacks


class Attributes(Mapping[AttributeIds, AttributeValue]):
    """Those of ``node``: what it has for itself, ``own`` makes, all else is its kind's. ``common`` has all of
    them."""

    __slots__ = ("_common", "_node", "_own")

    def __init__(
        self,
        common: Mapping[AttributeIds, AttributeValue],
        own: Mapping[int, Callable[[Any], AttributeValue]],
        node: object,
    ) -> None:
        self._common = common
        self._own = own
        self._node = node

    def __getitem__(self, attribute: AttributeIds) -> AttributeValue:
        make = self._own.get(attribute)
        return make(self._node) if make else self._common[attribute]

    def __contains__(self, attribute: object) -> bool:
        return attribute in self._common

    def __iter__(self) -> Iterator[AttributeIds]:
        return iter(self._common)

    def __len__(self) -> int:
        return len(self._common)


class Nodes(dict[ua.NodeId, NodeData]):
    """The nodes that asyncua holds, and behind them those that ``find`` makes."""

    def __init__(
        self, held: Mapping[ua.NodeId, NodeData], find: Callable[[ua.NodeId], NodeData | None]
    ) -> None:
        super().__init__(held)
        self._find = find

    def __missing__(self, where: ua.NodeId) -> NodeData:
        found = self._find(where)
        if found is None:
            raise KeyError(where)
        return found

    def get(self, where: ua.NodeId, default: Any = None) -> Any:
        found = super().get(where)
        if found is None:
            found = self._find(where)
        return default if found is None else found

    def __contains__(self, where: object) -> bool:
        return super().__contains__(where) or (isinstance(where, ua.NodeId) and self._find(where) is not None)
