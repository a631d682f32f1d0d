"""Writes of points, with a view of the test; no server."""

from __future__ import annotations

from typing import Any

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace, NodeData

from bridge.command.messages.request import Code, Identity, Outcome, Role, Source
from bridge.northbound.opcua.requests.writes import Writer
from bridge.northbound.opcua.space.nodes import ObjectNode, VariableNode, layout
from bridge.uaserver.arrivals import received_at
from bridge.uaserver.explanations import Explanation
from tests.support.opcua_site import make_plant

Codes, Kind, Ids = ua.StatusCodes, ua.VariantType, ua.AttributeIds
EVA = Identity(Source.OPCUA, "eva", Role.ENGINEER)
WORD, SETPOINT = "conveyor/fu1/command/control_word", "conveyor/fu1/command/setpoint_1"
OTHER = "conveyor/fu2/command/control_word"
STATUS = "conveyor/fu1/status/status_word"


class View:
    def __init__(self) -> None:
        self.requests: list[Any] = []
        self.rejections: list[Any] = []

    def submit(self, request: Any, reply: Any) -> None:
        self.requests.append(request)
        reply(Outcome(Code.NOT_ALLOWED if request.target.endswith("fu2") else Code.OK))

    def rejected(self, rejection: Any) -> None:
        self.rejections.append(rejection)


def variables(node: ObjectNode) -> dict[str, VariableNode]:
    found = {one.id: one for word in node.variables for one in (word, *word.bits) if one.writable}
    for below in node.objects:
        found |= variables(below)
    return found


KNOWN = variables(layout(make_plant().image.points)[0])


class Rig:
    def __init__(self) -> None:
        self.view, space = View(), AddressSpace()
        for name in (*KNOWN, STATUS):
            node = NodeData(ua.NodeId(name, 2))
            node.attributes = {Ids.Value: None, Ids.DisplayName: None}
            space[node.nodeid] = node
        view: Any = self.view
        self.explained: dict[int, Explanation] = {}
        self.writer = Writer(view, space, lambda where: KNOWN.get(str(where.Identifier)))

    async def write(self, *writes: ua.WriteValue) -> list[int]:
        return [one.value for one in await self.writer.write(EVA, writes, self.explained.__setitem__)]


@pytest.fixture
def rig() -> Rig:
    return Rig()


def to(name: str, value: object = 7, attribute: int = Ids.Value, code: int = 0) -> ua.WriteValue:
    written = ua.Variant(value, Kind.UInt16 if isinstance(value, int) else None)
    return ua.WriteValue(ua.NodeId(name, 2), attribute, "", ua.DataValue(written, ua.StatusCode(code)))


async def test_what_one_drive_is_told_is_one_telegram(rig: Rig) -> None:
    codes = await rig.write(to(WORD, 1), to(OTHER, 2), to(SETPOINT, 3))
    assert codes == [Codes.Good, Codes.BadUserAccessDenied, Codes.Good]
    told = {one.target: dict(one.command.values) for one in rig.view.requests}
    assert told == {"conveyor/fu1": {"control_word": 1, "setpoint_1": 3}, "conveyor/fu2": {"control_word": 2}}


async def test_the_same_point_twice_is_two_telegrams_in_their_order(rig: Rig) -> None:
    await rig.write(to(WORD, 1), to(SETPOINT, 9), to(WORD, 2))
    assert [dict(one.command.values) for one in rig.view.requests] == [
        {"control_word": 1, "setpoint_1": 9},
        {"control_word": 2},
    ]


async def test_there_is_no_half_a_telegram(rig: Rig) -> None:
    codes = await rig.write(to(WORD, 1), to(SETPOINT, "x"))
    assert codes == [Codes.BadTypeMismatch, Codes.BadTypeMismatch]
    assert rig.view.requests == []
    (told,) = rig.view.rejections
    assert told.values == {"control_word": 1, "setpoint_1": "x"}


@pytest.mark.parametrize(
    ("write", "code"),
    [
        (to("conveyor/fu1/command/nothing"), Codes.BadNodeIdUnknown),
        (to(STATUS), Codes.BadNotWritable),
        (to(WORD, attribute=Ids.DisplayName), Codes.BadNotWritable),
        (to(WORD, attribute=Ids.Executable), Codes.BadAttributeIdInvalid),
        (to(WORD, code=Codes.BadTimeout), Codes.BadWriteNotSupported),
    ],
)
async def test_what_cannot_be_written_is_refused_and_reported(
    rig: Rig, write: ua.WriteValue, code: int
) -> None:
    assert await rig.write(write) == [code]
    assert (rig.view.requests, len(rig.view.rejections)) == ([], 1)


async def test_a_request_says_when_its_message_came(rig: Rig) -> None:
    received_at.set(12.5)
    await rig.write(to(WORD))
    assert [one.received_at for one in rig.view.requests] == [12.5]


def bit(name: str, value: object = True) -> ua.WriteValue:
    return ua.WriteValue(ua.NodeId(f"{WORD}/{name}", 2), Ids.Value, "", ua.DataValue(ua.Variant(value)))


async def test_bits_of_one_call_are_one_telegram(rig: Rig) -> None:
    assert await rig.write(bit("ready_for_operation"), to(SETPOINT, 5), bit("enable_operation", False)) == [
        0,
        0,
        0,
    ]
    (request,) = rig.view.requests
    assert request.command.values == {"control_word.0": True, "setpoint_1": 5, "control_word.3": False}


async def test_the_same_bit_twice_is_two_telegrams(rig: Rig) -> None:
    assert await rig.write(bit("acknowledge_fault"), bit("acknowledge_fault", False)) == [0, 0]
    assert [one.command.values for one in rig.view.requests] == [
        {"control_word.7": True},
        {"control_word.7": False},
    ]


@pytest.mark.parametrize("value", [1, "true", 1.0, [True]])
async def test_a_bit_is_true_or_false(rig: Rig, value: object) -> None:
    assert await rig.write(bit("ready_for_operation", value)) == [Codes.BadTypeMismatch]
    assert not rig.view.requests


async def test_what_the_plant_refuses_is_explained_at_each_of_its_places(rig: Rig) -> None:
    rig.explained.clear()

    def word(where: str) -> ua.WriteValue:
        value = ua.DataValue(ua.Variant(0, Kind.UInt16))
        return ua.WriteValue(NodeId=ua.NodeId(where, 2), AttributeId=Ids.Value, Value=value)

    await rig.write(word(OTHER), word(WORD))
    assert {place: one.symbol for place, one in rig.explained.items()} == {0: Code.NOT_ALLOWED.value}
