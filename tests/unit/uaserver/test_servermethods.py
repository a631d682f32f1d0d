"""Methods of the Server object, without a server; what they answer on the wire is in ``tests/wire/opcua``."""

from __future__ import annotations

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace

from bridge.uaserver.servermethods import SERVER_METHODS, ServerCalls
from bridge.uaserver.subscriptions.subscriptions import Subscriptions
from tests.support.opcua_sessions import Session

Codes, Ids = ua.StatusCodes, ua.ObjectIds
SERVER = ua.NodeId(Ids.Server)


def request(method: int, *arguments: ua.Variant, of: ua.NodeId = SERVER) -> ua.CallMethodRequest:
    return ua.CallMethodRequest(of, ua.NodeId(method), list(arguments))


def number(value: int) -> ua.Variant:
    return ua.Variant(value, ua.VariantType.UInt32)


def test_two_methods_are_the_servers_own() -> None:
    assert set(SERVER_METHODS) == {ua.NodeId(Ids.Server_GetMonitoredItems), ua.NodeId(Ids.Server_ResendData)}


@pytest.mark.parametrize(
    ("call", "code"),
    [
        (request(Ids.Server_ResendData), Codes.BadArgumentsMissing),
        (request(Ids.Server_ResendData, number(1), number(1)), Codes.BadTooManyArguments),
        (request(Ids.Server_ResendData, ua.Variant([1], ua.VariantType.UInt32)), Codes.BadInvalidArgument),
        (request(Ids.Server_ResendData, number(7)), Codes.BadSubscriptionIdInvalid),
        (request(Ids.Server_ResendData, number(1), of=ua.NodeId(1)), Codes.BadMethodInvalid),
        (request(Ids.Server_ResendData, number(1)), Codes.Good),
        (request(Ids.Server_GetMonitoredItems, number(2)), Codes.BadUserAccessDenied),
    ],
)
async def test_a_call_has_its_code(call: ua.CallMethodRequest, code: int) -> None:
    there, owner = Subscriptions(AddressSpace()), Session()
    for one in (owner, Session()):
        there.create(one, ua.CreateSubscriptionParameters(RequestedPublishingInterval=1e6))
    assert ServerCalls(there, owner).call(call).StatusCode.value == code
    for one in list(there.subscriptions.values()):
        await there.end(one.owner, delete=True)
