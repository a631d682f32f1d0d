"""A router as a process of its own: ``tests/peers/zenoh_router.py``."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from tests.support.zenoh_peer import free_port

_SCRIPT = Path(__file__).parents[1] / "peers" / "zenoh_router.py"


@asynccontextmanager
async def zenoh_router(settings: str = "{}") -> AsyncIterator[str]:
    """Endpoint of a router. ``settings`` are zenoh's, in JSON5."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        *(str(_SCRIPT), endpoint, settings),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
    )
    try:
        assert process.stdout
        assert await process.stdout.readline() == b"ready\n"
        yield endpoint
    finally:
        process.kill()
        await process.wait()
