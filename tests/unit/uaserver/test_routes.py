"""The table of services that are carried out; no server."""

from __future__ import annotations

from collections.abc import Coroutine
from types import SimpleNamespace
from typing import Any

import pytest
from asyncua import ua
from asyncua.common.utils import Buffer
from asyncua.ua.ua_binary import struct_from_binary, struct_to_binary

from bridge.uaserver.encoding import encode
from bridge.uaserver.library import ServiceError
from bridge.uaserver.routes import MOST_CALLS, MOST_OPERATIONS, ROUTES, Route, ServiceRequest
from bridge.uaserver.services import REFUSED, SERVICES, request_type

Codes = ua.StatusCodes
LEFT_TO_ASYNCUA = {"CreateSession", "ActivateSession", "CloseSession"}


def test_each_service_of_a_session_is_carried_out_or_refused() -> None:
    kinds = SERVICES.keys() - {"Discovery", "SecureChannel"}
    names = {one.name for kind in kinds for one in SERVICES[kind]} - LEFT_TO_ASYNCUA
    assert {request_type(name) for name in names} == {*ROUTES} | {
        one for one in REFUSED if one in {request_type(name) for name in names}
    }
    assert not set(ROUTES) & set(REFUSED)


def test_each_route_names_what_its_messages_have() -> None:
    for route in ROUTES.values():
        params, response = (getattr(ua, f"{route.name}{end}")() for end in ("Parameters", "Response"))
        assert all(hasattr(params, field) for field in route.operations.split()), route.name
        found: Any = response
        for field in filter(None, route.answer.split(".")):
            assert hasattr(found, field) or route.act is None, route.name
            found = getattr(found, field, None)


async def carried_out(route: Route, params: object) -> list[Any]:
    sent: list[Any] = []

    async def at_once(work: Coroutine[Any, Any, None]) -> None:
        await work

    request = ServiceRequest(None, Buffer(struct_to_binary(params)), sent.append, lambda: True, at_once)
    session: Any = SimpleNamespace(most_bytes=1_000_000, answer=None)
    await route.carry_out(session, request)
    return sent


@pytest.mark.parametrize(
    ("count", "code"),
    [(0, Codes.BadNothingToDo), (MOST_CALLS, None), (MOST_CALLS + 1, Codes.BadTooManyOperations)],
)
async def test_operations_are_counted_before_anything_is_done(count: int, code: int | None) -> None:
    async def act(session: object, params: object) -> list[ua.CallMethodResult]:
        return []

    route = Route("Call", act, "MethodsToCall", most=MOST_CALLS)
    params = ua.CallParameters(MethodsToCall=[ua.CallMethodRequest() for _ in range(count)])
    if code is None:
        (response,) = await carried_out(route, params)
        assert isinstance(response, ua.CallResponse)
        assert struct_from_binary(ua.CallResponse, Buffer(encode(response))).Results == []
        return
    with pytest.raises(ServiceError) as refused:
        await carried_out(route, params)
    assert refused.value.code == code


async def test_registered_nodes_are_given_back_as_they_are() -> None:
    nodes = [ua.NodeId("a", 1), ua.NodeId(7)]
    params = ua.RegisterNodesParameters(NodesToRegister=nodes)
    (response,) = await carried_out(ROUTES[request_type("RegisterNodes")], params)
    assert response.Parameters.RegisteredNodeIds == nodes
    assert MOST_OPERATIONS >= MOST_CALLS
