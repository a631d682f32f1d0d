"""Procedures on an SDO channel: results with their times, refusals, and writes that are not begun."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any, cast

import pytest

from bridge.canopen.sdo import Result, SdoChannel, SdoError
from bridge.mapping.model import ObjectRef
from bridge.node.parameters.run import run
from bridge.parameter import ParameterError, Transfer, TransferFailed, Why
from bridge.text import Text

PLACE = ObjectRef(0x2066, 1)
Steps = Generator[Transfer, tuple[bytes, float], object]


class Case:
    def __init__(self) -> None:
        self.now = 10.0
        self.reads: list[tuple[int, int]] = []
        self.writes: list[dict[str, Any]] = []
        self.open: list[Callable[[Result], None]] = []
        self.results: list[object] = []

    def read(self, index: int, sub: int, now: float, done: Callable[[Result], None], **more: Any) -> None:
        self.reads.append((index, sub))
        self.open.append(done)

    def write(self, *place: Any, **more: Any) -> None:
        index, sub, data, _, done = place
        self.writes.append({"place": (index, sub), "data": data, **more})
        self.open.append(done)

    def runs(self, steps: Steps) -> None:
        run(steps, lambda transfer: cast("SdoChannel", self), lambda: self.now, self.results.append)


@pytest.fixture
def case() -> Case:
    return Case()


def test_a_value_is_as_old_as_the_request_that_read_it(case: Case) -> None:
    def steps() -> Steps:
        return (yield Transfer(PLACE))

    case.runs(steps())
    case.now = 11.0
    case.open[0](b"\1")
    assert case.results == [(b"\1", 10.0)]
    assert case.reads == [(0x2066, 1)]


def test_a_refusal_is_thrown_into_it_and_says_who_has_refused(case: Case) -> None:
    seen: list[TransferFailed] = []

    def steps() -> Steps:
        try:
            yield Transfer(PLACE)
        except TransferFailed as failure:
            seen.append(failure)
        return "went on"

    case.runs(steps())
    case.open[0](SdoError(0x2066, 1, 0x0602_0000, by_server=True))
    assert (seen[0].abort_code, seen[0].by_drive) == (0x0602_0000, True)
    assert case.results == ["went on"]


def test_its_own_error_is_its_result(case: Case) -> None:
    def steps() -> Steps:
        yield Transfer(PLACE)
        raise ParameterError(Why.NOT_TAKEN, Text.plain("no"))

    case.runs(steps())
    case.open[0](b"\1")
    (result,) = case.results
    assert isinstance(result, ParameterError)
    assert result.why is Why.NOT_TAKEN


def test_a_write_is_not_repeated_and_is_judged_when_its_turn_comes(case: Case) -> None:
    why = ["the drive is enabled"]

    def steps() -> Steps:
        return (yield Transfer(PLACE, b"\1", why_not=lambda: why[0]))

    case.runs(steps())
    (write,) = case.writes
    assert (write["data"], write["repeatable"]) == (b"\1", False)
    assert not write["may_begin"]()
    case.open[0](SdoError(0x2066, 1, 0x0504_0000, by_server=False))
    (result,) = case.results
    assert isinstance(result, ParameterError)
    assert (result.why, str(result)) == (Why.PROTECTED, "the drive is enabled")


def test_one_that_nothing_speaks_against_is_begun(case: Case) -> None:
    def steps() -> Steps:
        return (yield Transfer(PLACE, b"\1", why_not=lambda: ""))

    case.runs(steps())
    assert case.writes[0]["may_begin"]()
    case.open[0](b"")
    assert case.results == [(b"", 10.0)]


def test_a_procedure_that_asks_nothing_ends_at_once(case: Case) -> None:
    def steps() -> Steps:
        return 7
        yield Transfer(PLACE)

    case.runs(steps())
    assert case.results == [7]
