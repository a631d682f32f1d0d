"""The worst that a SCADA client does, again and again: worst_opcua.py PORT

It connects, browses the whole tree, creates 10,000 monitored items in one call, and goes. SIGTERM ends it.
"""

import asyncio
import sys
from pathlib import Path

from asyncua import Client, Node, ua

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.peers.watch_opcua import LEAVES, connected

ITEMS = 10_000
NODES = 10


class Silent:
    def datachange_notification(self, node: object, value: object, data: object) -> None: ...


async def browse(client: Client) -> int:
    """How many nodes are below Objects, each asked for what is below it."""
    waiting: list[Node] = [client.nodes.objects]
    known = {client.nodes.objects.nodeid}
    while waiting:
        children = await waiting.pop().get_children()
        new = [child for child in children if child.nodeid not in known]
        known.update(child.nodeid for child in new)
        waiting += new
    return len(known)


def item(where: ua.NodeId, handle: int) -> ua.MonitoredItemCreateRequest:
    request = ua.MonitoredItemCreateRequest()
    request.ItemToMonitor.NodeId = where
    request.ItemToMonitor.AttributeId = ua.AttributeIds.Value
    request.MonitoringMode = ua.MonitoringMode.Reporting
    request.RequestedParameters.ClientHandle = handle
    request.RequestedParameters.SamplingInterval = 100
    request.RequestedParameters.QueueSize = 1
    return request


async def main(port: int) -> None:
    while True:
        client = await connected(port)
        async with client:
            print("there", flush=True)
            print(f"browsed {await browse(client)}", flush=True)
            space = await client.get_namespace_index("urn:drivebridge:points")
            names = [f"n{number}/fu1/{leaf}" for number in range(1, NODES + 1) for leaf in LEAVES]
            subscription = await client.create_subscription(100, Silent())
            requests = [item(ua.NodeId(names[n % len(names)], space), n) for n in range(ITEMS)]
            results = await subscription.create_monitored_items(requests)
            print(f"created {sum(isinstance(result, int) for result in results)}", flush=True)


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1])))
