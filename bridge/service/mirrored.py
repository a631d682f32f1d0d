"""Frame of every front: the mirror image of the plant, a server on it, and signs of life."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Protocol, TypeVar

from bridge.base import clock
from bridge.base.errors import OperationFailed
from bridge.config import Site
from bridge.mirror.client import MirrorClient
from bridge.mirror.endpoint import socket_endpoint
from bridge.northbound.view import View
from bridge.service.front_process import give_signs, limit_memory

Settings = TypeVar("Settings")


class FrontServer(Protocol):
    async def failed(self) -> None:
        """Wait until it can serve no more, and raise then."""
        ...


OpenServer = Callable[[View, AsyncExitStack], Awaitable[FrontServer]]
"""Opens a server on the view, and leaves to the stack what is to be closed at the end."""


def required(table: Settings | None, name: str) -> Settings:
    """The ``table`` called ``name`` of a site file. Raises ``OperationFailed`` where the file has none."""
    if table is None:
        raise OperationFailed(f"the site file has no [{name}] table")
    return table


async def serve_mirrored(site: Site, role: str, open_server: OpenServer, signs: int | None) -> None:
    """Serve until cancelled, within the memory of a front, with signs of life on the pipe ``signs`` as soon
    as the server is open. ``role`` is the front's.

    Raises ``PointsChanged`` where the bus process comes back with other points: this front has to start anew
    then.
    """
    limit_memory(site.site.front_memory_mb)
    async with AsyncExitStack() as stack:
        endpoint = socket_endpoint(Path(site.site.runtime_dir), site.site.name)
        mirror = MirrorClient(endpoint, clock.now, role)
        await mirror.open()
        stack.push_async_callback(mirror.close)
        server = await open_server(mirror, stack)
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(mirror.run(), name="mirror")
            tasks.create_task(mirror.failed(), name="mirror link")
            tasks.create_task(server.failed(), name="server")
            if signs is not None:
                tasks.create_task(give_signs(signs), name="signs of life")
