"""The Call service: methods of drives, nodes and buses become requests."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from typing import Final

from asyncua.server.address_space import AddressSpace

from bridge.command.request import Action, Identity, Request
from bridge.northbound.opcua.library import AttributeIds, StatusCodes, get, make, status, ua
from bridge.northbound.opcua.nodes import MethodNode
from bridge.northbound.opcua.values import INTEGER_TYPES
from bridge.northbound.opcua.writes import ask
from bridge.northbound.view import View

_DIRECTIONS: Final = (-1, 0, 1)


class Caller:
    """Carries out Call requests on the methods of the address space."""

    def __init__(self, view: View, space: AddressSpace, methods: Mapping[ua.NodeId, MethodNode]) -> None:
        self._view = view
        self._space = space
        self._methods = methods

    async def call(
        self, identity: Identity, calls: Sequence[ua.CallMethodRequest]
    ) -> list[ua.CallMethodResult]:
        """One result for each of ``calls``, in their order; they are begun in that order, too."""
        return list(await asyncio.gather(*(self._call(identity, call) for call in calls)))

    async def _call(self, identity: Identity, call: ua.CallMethodRequest) -> ua.CallMethodResult:
        method_id: ua.NodeId = get(call, "MethodId")
        refusal = self._refusal(call, method_id)
        if refusal is not None:
            return _result(refusal)
        method = self._methods[method_id]
        arguments: list[ua.Variant] = get(call, "InputArguments") or []
        wanted = 1 if method.argument else 0
        if len(arguments) != wanted:
            few = len(arguments) < wanted
            return _result(StatusCodes.BadArgumentsMissing if few else StatusCodes.BadTooManyArguments)
        value = 0
        if method.argument:
            value, fault = _argument(method, arguments[0])
            if fault:
                return _result(StatusCodes.BadInvalidArgument, [status(fault)])
        code = await ask(self._view, _request(identity, method, value))
        return _result(code.value, [status(StatusCodes.Good)] * wanted)

    def _refusal(self, call: ua.CallMethodRequest, method_id: ua.NodeId) -> int | None:
        node = self._space.get(method_id)
        owner = self._space.get(get(call, "ObjectId"))
        if node is None or owner is None:
            return StatusCodes.BadNodeIdUnknown
        method = self._methods.get(method_id)
        if method is None:
            return StatusCodes.BadMethodInvalid
        if (
            owner.nodeid.Identifier != method.target
            or owner.nodeid.NamespaceIndex != method_id.NamespaceIndex
        ):
            return StatusCodes.BadMethodInvalid
        executable = self._space.read_attribute_value(method_id, AttributeIds.Executable).Value
        if executable is None or not executable.Value:
            return StatusCodes.BadNotExecutable
        return None


def _argument(method: MethodNode, given: ua.Variant) -> tuple[int, int]:
    """The argument's value and 0, or 0 and what is wrong with it. Any integer type is taken."""
    if given.is_array or given.VariantType not in INTEGER_TYPES or not method.argument:
        return 0, StatusCodes.BadTypeMismatch
    low, high = method.argument.type.value
    in_range = low <= given.Value <= high
    if not in_range or (method.action is Action.START and given.Value not in _DIRECTIONS):
        return 0, StatusCodes.BadOutOfRange
    return given.Value, 0


def _request(identity: Identity, method: MethodNode, value: int) -> Request:
    match method.action:
        case Action.START:
            return Request(identity, method.target, method.action, direction=value)
        case Action.TAKE_CONTROL:
            return Request(identity, method.target, method.action, ttl_ms=value)
        case _:
            return Request(identity, method.target, method.action)


def _result(code: int, arguments: Sequence[ua.StatusCode] = ()) -> ua.CallMethodResult:
    return make(ua.CallMethodResult, StatusCode=status(code), InputArgumentResults=list(arguments))
