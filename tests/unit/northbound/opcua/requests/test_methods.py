"""Calls of methods, with a view of the test; no server."""

from __future__ import annotations

from typing import Any

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace, AttributeValue, NodeData

from bridge.command.messages.request import Code, Identity, Outcome, Role, Source, WriteParameter
from bridge.northbound.opcua.requests.methods import Caller
from bridge.northbound.opcua.space.nodes import MethodNode, ObjectNode, layout
from bridge.text import Text
from bridge.uaserver.explanations import Explanation
from bridge.uaserver.languages import speaking
from tests.support.opcua_site import make_plant

Codes, Kind = ua.StatusCodes, ua.VariantType
EVA = Identity(Source.OPCUA, "eva", Role.ENGINEER)
DRIVE = "conveyor/fu1"


class View:
    def __init__(self) -> None:
        self.requests: list[Any] = []
        self.rejections: list[Any] = []
        self.outcome = Outcome(Code.OK)

    def submit(self, request: Any, reply: Any) -> None:
        self.requests.append(request)
        reply(self.outcome)

    def rejected(self, rejection: Any) -> None:
        self.rejections.append(rejection)


def methods(node: ObjectNode) -> dict[str, MethodNode]:
    found = {method.id: method for method in node.methods}
    for below in node.objects:
        found |= methods(below)
    return found


class Rig:
    def __init__(self) -> None:
        self.view, space = View(), AddressSpace()
        known = methods(layout(make_plant().image.points)[0])
        executable = AttributeValue(ua.DataValue(ua.Variant(True)))
        for name in {name.rpartition("/")[0] for name in known} | {*known}:
            node = NodeData(ua.NodeId(name, 2))
            node.attributes = {ua.AttributeIds.Executable: executable}
            space[node.nodeid] = node
        for name in known:
            component = ua.ReferenceDescription(
                ReferenceTypeId=ua.NodeId(ua.ObjectIds.HasComponent), NodeId=ua.NodeId(name, 2)
            )
            space[ua.NodeId(name.rpartition("/")[0], 2)].references.append(component)
        self.space = space
        view: Any = self.view
        self.explained: dict[int, Explanation] = {}
        self.caller = Caller(view, space, lambda where: known.get(str(where.Identifier)))

    async def call(
        self, method: str, *arguments: ua.Variant, owner: str = DRIVE, namespace: int = 2
    ) -> ua.CallMethodResult:
        call = ua.CallMethodRequest(ua.NodeId(owner, 2), ua.NodeId(method, namespace), list(arguments))
        (result,) = await self.caller.call(EVA, [call], self.explained.__setitem__)
        return result


@pytest.fixture(scope="module")
def rig() -> Rig:
    return Rig()


@pytest.fixture(autouse=True)
def forget(rig: Rig) -> None:
    rig.view.requests.clear()
    rig.view.rejections.clear()
    rig.view.outcome = Outcome(Code.OK)


async def test_a_call_is_a_request_and_its_result_the_outcome(rig: Rig) -> None:
    result = await rig.call(f"{DRIVE}/Start", ua.Variant(1, Kind.Int32))
    assert result.StatusCode.value == Codes.Good
    (request,) = rig.view.requests
    assert (request.target, request.action, request.identity) == (DRIVE, "start", EVA)
    rig.view.outcome = Outcome(Code.NOT_ALLOWED)
    assert (await rig.call(f"{DRIVE}/Stop")).StatusCode.value == Codes.BadUserAccessDenied


