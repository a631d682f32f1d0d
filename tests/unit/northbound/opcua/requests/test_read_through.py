"""Reads that go through to the drives, with a view of the test; time passes where it is waited for."""

from __future__ import annotations

import asyncio
from typing import Any

from asyncua import ua

from bridge.command.messages.request import Code, Identity, Outcome, ReadParameter, Role, Source
from bridge.image import DataType, Point
from bridge.northbound.opcua.requests.read_through import LIMIT_S, MOST_AT_ONCE, ReadThrough
from bridge.northbound.opcua.space.nodes import VariableKind, VariableNode
from tests.support.virtual_loop import VirtualLoop

OTTO = Identity(Source.OPCUA, "otto", Role.OBSERVER)


class View:
    """Answers what is in ``outcomes``, and nothing else."""

    def __init__(self, **outcomes: Outcome) -> None:
        self.outcomes = outcomes
        self.requests: list[Any] = []

    def submit(self, request: Any, reply: Any) -> None:
        self.requests.append(request)
        if request.command.parameter in self.outcomes:
            reply(self.outcomes[request.command.parameter])


def parameter(where: ua.NodeId) -> VariableNode | None:
    name = str(where.Identifier)
    if "/parameter/" not in name:
        return None
    return VariableNode(name, "", VariableKind.PLAIN, Point(name=name, data_type=DataType.FLOAT), 0)


def nodes(*leaves: str) -> list[ua.NodeId]:
    return [ua.NodeId(f"conveyor/fu1/parameter/{leaf}", 2) for leaf in leaves]


def reader(view: Any) -> ReadThrough:
    return ReadThrough(view, parameter)


def test_parameters_alone_are_wanted_each_once_and_not_without_end() -> None:
    first, second = nodes("p102", "p103")
    word = ua.NodeId("conveyor/fu1/status/status_word", 2)
    assert reader(None).wanted([first, word, second, first]) == [first, second]
    many = nodes(*map(str, range(100)))
    assert reader(None).wanted(many) == many[:MOST_AT_ONCE]


def test_what_is_refused_is_told_with_its_reason_and_the_rest_is_in_the_image() -> None:
    view = View(p1=Outcome(Code.OK, value=2.0), p2=Outcome(Code.REFUSED_BY_DRIVE, abort_code=0x0609_0011))
    good, bad = nodes("p1", "p2")
    refused = asyncio.run(reader(view).read(OTTO, [good, bad]))
    assert [(one.target, one.command) for one in view.requests] == [
        ("conveyor/fu1", ReadParameter("p1")),
        ("conveyor/fu1", ReadParameter("p2")),
    ]
    assert refused.keys() == {bad}
    code, why = refused[bad]
    assert code.value == ua.StatusCodes.BadNotFound
    assert "06090011h" in why.more


def test_what_takes_too_long_stays_as_it_was() -> None:
    loop = VirtualLoop()
    view = View(p1=Outcome(Code.OK))
    try:
        assert loop.run_until_complete(reader(view).read(OTTO, nodes("p1", "p2"))) == {}
        assert loop.time() == LIMIT_S
    finally:
        loop.close()
