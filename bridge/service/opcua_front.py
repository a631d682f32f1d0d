"""Composition root of the OPC UA front: a server on the mirror image, and nothing else."""

from __future__ import annotations

import asyncio
import gc
from collections.abc import Coroutine
from contextlib import AsyncExitStack
from pathlib import Path

from bridge.config import load_site
from bridge.northbound.listening import ListeningSocket
from bridge.northbound.opcua.server import OpcUaServer
from bridge.northbound.view import View
from bridge.service.front_process import on_end
from bridge.service.mirrored import required, serve_mirrored


def run_opcua(path: Path, signs: int | None, listening: int | None) -> Coroutine[None, None, None]:
    """The OPC UA front of the site file at ``path``, as ``RunFront`` says."""
    site = load_site(path)
    settings = required(site.opcua, "opcua")

    async def open_server(mirror: View, stack: AsyncExitStack) -> OpcUaServer:
        # Nothing of what is built here is garbage, and looking for it takes a quarter of the time.
        gc.disable()
        stack.callback(gc.enable)
        bound = None if listening is None else ListeningSocket(listening, "opcua.listen")
        server = OpcUaServer(mirror, settings, Path(site.site.state_dir), site.site.name, bound)
        await server.start()
        stack.push_async_callback(server.close)
        on_end(server.announce_end)

        async def give_notice(why: type[BaseException] | None, *_: object) -> None:
            # Not where the front has failed and is started again.
            if why is not None and issubclass(why, asyncio.CancelledError):
                await server.end()

        stack.push_async_exit(give_notice)
        gc.collect()
        gc.freeze()
        gc.enable()
        return server

    return serve_mirrored(site, "opcua", open_server, signs)