@pytest.mark.parametrize(
    ("method", "arguments", "code"),
    [
        (f"{DRIVE}/Nothing", [], Codes.BadMethodInvalid),
        (DRIVE, [], Codes.BadMethodInvalid),
        ("conveyor/Reset", [], Codes.BadMethodInvalid),  # of the node, not of the drive
        (f"{DRIVE}/Start", [], Codes.BadArgumentsMissing),
        (f"{DRIVE}/Stop", [ua.Variant(1)], Codes.BadTooManyArguments),
        (f"{DRIVE}/Start", [ua.Variant(2, Kind.Int32)], Codes.BadInvalidArgument),
        (f"{DRIVE}/Start", [ua.Variant(1.0, Kind.Double)], Codes.BadInvalidArgument),
        (f"{DRIVE}/ReadParameter", [ua.Variant(7, Kind.Int32)], Codes.BadInvalidArgument),
    ],
)
async def test_what_is_no_call_is_refused_and_reported(
    rig: Rig, method: str, arguments: list[ua.Variant], code: int
) -> None:
    result = await rig.call(method, *arguments)
    assert result.StatusCode.value == code
    assert rig.view.requests == []
    assert len(rig.view.rejections) == (not method.endswith("ReadParameter"))


async def test_only_an_object_is_told_to_be_unknown(rig: Rig) -> None:
    """Part 4 §5.12.2.4: BadNodeIdUnknown is of the object, BadMethodInvalid of the method."""
    for owner, code in (("nowhere", Codes.BadNodeIdUnknown), (DRIVE, Codes.BadMethodInvalid)):
        assert (await rig.call(f"{DRIVE}/Nothing", owner=owner)).StatusCode.value == code


async def test_a_call_that_is_carried_out_tells_nothing_of_its_arguments(rig: Rig) -> None:
    """Part 4 §5.12.2.2: the list is empty but for BadInvalidArgument."""
    result = await rig.call(f"{DRIVE}/Start", ua.Variant(1, Kind.Int32))
    assert result.StatusCode.value == Codes.Good
    assert result.InputArgumentResults == []


async def test_the_argument_that_an_outcome_is_about_is_named(rig: Rig) -> None:
    rig.view.outcome = Outcome(Code.OUT_OF_RANGE)
    name, value = ua.Variant("P102"), ua.Variant(1e9, Kind.Double)
    result = await rig.call(f"{DRIVE}/WriteParameter", name, value)
    assert result.StatusCode.value == Codes.BadInvalidArgument
    assert [one.value for one in result.InputArgumentResults] == [Codes.Good, Codes.BadOutOfRange]


async def test_a_parameter_is_written_if_it_holds_what_is_expected(rig: Rig) -> None:
    given = ua.Variant("P102"), ua.Variant(2.0, Kind.Double), ua.Variant(3.0, Kind.Double)
    result = await rig.call(f"{DRIVE}/WriteParameterIf", *given)
    assert result.StatusCode.value == Codes.Good
    (request,) = rig.view.requests
    assert request.command == WriteParameter("P102", 3.0, expected=2.0)
    rig.view.outcome = Outcome(Code.OTHER_VALUE)
    result = await rig.call(f"{DRIVE}/WriteParameterIf", *given)
    assert [one.value for one in result.InputArgumentResults] == [0, Codes.BadInvalidState, 0]


async def test_a_parameter_that_was_read_is_the_result(rig: Rig) -> None:
    rig.view.outcome = Outcome(Code.OK, value=2.5)
    result = await rig.call(f"{DRIVE}/ReadParameter", ua.Variant("P102"))
    (found,) = result.OutputArguments
    assert (found.Value, found.VariantType) == (2.5, Kind.Double)


async def test_what_came_of_a_call_is_its_result_in_words(rig: Rig) -> None:
    for outcome, words in (
        (Outcome(Code.OK), "ausgeführt"),
        (Outcome(Code.OK, forwarded=False), "angenommen, aber nicht an den Antrieb gesendet"),
    ):
        rig.view.outcome = outcome
        (found,) = (await rig.call(f"{DRIVE}/Stop")).OutputArguments
        with speaking(["de"]):
            assert (found.Value.Text, found.VariantType) == (words, Kind.LocalizedText)
    rig.view.outcome = Outcome(Code.NOT_ALLOWED, Text.of("opcua.ends"))
    assert (await rig.call(f"{DRIVE}/Stop")).OutputArguments == []
    assert rig.explained[0].symbol == "opcua.ends"
