"""OPC UA servers whose values change all the time: python -m tests.bench.opcua_values KIND COUNT HZ

KIND is ``ours``, ``asyncua`` or ``open62541``. Each change is COUNT values at once. Prints
``serving URL NAMESPACE``: the NodeIds are ``s=value_0``… there, or ``s=line/drive/actual/value_0``… of ours.
"""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import AsyncIterator
from pathlib import Path
from tempfile import TemporaryDirectory

from asyncua import Server, ua

from bridge.config import OpcUaTable
from bridge.image import DataType, Image, Point
from bridge.northbound.opcua.models.site_space import NAMESPACE
from bridge.northbound.opcua.server import OpcUaServer
from tests.support.opcua_site import LocalView, make_plant
from tests.support.process import free_port

PEER_NAMESPACE = "urn:bench:values"


async def changes(hz: float) -> AsyncIterator[float]:
    """The next value, each time that it is due."""
    began = due = time.monotonic()
    while True:
        yield due - began
        due += 1 / hz
        await asyncio.sleep(due - time.monotonic())


class ChangingView(LocalView):
    """A view of ``count`` values and what the bridge says of itself. ``values`` are their places."""

    def __init__(self, count: int) -> None:
        super().__init__(make_plant())
        own = [point for point in self.image.points if point.name.startswith("bridge/")]
        names = [f"line/drive/actual/value_{n}" for n in range(count)]
        made = [Point(name=name, data_type=DataType.FLOAT, description="a value") for name in names]
        self.image = Image([*own, *made])
        self.values = range(len(own), len(own) + count)
        for index in self.values:
            self.image.set(index, 0.0, time.monotonic())


async def ours(count: int, hz: float) -> None:
    view = ChangingView(count)
    with TemporaryDirectory() as folder:
        settings = OpcUaTable(listen="127.0.0.1:0", no_security=True, anonymous="observer")
        server = OpcUaServer(view, settings, Path(folder), "bench")
        await server.start()
        print(f"serving {server.endpoint_url} {NAMESPACE}", flush=True)
        async for value in changes(hz):
            view.image.set_values(view.values, [value] * count, time.monotonic())


async def plain_asyncua(count: int, hz: float) -> None:
    server = Server()
    await server.init()
    url = f"opc.tcp://127.0.0.1:{free_port()}"
    server.set_endpoint(url)
    server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
    namespace = await server.register_namespace(PEER_NAMESPACE)
    folder = await server.nodes.objects.add_folder(namespace, "values")
    ids = [ua.NodeId(f"value_{n}", namespace) for n in range(count)]
    for number, node_id in enumerate(ids):
        await folder.add_variable(node_id, f"value_{number}", 0.0)
    async with server:
        print(f"serving {url} {PEER_NAMESPACE}", flush=True)
        async for value in changes(hz):
            for node_id in ids:
                told = ua.DataValue(ua.Variant(value, ua.VariantType.Double))
                await server.write_attribute_value(node_id, told)


async def open62541(count: int, hz: float) -> None:
    import o6

    port = free_port()
    server = o6.Server(port=port)
    names = [f"value_{n}" for n in range(count)]
    ids = [f"ns=1;s={name}" for name in names]
    for name, node_id in zip(names, ids, strict=True):
        server.addVariable(name, server.objectsNode, 0.0, nodeId=node_id)
    async with server:
        print(f"serving opc.tcp://127.0.0.1:{port} 1", flush=True)
        async for value in changes(hz):
            await server.write(ids, [o6.Double(value)] * count)


KINDS = {"ours": ours, "asyncua": plain_asyncua, "open62541": open62541}

if __name__ == "__main__":
    asyncio.run(KINDS[sys.argv[1]](int(sys.argv[2]), float(sys.argv[3])))
