"""An OPC UA controller that writes without waiting for answers, and hangs.

opcua_backlog.py URL NODE COUNT
Waits for a line before each step: leads the drive to operation enabled, then sends COUNT enabling
telegrams (or as many as its library lets wait) in one go, says when (monotonic), and stops itself.
"""

import asyncio
import os
import signal
import sys
import time

from asyncua import Client, ua

url, node, count = sys.argv[1], sys.argv[2], int(sys.argv[3])


class Collector:
    """Takes what the client would send."""

    def __init__(self, transport: asyncio.Transport) -> None:
        self._transport = transport
        self.sent = bytearray()

    def write(self, data: bytes) -> None:
        self.sent += data

    def __getattr__(self, name: str) -> object:
        return getattr(self._transport, name)


async def main() -> None:
    async with Client(url, timeout=10) as client:
        namespace = await client.get_namespace_index("urn:drivebridge:points")
        word = client.get_node(f"ns={namespace};s={node}/command/control_word")
        for value in (0x047E, 0x047F):
            await asyncio.to_thread(sys.stdin.readline)
            while True:
                try:
                    await word.write_value(value, ua.VariantType.UInt16)
                except ua.uaerrors.BadTimeout:  # a busy machine has held it up
                    continue
                break
            print(f"{value:04X}", flush=True)
        await asyncio.to_thread(sys.stdin.readline)
        protocol = client.uaclient.protocol
        transport = protocol.transport
        protocol.transport = collector = Collector(transport)
        writes = [asyncio.create_task(word.write_value(0x047F, ua.VariantType.UInt16)) for _ in range(count)]
        end = time.monotonic() + 0.1
        while time.monotonic() < end:  # noqa: ASYNC110
            await asyncio.sleep(0)
        transport.write(bytes(collector.sent))
        print(time.monotonic(), flush=True)
        os.kill(os.getpid(), signal.SIGSTOP)
        await asyncio.gather(*writes)


asyncio.run(main())
