"""An OPC UA server on a thread of its own, and the longest time for which its event loop saw to nobody else.

The time is that of the thread on the CPU: what the machine does for others does not count.
"""

from __future__ import annotations

import asyncio
import threading
import time
from asyncio import base_events
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

from bridge.northbound.opcua.server import OpcUaServer
from tests.support.opcua_site import OPEN, serving

_START_S = 60


class ServerThread:
    """``longest_s`` is the longest turn of its loop since it was last set to 0."""

    server: OpcUaServer

    def __init__(self, folder: Path) -> None:
        self.longest_s = 0.0
        self._folder = folder
        self._is_up = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()))

    async def _serve(self) -> None:
        async with serving(OPEN, self._folder) as (self.server, _):
            self._loop, self._end = asyncio.get_running_loop(), asyncio.Event()
            self._is_up.set()
            await self._end.wait()

    @contextmanager
    def running(self) -> Generator[ServerThread]:
        go_round = getattr(base_events.BaseEventLoop, "_run_once")  # noqa: B009 - it is asyncio's own

        def measured(loop: Any) -> None:
            began = time.thread_time()
            go_round(loop)
            if threading.get_ident() == self._thread.ident:
                self.longest_s = max(self.longest_s, time.thread_time() - began)

        with patch.object(base_events.BaseEventLoop, "_run_once", measured):
            self._thread.start()
            assert self._is_up.wait(_START_S)
            try:
                yield self
            finally:
                self._loop.call_soon_threadsafe(self._end.set)
                self._thread.join()
