"""Service level of the server: whether there is a plant behind it."""

from __future__ import annotations

from typing import Final

from bridge.image import Image, Quality
from bridge.uaserver.serverstatus import HEALTHY, NO_DATA, ServerStatus

_OF_THE_BRIDGE: Final = "bridge/version"
"""A point that is always good where the bus process can be reached."""


class ServiceLevel:
    """Follows the link to the bus process: without it every point is dead, and the server has no data."""

    def __init__(self, image: Image, status: ServerStatus) -> None:
        self._image = image
        self._status = status
        self._index = image.index[_OF_THE_BRIDGE]

    async def look(self) -> None:
        is_dead = self._image[self._index].quality is Quality.DEAD
        await self._status.set_level(NO_DATA if is_dead else HEALTHY)
