"""Reads and writes of a drive's parameters: the transfers, and the meaning of each answer."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import TypeVar

import pytest

from bridge.image import Value
from bridge.mapping.model import ObjectRef, Parameter
from bridge.parameter import DriveParameters, Ledger, Names, ParameterError, Transfer, TransferFailed, Why
from bridge.parameter.definition import ParameterEntry
from bridge.text import Text
from tests.support import sites
from tests.support.gates import ENGINEER_AT_REST

T = TypeVar("T")
FAMILY = sites.family("cia402/velocity")
PLACE = ObjectRef(0x3FF0, 0)
NO_OBJECT, TIME_OUT = 0x0602_0000, 0x0504_0000


def entry(**more: object) -> ParameterEntry:
    keys = {"name": "own", "title": "own", "data_type": "int16", "object": "3FF0:00"}
    return ParameterEntry("own", PLACE, Parameter.model_validate({**keys, **more}))


OWN = entry()


class Drive:
    """Holds one number; ``accepts`` makes of what is written what is kept."""

    def __init__(self, value: int = 5, accepts: Callable[[bytes], bytes] = lambda data: data) -> None:
        self.data = value.to_bytes(2, "little", signed=True)
        self.accepts = accepts
        self.fails: dict[bool, TransferFailed] = {}
        """Failures of transfers, by whether they are writes."""
        self.loses_answer = False
        self.done: list[bytes | None] = []
        self.now = 100.0
        self.access = DriveParameters("conveyor/drive", "conveyor", FAMILY, Names(FAMILY), Ledger())

    def run(self, steps: Generator[Transfer, tuple[bytes, float], T]) -> T:
        answer: tuple[bytes, float] | TransferFailed | None = None
        while True:
            try:
                if isinstance(answer, TransferFailed):
                    transfer = steps.throw(answer)
                else:
                    transfer = next(steps) if answer is None else steps.send(answer)
            except StopIteration as end:
                return end.value
            self.done.append(transfer.data)
            self.now += 0.1
            answer = self.fails.get(transfer.data is not None) or (self._answer(transfer.data), self.now)
            if self.loses_answer and transfer.data is not None:
                answer = TransferFailed(Text.plain("silent"), TIME_OUT, by_drive=False)

    def _answer(self, data: bytes | None) -> bytes:
        if data is not None:
            self.data = self.accepts(data)
            return b""
        return self.data

    def writes(self, value: Value, one: ParameterEntry = OWN, expected: Value | None = None):
        return self.run(self.access.write(one, value, self.now, ENGINEER_AT_REST, expected))

    def reads(self, max_age_s: float = 0.0, one: ParameterEntry = OWN):
        return self.run(self.access.read(one, self.now, max_age_s))


def why(call: Callable[[], object]) -> Why:
    with pytest.raises(ParameterError) as caught:
        call()
    return caught.value.why


def test_a_value_is_read_from_the_drive_or_is_not_older_than_was_asked_for() -> None:
    drive = Drive()
    assert drive.reads().value == 5
    drive.data = b"\7\0"
    assert drive.reads(10.0).value == 5
    assert drive.reads().value == 7
    assert drive.done == [None, None]
    drive.access.forget()
    assert drive.access.cached(OWN) is None


def test_what_is_there_already_is_not_written() -> None:
    drive = Drive(5)
    written = drive.writes(5)
    assert (written.changed, written.reading.value, written.before) == (False, 5, 5)
    assert drive.done == [None]


def test_a_value_is_written_and_read_back() -> None:
    drive = Drive(5)
    written = drive.writes(-2)
    assert drive.done == [None, b"\xfe\xff", None]
    assert (written.changed, written.reading.value, written.before) == (True, -2, 5)


def test_a_drive_that_keeps_another_value_is_told() -> None:
    drive = Drive(5, accepts=lambda data: b"\6\0")
    with pytest.raises(ParameterError, match="own: the drive took the value and holds 6") as caught:
        drive.writes(9)
    assert caught.value.why is Why.NOT_TAKEN


def test_an_answer_that_was_lost_is_no_failure_where_the_value_is_there() -> None:
    drive = Drive(5)
    drive.loses_answer = True
    assert drive.writes(9).reading.value == 9
    kept = Drive(5, accepts=lambda data: b"\5\0")
    kept.loses_answer = True
    assert why(lambda: kept.writes(9)) is Why.NO_ANSWER


def test_a_refusal_is_the_last_word_and_nothing_is_read_back() -> None:
    drive = Drive(5)
    drive.fails[True] = TransferFailed(Text.plain("too high"), 0x0609_0031, by_drive=True)
    assert why(lambda: drive.writes(9)) is Why.REFUSED
    assert drive.done[-1] is not None


@pytest.mark.parametrize(
    ("access", "call", "reason"),
    [
        ("ro", "write", Why.READ_ONLY),
        ("wo", "read", Why.WRITE_ONLY),
    ],
)
def test_what_its_access_does_not_allow_costs_no_transfer(access: str, call: str, reason: Why) -> None:
    drive, one = Drive(), entry(access=access)
    assert why(lambda: drive.writes(9, one) if call == "write" else drive.reads(0.0, one)) is reason
    assert drive.done == []


def test_what_holds_the_expected_value_is_written() -> None:
    drive = Drive(5)
    assert drive.writes(7, expected=5).reading.value == 7
    assert drive.data == b"\x07\x00"


@pytest.mark.parametrize("expected", [4, 6, -5, 7])
def test_what_holds_another_value_than_expected_is_not_written(expected: int) -> None:
    """Also where it holds already what was to be written: somebody else has written it."""
    drive = Drive(5)
    for value in (7, 5):
        assert why(lambda value=value: drive.writes(value, expected=expected)) is Why.OTHER_VALUE
    assert drive.done == [None, None], "read, and nothing more"


def test_what_is_expected_is_compared_with_what_the_drive_holds_now() -> None:
    drive = Drive(5)
    drive.reads()
    drive.data = b"\x06\x00"
    assert why(lambda: drive.writes(7, expected=5)) is Why.OTHER_VALUE


def test_what_cannot_be_read_cannot_hold_what_is_expected() -> None:
    drive = Drive(5)
    assert why(lambda: drive.writes(1, entry(command=True), expected=5)) is Why.WRITE_ONLY
    assert drive.done == []


def test_a_command_is_written_blindly_and_is_given_when_the_drive_answers() -> None:
    drive = Drive(5)
    written = drive.writes(1, entry(command=True))
    assert drive.done == [b"\1\0"]
    assert (written.changed, written.before) == (True, None)


def test_a_value_that_does_not_fit_is_not_sent() -> None:
    drive = Drive(5)
    assert why(lambda: drive.writes(40_000)) is Why.OUT_OF_RANGE
    assert drive.done == [None]


def test_a_drive_that_is_silent_is_told_apart_from_one_that_refuses() -> None:
    for by_drive, reason in ((True, Why.REFUSED), (False, Why.NO_ANSWER)):
        drive = Drive()
        drive.fails[False] = TransferFailed(
            Text.plain("no"), NO_OBJECT if by_drive else TIME_OUT, by_drive=by_drive
        )
        assert why(drive.reads) is reason


def test_who_compares_writes_nothing() -> None:
    drive = Drive(5)
    reading, same = drive.run(drive.access.compare(OWN, 5, 100.0))
    assert (reading.value, same) == (5, True)
    assert not drive.run(drive.access.compare(OWN, 6, 100.0))[1]
    assert drive.done == [None], "the value of a moment ago"
