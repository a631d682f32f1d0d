"""Address space of asyncua that holds nodes which are made when somebody looks at them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, Protocol

from asyncua.server.address_space import AddressSpace, AttributeValue, NodeData

from bridge.uaserver.library import AttributeIds, data_value, get, ua, variant


class Watcher(Protocol):
    """Callback for a change, which asyncua awaits. ``told`` does the same at once."""

    def told(self, value: ua.DataValue, now: float) -> None: ...

    async def __call__(self, handle: int, value: ua.DataValue) -> None: ...


Watchers = dict[int, Watcher]
"""Watchers of one attribute, by handle."""

_WRITE_FULL_ARRAY_ONLY: Final = 1 << 10
"""Bit of AccessLevelEx."""


def constant(value: object, kind: ua.VariantType) -> AttributeValue:
    return AttributeValue(data_value(variant(value, kind)))


def access_level_ex(access: int) -> int:
    """AccessLevelEx of a variable with this AccessLevel (Part 3 §8.58): reads and writes are atomic, and no
    part of an array is written."""
    return access | _WRITE_FULL_ARRAY_ONLY


def is_empty(held: AttributeValue) -> bool:
    """Good, and null: what nobody has given a value."""
    value = held.value
    if held.value_callback is not None or (value and value.StatusCode and value.StatusCode.is_bad()):
        return False
    return value is None or value.Value is None or value.Value.Value is None


class Attributes(Mapping[AttributeIds, AttributeValue]):
    """Attributes of ``node``: what it has for itself, ``own`` makes, all else is its kind's. ``common`` has
    all of them."""

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


Find = Callable[[ua.NodeId], NodeData | None]
"""Makes a node, None where there is no such one."""


class Nodes(dict[ua.NodeId, NodeData]):
    """The nodes that asyncua holds, and behind them those that one of ``finds`` makes."""

    def __init__(self, held: Mapping[ua.NodeId, NodeData], *finds: Find) -> None:
        super().__init__(held)
        self.finds = list(finds)

    def _find(self, where: ua.NodeId) -> NodeData | None:
        for find in self.finds:
            if found := find(where):
                return found
        return None

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


def put_behind(space: AddressSpace, find: Find) -> None:
    """Have the nodes that ``find`` makes found in ``space``, where nobody before it has them."""
    nodes = get(space, "_nodes")
    if not isinstance(nodes, Nodes):
        # asyncua puts a mapping of its own there, too, for nodes that it loads when they are asked for.
        nodes = space._nodes = Nodes(nodes)  # pyright: ignore[reportPrivateUsage]
    nodes.finds.append(find)
