"""Each fault that was injected is told, by a bridge that could see it."""

from __future__ import annotations

import pytest

from bridge.command import Event, EventKind
from bridge.text import Text
from tests.plant.causes import Causes
from tests.plant.oracle import Oracle
from tests.proof.drives import DRIVES

BUS = "can0"
SAID = Text.plain("something")


@pytest.fixture
def causes() -> Causes:
    found = Causes(Oracle([DRIVES[0]]))
    found.owes(EventKind.INTRUDER, BUS, 1010.0, 1010.5, "an intruder")
    return found


def wrong(causes: Causes, at: float = 1010.6, *, is_still: bool = False) -> list[str]:
    causes.look(at, is_still=is_still)
    return causes._oracle.violations  # pyright: ignore[reportPrivateUsage]


def test_what_is_told_in_time_is_told(causes: Causes) -> None:
    causes.told(Event(1010.01, EventKind.INTRUDER, BUS, 900, SAID), 1010.02)
    assert not wrong(causes)


@pytest.mark.parametrize(
    ("kind", "source", "at"),
    [
        (EventKind.BUS, BUS, 1010.02),
        (EventKind.INTRUDER, "can1", 1010.02),
        (EventKind.INTRUDER, BUS, 1009.9),
        (EventKind.INTRUDER, BUS, 1010.55),
    ],
)
def test_another_event_does_not_tell_it(causes: Causes, kind: EventKind, source: str, at: float) -> None:
    causes.told(Event(at, kind, source, 900, SAID), at)
    (text,) = wrong(causes)
    assert text == "10.500 s: an intruder at 10.000 s, and no event says so"


def test_before_its_time_is_up_nothing_is_wrong(causes: Causes) -> None:
    assert not wrong(causes, 1010.4)


def test_a_bridge_that_was_disturbed_has_not_seen_it(causes: Causes) -> None:
    causes.disturbed(1010.1)
    assert not wrong(causes)


def test_nor_has_one_that_stands_still(causes: Causes) -> None:
    causes.look(1010.4, is_still=True)
    assert not wrong(causes)


def test_what_was_over_long_before_excuses_nothing(causes: Causes) -> None:
    causes.disturbed(1009.0)
    assert wrong(causes)


def test_what_is_known_only_long_after_was_told_in_time() -> None:
    causes = Causes(Oracle([DRIVES[0]]))
    causes.told(Event(1010.01, EventKind.WATCHDOG, DRIVES[0].path, 900, SAID), 1010.01)
    causes.look(1020.0, is_still=False)
    causes.owes(EventKind.WATCHDOG, DRIVES[0].path, 1010.0, 1010.1, "a silence")
    assert not wrong(causes, 1020.1)


def test_what_comes_after_it_is_due_excuses_nothing(causes: Causes) -> None:
    causes.disturbed(1010.55)
    assert wrong(causes)
