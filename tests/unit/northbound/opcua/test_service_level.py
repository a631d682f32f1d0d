"""The service level follows the link to the bus process; no server."""

from __future__ import annotations

import time
from typing import Any

from bridge.image import Quality
from bridge.northbound.opcua.service_level import ServiceLevel
from bridge.uaserver.serverstatus import HEALTHY, NO_DATA
from tests.support.opcua_site import make_plant


class Status:
    def __init__(self) -> None:
        self.level = -1

    async def set_level(self, level: int) -> None:
        self.level = level


async def test_without_the_bus_process_there_is_no_data() -> None:
    plant, told = make_plant(), Status()
    status: Any = told
    level = ServiceLevel(plant.image, status)
    await level.look()
    assert told.level == HEALTHY
    for quality, expected in ((Quality.DEAD, NO_DATA), (Quality.GOOD, HEALTHY)):
        plant.set("bridge/version", "1", time.monotonic(), quality)
        await level.look()
        assert told.level == expected
