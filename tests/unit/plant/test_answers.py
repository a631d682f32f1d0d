"""Answers beside the wire: what is not so is named, and a good bridge is taken for a good one."""

from __future__ import annotations

import pytest

from bridge.command import Action, Code, Identity, Outcome, Request, Source, Write, command_of
from tests.plant.answers import Answers
from tests.plant.oracle import START, Oracle
from tests.proof.drives import DRIVES

DRIVE = DRIVES[0]
FAMILY = DRIVE.family
WHO = Identity(Source.OPCUA, "controller 0")
SETPOINT = FAMILY.setpoint + 3
OK, NOT_FORWARDED = Outcome(Code.OK), Outcome(Code.OK, forwarded=False)


class Scene:
    """A request that comes at 1010 s, and its answer 10 ms later."""

    def __init__(self) -> None:
        self.oracle = Oracle([DRIVE])
        self.answers = Answers(self.oracle, [DRIVE])

    def asks(self, command: Action | None = None, at: float = 1010.0) -> None:
        values = {"control_word": FAMILY.run, "setpoint_1": SETPOINT}
        asked = command_of(command) if command else Write(values)
        self.answers.asked(("", 1), Request(WHO, DRIVE.path, asked), at)

    def is_answered(self, outcome: Outcome, at: float = 1010.01) -> None:
        self.answers.answered(("", 1), outcome, at)

    def sees(self, at: float, word: int, setpoint: int = SETPOINT) -> None:
        data = word.to_bytes(FAMILY.control_bytes, "little") + setpoint.to_bytes(2, "little")
        self.oracle.frame(at, DRIVE.rpdo, data, of_bridge=True)
        self.oracle.violations = [one for one in self.oracle.violations if "has not asked" not in one]

    def wrong(self, at: float = 1020.0, *, is_still: bool = False) -> str:
        self.answers.look(at, is_still=is_still)
        return " ".join(self.oracle.violations)


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_a_setpoint_that_was_forwarded_is_on_the_wire(scene: Scene) -> None:
    scene.asks()
    scene.is_answered(OK)
    scene.sees(1010.05, FAMILY.run)
    assert not scene.wrong()


def test_one_that_is_not_is_named(scene: Scene) -> None:
    scene.asks()
    scene.is_answered(OK)
    scene.sees(1010.05, FAMILY.run, SETPOINT - 1)
    assert "its setpoint was not on the wire" in scene.wrong()


def test_a_newer_telegram_may_have_taken_its_place(scene: Scene) -> None:
    scene.asks()
    scene.is_answered(OK)
    scene.oracle.telegram(DRIVE, 1010.02, FAMILY.run)
    assert not scene.wrong()


@pytest.mark.parametrize(("heard_at", "is_quiet"), [(1009.0, True), (1010.0, False)])
def test_a_drive_that_is_not_heard_may_have_got_a_stop_instead(
    scene: Scene, heard_at: float, is_quiet: bool
) -> None:
    scene.answers.is_quiet = lambda: is_quiet
    scene.oracle.frame(heard_at, DRIVE.tpdo, b"\0\0", of_bridge=False)
    scene.asks()
    scene.is_answered(OK)
    scene.sees(1010.02, FAMILY.ready, 0)
    assert not scene.wrong()


def test_one_that_is_heard_has_not(scene: Scene) -> None:
    scene.oracle.frame(1010.0, DRIVE.tpdo, b"\0\0", of_bridge=False)
    scene.asks()
    scene.is_answered(OK)
    scene.sees(1010.02, FAMILY.ready, 0)
    assert "its setpoint was not on the wire" in scene.wrong()


@pytest.mark.parametrize("outcome", [NOT_FORWARDED, Outcome(Code.NOT_ALLOWED)])
def test_what_was_not_forwarded_is_never_on_the_wire(scene: Scene, outcome: Outcome) -> None:
    scene.asks()
    scene.is_answered(outcome)
    scene.sees(1011.0, FAMILY.run, SETPOINT - 1)
    assert not scene.wrong(1011.5)
    scene.sees(1012.0, FAMILY.run)
    assert "its setpoint is on the wire at 12.000 s" in scene.wrong()


def test_nor_what_was_refused_by_an_exception(scene: Scene) -> None:
    scene.answers.refused(DRIVE, SETPOINT, 1010.0, 1010.01, 1)
    scene.sees(1010.5, FAMILY.run)
    assert "exception 01h" in scene.wrong()


def test_a_stop_that_was_forwarded_is_on_the_wire(scene: Scene) -> None:
    scene.asks(Action.STOP)
    scene.is_answered(OK)
    scene.sees(1010.05, FAMILY.ready)
    assert not scene.wrong()


def test_a_stop_that_is_not_is_named(scene: Scene) -> None:
    scene.asks(Action.STOP)
    scene.is_answered(OK)
    scene.sees(1009.0, FAMILY.ready)
    assert "no RPDO has told the drive to stop" in scene.wrong()


