"""Requests of tests to the OPC UA server, down to the status code of each item."""

from __future__ import annotations

from asyncua import Client, Node, ua

from tests.support.opcua_site import namespace


async def node(client: Client, name: str) -> Node:
    return client.get_node(ua.NodeId(name, await namespace(client)))


async def write(client: Client, **values: ua.Variant | ua.DataValue) -> list[int]:
    """Write command points of conveyor/fu1 in one call; the status codes in their order."""
    wanted: list[ua.WriteValue] = []
    for leaf, value in values.items():
        found = await node(client, f"conveyor/fu1/command/{leaf}")
        wanted.append(write_value(found.nodeid, value))
    return await write_all(client, wanted)


def write_value(where: ua.NodeId, value: ua.Variant | ua.DataValue) -> ua.WriteValue:
    data = value if isinstance(value, ua.DataValue) else ua.DataValue(value)
    return ua.WriteValue(NodeId=where, AttributeId=ua.AttributeIds.Value, Value=data)


async def write_all(client: Client, wanted: list[ua.WriteValue]) -> list[int]:
    results = await client.uaclient.write(ua.WriteParameters(NodesToWrite=wanted))
    return [result.value for result in results]


def word(value: int) -> ua.Variant:
    return ua.Variant(value, ua.VariantType.UInt16)


async def call(client: Client, owner: str, method: str, arguments: list[ua.Variant]) -> int:
    space = await namespace(client)
    request = ua.CallMethodRequest(
        ObjectId=ua.NodeId(owner, space), MethodId=ua.NodeId(method, space), InputArguments=arguments
    )
    (result,) = await client.uaclient.call([request])
    return result.StatusCode.value
