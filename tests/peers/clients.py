"""Any number of clients that do what clients do, until SIGTERM: clients.py PROTOCOL PORT COUNT NODES

modbus: each reads ten registers of a drive ten times a second. opcua: each subscribes to the six values of a
drive at 250 ms. zenoh: each subscribes to a drive. Client n has drive n, and those after the last begin anew.
"""

import asyncio
import sys
from pathlib import Path

from asyncua import ua
from pymodbus.client import AsyncModbusTcpClient

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.peers import watch_opcua, watch_zenoh

READ_EVERY_S = 0.1
PUBLISHING_MS = 250


async def reads_registers(port: int, unit: int) -> None:
    client = AsyncModbusTcpClient("127.0.0.1", port=port)
    if not await client.connect():
        raise SystemExit(f"no Modbus server on port {port}")

    async def read() -> None:
        while True:
            await client.read_input_registers(0, count=10, device_id=unit)
            await asyncio.sleep(READ_EVERY_S)

    asyncio.create_task(read())  # noqa: RUF006 - for as long as the process lives


async def watches_values(port: int, node: int) -> None:
    client = await watch_opcua.connected(port)
    space = await client.get_namespace_index("urn:drivebridge:points")
    subscription = await client.create_subscription(PUBLISHING_MS, watch_opcua.Seen(node))
    names = [f"n{node}/fu1/{leaf}" for leaf in watch_opcua.LEAVES]
    await subscription.subscribe_data_change([client.get_node(ua.NodeId(name, space)) for name in names])


def subscribes(port: int, node: int) -> object:
    session = watch_zenoh.connected(port)
    return session, session.declare_subscriber(f"{watch_zenoh.TOP}/n{node}/**", lambda sample: None)


async def main(protocol: str, port: int, count: int, nodes: int) -> None:
    targets = [number % nodes + 1 for number in range(count)]
    if protocol == "zenoh":
        held = [subscribes(port, node) for node in targets]
        print(f"{len(held)} are there", flush=True)
        await asyncio.Event().wait()
    for node in targets:
        await (reads_registers if protocol == "modbus" else watches_values)(port, node)
    print(f"{count} are there", flush=True)
    await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], *map(int, sys.argv[2:])))
