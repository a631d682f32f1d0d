"""Composition root of the OPC UA front: a server on the mirror image, and nothing else."""

from __future__ import annotations

import asyncio
import gc
from pathlib import Path

from bridge.config import Site
from bridge.errors import OperationFailed
from bridge.mirror.client import MirrorClient
from bridge.northbound.opcua.server import OpcUaServer


async def run_opcua(site: Site) -> None:
    """Serve until cancelled, or until the bus process comes back with another set of points."""
    if site.opcua is None:
        raise OperationFailed("the site file has no [opcua] table")
    async with MirrorClient(Path(site.site.runtime_dir)) as mirror:
        server = OpcUaServer(mirror, site.opcua, Path(site.site.state_dir), site.site.name)
        await server.start()
        gc.collect()
        gc.freeze()
        try:
            await mirror.until_changed()
        finally:
            await server.close()
        await asyncio.sleep(0)
