"""Composition root of the OPC UA front: a server on the mirror image, and nothing else."""

from __future__ import annotations

import asyncio
import gc
from contextlib import AsyncExitStack
from pathlib import Path

from bridge.base import clock
from bridge.base.errors import OperationFailed
from bridge.config import Site
from bridge.mirror.client import MirrorClient
from bridge.mirror.endpoint import socket_endpoint
from bridge.northbound.listening import ListeningSocket
from bridge.northbound.opcua.server import OpcUaServer
from bridge.service.front_process import give_signs


async def run_opcua(site: Site, signs: int | None = None, listening: int | None = None) -> None:
    """Serve until cancelled, with signs of life on the pipe ``signs`` as soon as it serves; on the socket
    ``listening`` where the bus process holds the port.

    Raises ``PointsChanged`` where the bus process comes back with other points: this front has to
    start anew then.
    """
    if site.opcua is None:
        raise OperationFailed("the site file has no [opcua] table")
    async with AsyncExitStack() as stack:
        endpoint = socket_endpoint(Path(site.site.runtime_dir), site.site.name)
        mirror = MirrorClient(endpoint, clock.now, "opcua")
        await mirror.open()
        stack.push_async_callback(mirror.close)
        # Nothing of what is built here is garbage, and looking for it takes a quarter of the time.
        gc.disable()
        stack.callback(gc.enable)
        bound = None if listening is None else ListeningSocket(listening, "opcua.listen")
        server = OpcUaServer(mirror, site.opcua, Path(site.site.state_dir), site.site.name, bound)
        await server.start()
        stack.push_async_callback(server.close)
        gc.collect()
        gc.freeze()
        gc.enable()
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(mirror.run(), name="mirror")
            tasks.create_task(mirror.failed(), name="mirror link")
            tasks.create_task(server.failed(), name="listening socket")
            if signs is not None:
                tasks.create_task(give_signs(signs), name="signs of life")
