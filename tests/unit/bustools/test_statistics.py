"""Statistics of a bus: counts, gaps and bits by identifier, in the order in which they win the bus."""

from __future__ import annotations

import pytest

from bridge.bustools.statistics import Statistics
from bridge.canopen.frame import REMOTE, Frame


def heard(*frames: Frame) -> Statistics:
    statistics = Statistics(500_000)
    for frame in frames:
        statistics.on_frame(frame, f"{frame.can_id:X}")
    return statistics


def test_gaps_are_between_two_frames_of_an_identifier() -> None:
    times = (10.0, 10.1, 10.4, 10.5)
    (count,) = heard(*(Frame(0x185, b"", time) for time in times)).counts()
    assert (count.frames, count.label) == (4, "185")
    assert count.shortest_s == pytest.approx(0.1)
    assert count.longest_s == pytest.approx(0.3)
    assert count.mean_s == pytest.approx(0.5 / 3)


def test_one_frame_has_no_gap() -> None:
    (count,) = heard(Frame(0x185, b"", 10.0)).counts()
    assert (count.shortest_s, count.longest_s, count.mean_s) == (0.0, 0.0, 0.0)


def test_the_lowest_identifier_comes_first_and_what_is_asked_for_beside_its_question() -> None:
    found = heard(Frame(0x705), Frame(0x080), Frame(0x705 | REMOTE), Frame(0x185)).counts()
    assert [count.can_id for count in found] == [0x080, 0x185, 0x705, 0x705 | REMOTE]


def test_the_load_is_the_share_of_the_bits_that_the_bus_has_in_that_time() -> None:
    """47 bits and 3 between frames, with stuff bits at the most 55 (ISO 11898-1)."""
    statistics = heard(*(Frame(0x555, b"", float(number)) for number in range(100)))
    (count,) = statistics.counts()
    assert 4700 <= count.bits <= 5500
    assert statistics.load_percent(count, 1.0) == pytest.approx(100 * count.bits / 500_000)
    assert statistics.load_percent(count, 0.0) == 0.0
