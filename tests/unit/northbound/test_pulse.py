"""The pulse of an event loop: when it has certainly looked, and whether it has hung."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import pytest

from bridge.command.messages.freshness import HANG_MS
from bridge.northbound.pulse import Pulse


class Case:
    def __init__(self) -> None:
        self.now = 100.0
        self.pulse = Pulse(lambda: self.now)

    def beats_at(self, now: float) -> None:
        """The loop's timer runs late or in time: what it does is called here."""
        self.now = now
        if self.pulse._timer:
            self.pulse._timer.cancel()
        self.pulse._beat()


@pytest.fixture
async def case() -> Iterator[Case]:  # type: ignore[misc]
    case = Case()
    case.pulse.start()
    yield case
    case.pulse.stop()


async def test_what_is_read_later_came_after_the_beat_before_the_last(case: Case) -> None:
    case.beats_at(100.01)
    assert case.pulse.look == (100.0, float("-inf"))
    case.beats_at(100.02)
    assert case.pulse.look == (100.01, float("-inf"))


async def test_a_hang_is_told_from_its_end_on(case: Case) -> None:
    late = 100.0 + HANG_MS / 1000 + 0.001
    case.beats_at(late)
    assert case.pulse.look == (100.0, late)
    case.beats_at(late + 0.01)
    assert case.pulse.look == (late, late), "and stays known"


async def test_a_pause_that_is_no_hang_is_none(case: Case) -> None:
    case.beats_at(100.0 + HANG_MS / 1000 - 0.001)
    assert case.pulse.look.steady_since == float("-inf")


async def test_a_start_forgets_a_hang_and_the_end_ends_it(case: Case) -> None:
    case.beats_at(110.0)
    case.pulse.stop()
    case.now = 200.0
    case.pulse.start()
    assert case.pulse.look == (200.0, float("-inf"))
    case.pulse.stop()
    case.pulse.stop()
    look = case.pulse.look
    await asyncio.sleep(0)
    assert case.pulse.look == look
