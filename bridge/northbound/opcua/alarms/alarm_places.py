"""Alarms of a site: one for each drive, node, bus and front, for the bridge itself and its certificate."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from bridge.northbound.opcua.space.nodes import pascal_case

CERTIFICATE: Final = "certificate"
FRONT: Final = "front"
BRIDGE: Final = "bridge"


@dataclass(frozen=True, slots=True)
class AlarmPlace:
    """``owner`` is the id of the object that it stands below, ``kind`` what it is about, ``what`` the front's
    name for that of a front."""

    owner: str
    kind: str
    what: str = ""

    @property
    def name(self) -> str:
        """BrowseName."""
        return f"{pascal_case(self.what)}Alarm"

    @property
    def id(self) -> str:
        return f"{self.owner}/{self.name}"

    @property
    def source_name(self) -> str:
        return self.owner.removeprefix("bus/")


def alarm_places(notifiers: Iterable[str], fronts: Iterable[str]) -> Iterator[AlarmPlace]:
    """``notifiers`` are the ids of the objects that send events."""
    for owner in notifiers:
        if owner == BRIDGE:
            yield AlarmPlace(owner, "bridge")
            yield from (AlarmPlace(owner, FRONT, front) for front in fronts)
            yield AlarmPlace(owner, CERTIFICATE, CERTIFICATE)
        elif owner.startswith("bus/"):
            yield AlarmPlace(owner, "bus")
        else:
            yield AlarmPlace(owner, "drive" if "/" in owner else "node")
