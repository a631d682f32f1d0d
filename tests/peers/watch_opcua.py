"""Subscribes to the six values of each drive, until SIGTERM: watch_opcua.py PORT NODES REPORT

REPORT becomes a JSON file: for each node, when value 1 was seen to be what, as [monotonic s, value].
"""

import asyncio
import sys
import time
from pathlib import Path

from asyncua import Client, Node, ua

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.peers.last_words import report_on_sigterm

PERIOD_MS = 50
LEAVES = (
    "status/status_word",
    "actual/value_1",
    "actual/value_2",
    "actual/value_3",
    "actual/frequency",
    "actual/current",
)
WATCHED = "/actual/value_1"


class Seen:
    """What asyncua calls for each change."""

    def __init__(self, nodes: int) -> None:
        self.values: dict[int, list[tuple[float, int]]] = {number: [] for number in range(1, nodes + 1)}

    def datachange_notification(self, node: Node, value: object, data: object) -> None:
        name = node.nodeid.Identifier
        if isinstance(name, str) and name.endswith(WATCHED) and isinstance(value, int):
            self.values[int(name[1 : name.index("/")])].append((time.monotonic(), value))

    def status_change_notification(self, status: ua.StatusChangeNotification) -> None:
        print(f"the subscription: {status}", flush=True)


async def connected(port: int) -> Client:
    """The server may still be starting."""
    while True:
        client = Client(f"opc.tcp://127.0.0.1:{port}/drivebridge", timeout=30)
        try:
            await client.connect()
        except (OSError, TimeoutError, ua.UaError):
            await asyncio.sleep(0.2)
            continue
        return client


async def main(port: int, nodes: int, report: Path) -> None:
    seen = Seen(nodes)
    report_on_sigterm(report, lambda: seen.values)
    client = await connected(port)
    space = await client.get_namespace_index("urn:drivebridge:points")
    subscription = await client.create_subscription(PERIOD_MS, seen)
    names = [f"n{number}/fu1/{leaf}" for number in range(1, nodes + 1) for leaf in LEAVES]
    await subscription.subscribe_data_change([client.get_node(ua.NodeId(name, space)) for name in names])
    print("watching", flush=True)
    await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])))
