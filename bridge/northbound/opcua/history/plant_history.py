"""History of the plant as OPC UA's clients read it: values, events, and the black boxes of its drives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from bridge.base import clock
from bridge.command import Event
from bridge.config import OpcUaHistoryTable
from bridge.image import Image
from bridge.northbound.opcua.events.event_keeper import EventKeeper
from bridge.northbound.opcua.history.black_box import Column, Trip, TripWatch, places_by_drive
from bridge.northbound.opcua.history.black_box_files import BlackBoxFiles
from bridge.northbound.opcua.history.value_rings import ValueRings
from bridge.northbound.opcua.space.data_values import EpochNs, epoch_us
from bridge.northbound.opcua.space.nodes import FileNode
from bridge.northbound.opcua.space.tree import Tree
from bridge.uaserver.history.history import EventHistory, ValueHistory
from bridge.uaserver.library import ua

_SECOND_US: Final = 1_000_000
_CLOSE_S: Final = 2.0
"""Time for the black boxes that wait at the end, seconds."""


class PlantHistory:
    """``rings`` of the image's points, which ``tree`` finds by their NodeIds; ``keeper`` has the events, None
    where none are kept. ``folder`` is for the black boxes."""

    def __init__(
        self,
        settings: OpcUaHistoryTable,
        image: Image,
        epoch_ns: EpochNs,
        tree: Tree,
        rings: ValueRings,
        keeper: EventKeeper | None,
        folder: Path,
    ) -> None:
        self._settings = settings
        self._points = image.points
        self._epoch_ns = epoch_ns
        self._tree = tree
        self._rings = rings
        self._keeper = keeper
        drives = tree.drives if settings.black_boxes else ()
        self._places: Mapping[str, Sequence[int]] = places_by_drive(image.points, list(rings.rings), drives)
        self._trips = TripWatch(drives, settings.after_s)
        self.files = BlackBoxFiles(folder, drives, settings.black_boxes, tree.live)

    async def start(self) -> None:
        if self._keeper:
            await self._keeper.start()
        await self.files.start()

    async def close(self) -> None:
        """Write what waits. A black box that waits for what comes after its trip has what there is by now."""
        end = clock.now() + _CLOSE_S
        await self.files.settled()
        for trip in self._trips.rest():
            if clock.now() < end:
                self._freeze(trip)
                await self.files.settled()
        if self._keeper:
            await self._keeper.close()

    # what comes from the plant

    def on_event(self, event: Event) -> None:
        self._trips.on_event(event, epoch_us(self._epoch_ns(event.time)), clock.now())

    def record(self, places: Sequence[int]) -> None:
        self._rings.record(places)

    def look(self) -> None:
        # One at a time: a bus that goes down is a trip of all its drives.
        trip = None if self.files.is_busy else self._trips.due(clock.now())
        if trip:
            self._freeze(trip)

    def _freeze(self, trip: Trip) -> None:
        start_us = trip.time_us - round(self._settings.before_s * _SECOND_US)
        end_us = trip.time_us + round(self._settings.after_s * _SECOND_US)
        columns = [
            Column(self._points[place], self._rings.rings[place].part(start_us, end_us))
            for place in self._places[trip.drive]
        ]
        self.files.write(trip, columns, start_us)

    # what clients read

    def value_history(self, where: ua.NodeId) -> ValueHistory | None:
        place = self._tree.point(where)
        return None if place is None else self._rings.rings.get(place)

    def file(self, where: ua.NodeId) -> FileNode | None:
        return self._tree.file(where)

    def event_history(self, where: ua.NodeId) -> EventHistory | None:
        return self._keeper.history(where) if self._keeper else None
