"""Composition root of the zenoh front: a session that strangers reach, on the mirror image.

zenoh reads what strangers send before any rule of ours is asked, and keeps for ever which keys they have
named. So whatever that leads to is the end of this process, and not of the one that moves drives.
"""

from __future__ import annotations

import asyncio
import logging
from contextlib import AsyncExitStack
from pathlib import Path

from bridge.base import clock
from bridge.base.errors import OperationFailed
from bridge.config import Site
from bridge.mirror.client import MirrorClient
from bridge.mirror.endpoint import socket_endpoint
from bridge.northbound.zenoh import ZenohServer
from bridge.service.front_process import give_signs

_log = logging.getLogger(__name__)


async def run_zenoh(site: Site, signs: int | None = None) -> None:
    """Serve until cancelled, with signs of life on the pipe ``signs`` as soon as it serves.

    Raises ``PointsChanged`` where the bus process comes back with other points: this front has to start anew
    then.
    """
    if site.zenoh is None:
        raise OperationFailed("the site file has no [zenoh] table")
    async with AsyncExitStack() as stack:
        endpoint = socket_endpoint(Path(site.site.runtime_dir), site.site.name)
        mirror = MirrorClient(endpoint, clock.now, "zenoh")
        await mirror.open()
        stack.push_async_callback(mirror.close)
        server = ZenohServer(mirror, site.zenoh, site.site.name, clock.now)
        stack.push_async_callback(server.close)
        await server.start()
        _log.info(
            "zenoh on %s", ", ".join(site.zenoh.listen if site.zenoh.mode == "peer" else site.zenoh.connect)
        )
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(mirror.run(), name="mirror")
            tasks.create_task(mirror.failed(), name="mirror link")
            tasks.create_task(server.failed(), name="zenoh session")
            if signs is not None:
                tasks.create_task(give_signs(signs), name="signs of life")
