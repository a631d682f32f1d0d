"""Fault numbers that drives keep: when they are asked for, what is taken for none, and what is no number."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import pytest

from bridge.canopen.sdo import Result, SdoError
from bridge.drive import DriveState
from bridge.node.fault_reading import FaultReading
from bridge.node.places.sdo_channels import SdoChannels
from tests.support import sites
from tests.support.nodes import node_of

FAULT_WORD, ENABLED_WORD = 0x0008, 0x0237
"""NORD's (BU 2500 §6.5.2)."""


class Channels:
    """Notes what is asked over each; the answers are given by the test."""

    def __init__(self) -> None:
        self.asked: list[tuple[int, int]] = []
        self.open: list[Callable[[Result], None]] = []

    def __getitem__(self, number: int) -> Channels:
        return self

    def read(self, index: int, sub: int, now: float, done: Callable[[Result], None], **more: Any) -> None:
        self.asked.append((index, sub))
        self.open.append(done)


class Case:
    def __init__(self) -> None:
        self.node = node_of(sites.drive("fu1", "none", 0, ""))
        (self.drive,) = self.node.drives
        self.channels = Channels()
        self.reading = FaultReading(self.node, cast("SdoChannels", self.channels))

    def at(self, now: float) -> int:
        """How many questions go out then."""
        self.channels.asked.clear()
        self.channels.open.clear()
        self.reading.on_time(now)
        return len(self.channels.asked)


@pytest.fixture
def case() -> Case:
    case = Case()
    case.reading.start(10.0)
    return case


def test_each_drive_is_asked_once_for_what_it_remembers(case: Case) -> None:
    assert case.reading.next_deadline() == 10.0
    assert case.at(10.0) >= 1
    assert len(set(case.channels.asked)) == len(case.channels.asked)
    assert case.at(10.5) == case.at(11.0) == 0


def test_a_drive_in_fault_is_asked_again_and_again_and_once_more_at_its_end(case: Case) -> None:
    case.at(10.0)
    case.drive.channel.on_status_word(FAULT_WORD, 10.1)
    assert case.drive.channel.state is DriveState.FAULT
    asked = [now / 10 for now in range(105, 145, 5) if case.at(now / 10)]
    assert asked == [10.5, 11.5, 12.5, 13.5]
    case.drive.channel.on_status_word(ENABLED_WORD, 14.1)
    assert case.at(14.5)
    assert not case.at(15.0)


def test_an_emergency_has_it_asked_at_once(case: Case) -> None:
    case.at(10.0)
    case.reading.on_emcy(case.drive, 10.1)
    assert case.reading.next_deadline() == 10.1
    assert case.at(10.1)


def test_what_it_answers_is_its_fault(case: Case) -> None:
    case.at(10.0)
    case.channels.open[0]((30).to_bytes(2, "little"))
    assert case.drive.channel.current_fault == 3.0


def test_a_refusal_is_no_number_and_changes_nothing(case: Case) -> None:
    case.at(10.0)
    for done in case.channels.open:
        done(SdoError(0x2000, 1, 0x0602_0000, by_server=True))
    assert case.drive.channel.current_fault == 0.0


def test_of_a_node_that_is_gone_nothing_is_asked(case: Case) -> None:
    case.reading.stop()
    assert case.reading.next_deadline() is None
    case.reading.on_emcy(case.drive, 10.1)
    assert case.at(99.0) == 0
