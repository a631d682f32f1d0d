"""An OPC UA server with a thousand alarms: python -m tests.bench.alarming

Prints ``serving URL``. A line with a number on its input raises all alarms so often; ``raised`` answers it.
"""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from asyncua import ua

from bridge.config import OpcUaTable
from bridge.uaserver.conditions.condition_fields import AlarmContent
from bridge.uaserver.conditions.conditions import Conditions
from tests.support.opcua_alarms import thousand
from tests.support.opcua_site import serving


async def raise_all(conditions: Conditions, turns: int) -> None:
    """Raise each alarm anew, ``turns`` times, as fast as they are told."""
    for turn in range(turns):
        content = AlarmContent(ua.LocalizedText(f"turn {turn}", "en"), 700)
        for one in conditions.conditions.values():
            conditions.raised(one, content, anew=True)
        await conditions.send_waiting()


async def main() -> None:
    lines = asyncio.StreamReader()
    await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(lines), sys.stdin)
    settings = OpcUaTable(listen="127.0.0.1:0", no_security=True, anonymous="operator")
    with TemporaryDirectory() as folder:
        async with serving(settings, Path(folder)) as (server, _):
            own: Any = server._server  # pyright: ignore[reportPrivateUsage]
            conditions: Conditions = own.iserver.conditions
            thousand(conditions)
            print(f"serving {server.endpoint_url}", flush=True)
            while line := await lines.readline():
                await raise_all(conditions, int(line))
                print("raised", flush=True)


if __name__ == "__main__":
    asyncio.run(main())
