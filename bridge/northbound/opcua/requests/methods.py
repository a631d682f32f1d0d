"""The Call service: methods of drives, nodes and buses become requests."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

from asyncua.server.address_space import AddressSpace

from bridge.command.messages.request import (
    PARAMETER_ACTIONS,
    Action,
    Code,
    Command,
    Identity,
    Outcome,
    Request,
    command_of,
)
from bridge.image import Value
from bridge.northbound.opcua.requests.outcome_texts import explanation, outcome_text
from bridge.northbound.opcua.requests.writes import ask
from bridge.northbound.opcua.space.data_values import (
    INTEGER_TYPES,
    outcome_status,
    plain_value,
    plain_variant,
    rejection,
)
from bridge.northbound.opcua.space.nodes import EXPECTED, OUTCOME, Argument, ArgumentType, MethodNode
from bridge.northbound.view import View
from bridge.uaserver.explanations import Explain, Explanation
from bridge.uaserver.hierarchy import related
from bridge.uaserver.library import (
    AttributeIds,
    ObjectIds,
    ServiceError,
    StatusCodes,
    get,
    make,
    status,
    ua,
    variant,
)

_DIRECTIONS: Final = (-1, 0, 1)
_AT_FAULT: Final = {
    Code.UNKNOWN_PARAMETER: "name",
    Code.READ_ONLY: "name",
    Code.WRITE_ONLY: "name",
    Code.OUT_OF_RANGE: "value",
    Code.OTHER_VALUE: "expected",
}
"""Argument at fault in a parameter method, by outcome code."""


class Caller:
    """Carries out Call requests on the methods that ``method`` finds."""

    def __init__(
        self, view: View, space: AddressSpace, method: Callable[[ua.NodeId], MethodNode | None]
    ) -> None:
        self._view = view
        self._space = space
        self._method = method

    async def call(
        self, identity: Identity, calls: Sequence[ua.CallMethodRequest], explain: Explain
    ) -> list[ua.CallMethodResult]:
        """One result for each of ``calls``, in their order; they are begun in that order, too. What the plant
        refuses is explained."""
        called = (self._call(identity, call, partial(explain, place)) for place, call in enumerate(calls))
        return list(await asyncio.gather(*called))

    async def _call(
        self, identity: Identity, call: ua.CallMethodRequest, explain: Callable[[Explanation], None]
    ) -> ua.CallMethodResult:
        method_id: ua.NodeId = get(call, "MethodId")
        method = self._method(method_id)
        refusal = self._refusal(call, method_id)
        if refusal is not None or method is None:
            return self._rejected(identity, call, refusal or StatusCodes.BadMethodInvalid)
        given: list[ua.Variant] = get(call, "InputArguments") or []
        if len(given) != len(method.arguments):
            few = len(given) < len(method.arguments)
            code = StatusCodes.BadArgumentsMissing if few else StatusCodes.BadTooManyArguments
            return self._rejected(identity, call, code)
        faults = [StatusCodes.Good] * len(given)
        values: list[Value] = []
        for place, (argument, one) in enumerate(zip(method.arguments, given, strict=True)):
            try:
                values.append(_argument(method, argument, one))
            except ServiceError as error:
                faults[place] = int(error.code)
        if any(faults):
            return self._rejected(identity, call, StatusCodes.BadInvalidArgument, faults)
        outcome = await ask(self._view, Request(identity, method.target, _command(method, values)))
        if not outcome.ok:
            explain(explanation(outcome))
        wrong = _AT_FAULT.get(outcome.code) if method.action in PARAMETER_ACTIONS else None
        names = [argument.name for argument in method.arguments]
        if wrong in names:
            faults[names.index(wrong)] = outcome_status(outcome).value
            return call_result(StatusCodes.BadInvalidArgument, faults)
        return call_result(outcome_status(outcome).value, results=_results(method, outcome))

    def _rejected(
        self, identity: Identity, call: ua.CallMethodRequest, code: int, faults: Sequence[int] = ()
    ) -> ua.CallMethodResult:
        """Result of a call that becomes no request; the rejection is reported to the audit log."""
        method = self._method(get(call, "MethodId"))
        action = method.action if method else "call"
        target = method.target if method else str(get(call, "ObjectId").Identifier)
        if action != Action.READ_PARAMETER:
            self._view.rejected(rejection(identity, target, action, code, {}))
        return call_result(code, faults)

    def _refusal(self, call: ua.CallMethodRequest, method_id: ua.NodeId) -> int | None:
        owner = self._space.get(get(call, "ObjectId"))
        if owner is None:
            return StatusCodes.BadNodeIdUnknown
        method = self._method(method_id)
        if method is None:
            return StatusCodes.BadMethodInvalid
        # The drive's object, or the MethodSet of its device (Part 4 §5.11.2: who has it as a component).
        having = related(self._space, owner.nodeid, ObjectIds.HasComponent)
        if all(get(found, "NodeId") != method_id for found in having):
            return StatusCodes.BadMethodInvalid
        executable = self._space.read_attribute_value(method_id, AttributeIds.Executable).Value
        if executable is None or not executable.Value:
            return StatusCodes.BadNotExecutable
        return None


def _results(method: MethodNode, outcome: Outcome) -> list[ua.Variant]:
    """Output arguments: none where the method has failed."""
    if not outcome.ok:
        return []
    if OUTCOME in method.results:
        return [variant(outcome_text(outcome), ua.VariantType.LocalizedText)]
    return [] if outcome.value is None else [plain_variant(outcome.value)]


def _command(method: MethodNode, values: Sequence[Value]) -> Command:
    """The command that a method is called for."""
    named = dict(zip((argument.name for argument in method.arguments), values, strict=True))
    conditions = {name: named.pop(name) for name in (EXPECTED.name,) if name in named}
    return command_of(method.action, *named.values(), **conditions)


def _argument(method: MethodNode, argument: Argument, given: ua.Variant) -> Value:
    """The argument's value. Any integer type is taken for an integer. Raises ServiceError."""
    kind = argument.type.value
    if not isinstance(kind, tuple):
        try:
            value = plain_value(given)
        except TypeError:
            raise ServiceError(StatusCodes.BadTypeMismatch) from None
        if argument.type is not ArgumentType.ANY and not isinstance(value, str):
            raise ServiceError(StatusCodes.BadTypeMismatch)
        return value
    if given.is_array or given.VariantType not in INTEGER_TYPES:
        raise ServiceError(StatusCodes.BadTypeMismatch)
    low, high = kind
    in_range = low <= given.Value <= high
    if not in_range or (method.action is Action.START and given.Value not in _DIRECTIONS):
        raise ServiceError(StatusCodes.BadOutOfRange)
    return given.Value


def call_result(
    code: int, arguments: Sequence[int] = (), results: Sequence[ua.Variant] = ()
) -> ua.CallMethodResult:
    """``arguments`` are told with BadInvalidArgument alone (Part 4 §5.12.2.2)."""
    return make(
        ua.CallMethodResult,
        StatusCode=status(code),
        InputArgumentResults=[status(one) for one in arguments],
        OutputArguments=list(results),
    )
