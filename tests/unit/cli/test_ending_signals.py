"""Signals that end a command: the first is passed on, later ones change nothing, all is put back."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest

from bridge.cli.ending_signals import ENDING, EndingSignals


@pytest.fixture
def signals() -> Iterator[EndingSignals]:
    before = {number: signal.getsignal(number) for number in ENDING}
    yield EndingSignals()
    for number, handler in before.items():
        signal.signal(number, handler)


def test_which_signals_end_a_command() -> None:
    assert {one.name for one in map(signal.Signals, ENDING)} == {"SIGTERM", "SIGINT", "SIGHUP", "SIGQUIT"}


@pytest.mark.parametrize("number", ENDING)
def test_the_first_is_told_once_whatever_comes_after_it(signals: EndingSignals, number: int) -> None:
    told: list[str] = []
    signals.hold()
    signals.tell(lambda: told.append("end"))
    assert not signals.has_come
    for one in (number, *ENDING):
        signal.raise_signal(one)
    assert told == ["end"]
    assert signals.has_come


def test_who_asks_late_sees_that_one_has_come(signals: EndingSignals) -> None:
    signals.hold()
    signal.raise_signal(signal.SIGTERM)
    assert signals.has_come
    signals.hold()
    assert not signals.has_come, "a new beginning"


def test_after_the_release_all_is_as_before(signals: EndingSignals) -> None:
    before = signal.getsignal(signal.SIGTERM)
    signals.hold()
    assert signals.is_held
    assert signal.getsignal(signal.SIGTERM) is not before
    signals.release()
    assert not signals.is_held
    assert signal.getsignal(signal.SIGTERM) is before


def test_what_may_kill_ends_at_once_also_by_one_that_has_come(signals: EndingSignals) -> None:
    signals.hold()
    signals.let_kill()
    assert all(signal.getsignal(number) is signal.SIG_DFL for number in ENDING)
    assert not signals.is_held
    signals.hold()
    signal.raise_signal(signal.SIGINT)
    with pytest.raises(SystemExit) as caught:
        signals.let_kill()
    assert caught.value.code == 0
