"""Waits of the LSS master: for an answer as long as it takes, for silence the whole time; and its progress
meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from bridge.bustools import lss_task
from bridge.bustools.lss_task import LssTask
from bridge.canopen import lss
from bridge.canopen.lss import LssError, Service
from tests.support.lss_slave import CONFIGURATION, LssSlave
from tests.unit.canopen.test_lss import NORD, TIMEOUT_S, LssBus

ANSWER_S = 0.01
Make = Callable[[], Service[Any]]


def took(service: Service[Any], *slaves: LssSlave) -> float:
    bus = LssBus(*slaves, delay_s=ANSWER_S)
    bus.run(service)
    return bus.now - 100.0


@pytest.mark.parametrize(
    ("make", "answers"),
    [
        (lss.inquire_identity, 4),
        (lss.inquire_node_id, 1),
        (lambda: lss.configure_node_id(5), 1),
        (lambda: lss.configure_bit_rate(250_000), 1),
        (lss.store, 1),
    ],
)
def test_whoever_is_asked_alone_is_waited_for_until_it_answers(make: Make, answers: int) -> None:
    assert took(make(), LssSlave(NORD, state=CONFIGURATION)) == pytest.approx(answers * ANSWER_S)


@pytest.mark.parametrize("make", [lss.inquire_identity, lss.inquire_node_id, lss.store])
def test_silence_of_the_one_that_is_asked_ends_the_task(make: Make) -> None:
    bus = LssBus()
    task = bus.run(make())
    with pytest.raises(LssError, match="no answer"):
        _ = task.result
    assert bus.now - 100.0 == pytest.approx(TIMEOUT_S)


def test_a_question_to_all_takes_the_whole_time_whoever_answers() -> None:
    """The answers of several look the same: the last of them may still be under way."""
    assert took(lss.is_anybody_there()) == pytest.approx(TIMEOUT_S)
    assert took(lss.is_anybody_there(), LssSlave(NORD)) == pytest.approx(TIMEOUT_S)


def test_the_first_question_of_a_scan_waits_longer() -> None:
    """It is not known yet how quick the devices are."""
    assert took(lss.is_anybody_there(is_first=True)) > 2 * TIMEOUT_S


def test_late_answers_are_waited_for_a_whole_answer_time() -> None:
    assert took(lss.settle()) == pytest.approx(TIMEOUT_S)


@pytest.mark.parametrize(
    ("make", "step"),
    [
        (lambda: lss.switch_global(configuration=True), "all devices to configuration state"),
        (lss.to_waiting, "all devices to waiting state"),
        (lambda: lss.configure_bit_rate(250_000), "setting 250000 bit/s"),
        (lambda: lss.configure_bit_rate(None), "setting automatic bit rate"),
        (lambda: lss_task.inquire(NORD), "all devices to waiting state"),
        (lambda: lss_task.inquire(None), "all devices to configuration state"),
    ],
)
def test_the_step_is_told(make: Make, step: str) -> None:
    assert LssTask(make(), 0.0, TIMEOUT_S).step == step
