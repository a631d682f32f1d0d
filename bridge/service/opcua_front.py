"""Composition root of the OPC UA front: a server on the mirror image, and nothing else."""

from __future__ import annotations

import gc
from collections.abc import Coroutine
from contextlib import AsyncExitStack
from pathlib import Path

from bridge.catalogue import Catalogue
from bridge.northbound.listening import ListeningSocket
from bridge.northbound.opcua.nameplates import nameplates_of
from bridge.northbound.opcua.server import OpcUaServer
from bridge.northbound.view import View
from bridge.project import load_project
from bridge.service.mirrored import required, serve_mirrored


def run_opcua(path: Path, signs: int | None, listening: int | None) -> Coroutine[None, None, None]:
    """The OPC UA front of the site file at ``path``, as ``RunFront`` says."""
    project = load_project(path)
    site = project.site
    settings = required(site.opcua, "opcua")
    nameplates = nameplates_of(Catalogue.of(site, project.families))

    async def open_server(mirror: View, stack: AsyncExitStack) -> OpcUaServer:
        # Nothing of what is built here is garbage, and looking for it takes a quarter of the time.
        gc.disable()
        stack.callback(gc.enable)
        bound = None if listening is None else ListeningSocket(listening, "opcua.listen")
        folder = Path(site.site.state_dir)
        server = OpcUaServer(mirror, settings, folder, site.site.name, bound, nameplates)
        await server.start()
        stack.push_async_callback(server.close)
        gc.collect()
        gc.freeze()
        gc.enable()
        return server

    return serve_mirrored(site, "opcua", open_server, signs)
