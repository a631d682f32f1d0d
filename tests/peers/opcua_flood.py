"""A SCADA client at its worst: 10,000 monitored items created at once.

opcua_flood.py URL COUNT
Prints `creating` and `created N` around the one call, then stays connected for two seconds.
"""

import asyncio
import sys
import time
from contextlib import AsyncExitStack

from asyncua import Client, ua

START_LIMIT_S = 30.0


async def connected(url: str) -> Client:
    """A client, as soon as the front is there."""
    end = time.monotonic() + START_LIMIT_S
    while True:
        client = Client(url, timeout=60)
        try:
            await client.connect()
        except OSError:
            if time.monotonic() > end:
                raise
            await asyncio.sleep(0.2)
        else:
            return client


async def main(url: str, count: int) -> None:
    async with AsyncExitStack() as stack:
        client = await connected(url)
        stack.push_async_callback(client.disconnect)
        namespace = await client.get_namespace_index("urn:drivebridge:points")
        drives = [f"conveyor/fu{n}" for n in (1, 2, 3, 4)]
        leaves = (
            "status/status_word",
            "status/state",
            "actual/value_1",
            "actual/frequency",
            "actual/current",
        )
        nodes = [f"ns={namespace};s={drive}/{leaf}" for drive in drives for leaf in leaves]
        subscription = await client.create_subscription(100, Silent())
        requests = [item(nodes[i % len(nodes)], i) for i in range(count)]
        print("creating", flush=True)
        results = await subscription.create_monitored_items(requests)
        good = sum(isinstance(result, int) for result in results)
        print(f"created {good}", flush=True)
        await asyncio.sleep(2.0)


def item(node: str, handle: int) -> ua.MonitoredItemCreateRequest:
    request = ua.MonitoredItemCreateRequest()
    request.ItemToMonitor.NodeId = ua.NodeId.from_string(node)
    request.ItemToMonitor.AttributeId = ua.AttributeIds.Value
    request.MonitoringMode = ua.MonitoringMode.Reporting
    request.RequestedParameters.ClientHandle = handle
    request.RequestedParameters.SamplingInterval = 100
    request.RequestedParameters.QueueSize = 1
    return request


class Silent:
    def datachange_notification(self, node: object, value: object, data: object) -> None: ...


asyncio.run(main(sys.argv[1], int(sys.argv[2])))