def test_a_stop_that_was_not_forwarded_owes_nothing(scene: Scene) -> None:
    scene.asks(Action.STOP)
    scene.is_answered(NOT_FORWARDED)
    assert not scene.wrong()


def test_a_bridge_that_is_disturbed_meanwhile_owes_nothing_of_the_wire(scene: Scene) -> None:
    scene.asks(Action.STOP)
    scene.is_answered(OK)
    scene.answers.disturbed(1010.02)
    assert not scene.wrong()


def test_each_request_has_one_answer(scene: Scene) -> None:
    scene.asks(Action.STOP)
    scene.is_answered(NOT_FORWARDED)
    scene.is_answered(NOT_FORWARDED)
    assert "is answered twice" in scene.wrong()


def test_one_without_an_answer_is_named_after_ten_seconds(scene: Scene) -> None:
    scene.asks(Action.STOP)
    assert not scene.wrong(1019.9)
    assert "has no answer" in scene.wrong(1020.1)


def test_a_bridge_that_stands_still_or_has_ended_owes_none(scene: Scene) -> None:
    scene.asks(Action.STOP)
    assert not scene.wrong(1015.0, is_still=True)
    assert not scene.wrong(1024.0)
    scene.answers.ended(1024.5)
    assert not scene.wrong(1050.0)


def test_followed_is_what_the_drive_has_said(scene: Scene) -> None:
    value, off = FAMILY.enabled[1], FAMILY.stops["disable_voltage"][1]
    scene.sees(1009.9, off)
    scene.oracle.frame(1010.0, DRIVE.tpdo, value.to_bytes(2, "little") + bytes(6), of_bridge=False)
    scene.answers.last_stop(DRIVE, 1010.2, 1.0, 1.0)
    assert not scene.oracle.violations
    scene.answers.last_stop(DRIVE, 1010.2, 1.0, 2.0)
    assert "followed, and the drive has not said" in scene.oracle.violations[0]
    scene.oracle.violations.clear()
    scene.oracle.frame(1010.3, DRIVE.tpdo, bytes(8), of_bridge=False)
    scene.answers.last_stop(DRIVE, 1010.5, 1.0, 2.0)
    assert not scene.oracle.violations


@pytest.mark.parametrize(("outcome", "is_good"), [(NOT_FORWARDED, True), (Outcome(Code.NOT_ALLOWED), False)])
def test_a_start_begins_with_what_was_taken_and_not_with_what_was_refused(
    scene: Scene, outcome: Outcome, is_good: bool
) -> None:
    scene.asks()
    scene.is_answered(outcome)
    scene.oracle.telegram(DRIVE, 1011.0, START)
    scene.oracle.telegram(DRIVE, 1013.0, START)
    scene.sees(1012.0, FAMILY.run)
    assert bool(scene.wrong()) is not is_good


@pytest.mark.parametrize(("said_at", "is_wrong"), [(1009.5, True), (1010.03, False)])
def test_what_a_drive_has_said_before_its_stop_is_no_answer(
    scene: Scene, said_at: float, is_wrong: bool
) -> None:
    told: list[float] = []
    scene.oracle.on_stop = lambda drive, at: told.append(at)
    scene.sees(1009.9, FAMILY.run)
    for at in (1010.0, 1010.05):
        scene.sees(at, FAMILY.ready)
    assert told == [1010.0], "the first word that stops"
    scene.oracle.frame(said_at, DRIVE.tpdo, bytes(8), of_bridge=False)
    scene.answers.still_running(DRIVE, 1010.0, 1010.05, 1.0)
    assert not scene.oracle.violations
    scene.answers.still_running(DRIVE, 1010.0, 1010.05, 2.0)
    assert bool(scene.oracle.violations) is is_wrong


@pytest.mark.parametrize(
    ("said", "had", "has", "is_wrong"),
    [
        (50.0, 50.0, 50.0, False),
        (100.0, 50.0, 50.0, True),
        (50.0, 50.0, 100.0, False),
        (None, 50.0, 50.0, True),
    ],
)
def test_a_parameter_is_read_as_what_the_drive_has(
    scene: Scene, said: float | None, had: float, has: float, is_wrong: bool
) -> None:
    scene.answers.parameter_read(DRIVE, "P105", said, had, has, 1010.0)
    assert bool(scene.oracle.violations) is is_wrong


@pytest.mark.parametrize(("got_at", "is_wrong"), [(1010.01, False), (1012.0, True)])
def test_a_refusal_that_is_told_is_somebodys_answer(scene: Scene, got_at: float, is_wrong: bool) -> None:
    scene.asks(at=got_at - 0.005)
    scene.answers.refusal_told(DRIVE.path, 1010.0)
    scene.is_answered(Outcome(Code.NOT_ALLOWED, forwarded=False), got_at)
    assert ("that nobody has got" in scene.wrong()) is is_wrong


def test_a_front_that_hangs_may_get_it_late(scene: Scene) -> None:
    scene.answers.refusal_told(DRIVE.path, 1010.0)
    scene.answers.front_disturbed(1009.5)
    assert not scene.wrong()
