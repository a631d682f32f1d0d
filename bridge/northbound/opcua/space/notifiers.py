"""Objects that tell events: the server, the object that an event is about, and its node."""

from __future__ import annotations

from collections.abc import Mapping

from bridge.uaserver.library import ObjectIds, node_id, ua


class Notifiers:
    """``objects`` are those that tell events, by their names."""

    def __init__(self, objects: Mapping[str, ua.NodeId]) -> None:
        self._objects = objects

    def source(self, name: str) -> ua.NodeId:
        """The object that an event is about: a drive, a node, a bus, or else the bridge itself."""
        objects = self._objects
        return objects.get(name) or objects.get(f"bus/{name}") or objects["bridge"]

    def emitters(self, name: str) -> list[ua.NodeId]:
        """Objects that tell the event: of one of a drive, the server, the drive and its node."""
        above = self._objects.get(name.partition("/")[0]) if "/" in name else None
        found = [node_id(ObjectIds.Server), self.source(name)]
        return [*found, above] if above else found

    @property
    def all(self) -> list[ua.NodeId]:
        return [node_id(ObjectIds.Server), *self._objects.values()]
