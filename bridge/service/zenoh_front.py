"""Composition root of the zenoh front: a session that strangers reach, on the mirror image.

zenoh reads what strangers send before any rule of ours is asked, and keeps for ever which keys they have
named. So whatever that leads to is the end of this process, and not of the one that moves drives.
"""

from __future__ import annotations

import logging
from collections.abc import Coroutine
from contextlib import AsyncExitStack
from pathlib import Path

from bridge.base import clock
from bridge.config import load_site
from bridge.northbound.view import View
from bridge.northbound.zenoh import ZenohServer
from bridge.service.mirrored import required, serve_mirrored

_log = logging.getLogger(__name__)


def run_zenoh(path: Path, signs: int | None, listening: int | None) -> Coroutine[None, None, None]:
    """The zenoh front of the site file at ``path``, as ``RunFront`` says. It opens its sockets itself."""
    site = load_site(path)
    settings = required(site.zenoh, "zenoh")

    async def open_server(mirror: View, stack: AsyncExitStack) -> ZenohServer:
        server = ZenohServer(mirror, settings, site.site.name, clock.now)
        stack.push_async_callback(server.close)
        await server.start()
        places = settings.listen if settings.mode == "peer" else settings.connect
        _log.info("zenoh on %s", ", ".join(places))
        return server

    return serve_mirrored(site, "zenoh", open_server, signs)
