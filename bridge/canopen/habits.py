"""Habits of devices that the standard does not allow, by what is heard of them: a table and its counters.

A device with such a habit seems to be silent, for its frames do not count. What counts is said from the
table: one row for each kind of frame. A device that plays a habit is a file in ``bridge/sim/habits``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType
from typing import Final

_NAMED_FROM: Final = 3
"""Fewer such frames may be a disturbance, or another device."""
_AGAIN_AFTER: Final = 10
"""A habit is news once more when it has shown this many times as often."""


class Odd(Enum):
    """Oddity of a frame."""

    SDO_LENGTH = "an SDO answer of another length"
    HEARTBEAT_LENGTH = "an error control message of another length"
    EMCY_LENGTH = "an emergency message of another length"
    TPDO_LENGTH = "a TPDO that is longer or shorter than its mapping"
    TPDO_LENGTH_BY_FILE = "the same where only the mapping file tells the mapping"
    SDO_LATE = "an SDO answer after the time-out"


@dataclass(frozen=True, slots=True)
class HabitWording:
    """Sentences about one kind of odd frame: of ``one`` or of ``many``, and what is right.

    ``count`` is their number; the last of them ``has`` so many bytes or ms where ``due`` are right.
    """

    one: str
    many: str
    right: str

    def said(self, count: int, has: int, due: int) -> str:
        template = f"{self.one if count == 1 else self.many}: {self.right}"
        return template.format(count=count, has=has, due=due)


HABITS: Final[Mapping[Odd, HabitWording]] = MappingProxyType(
    {
        Odd.SDO_LENGTH: HabitWording(
            "{count} SDO answer of {has} bytes",
            "{count} SDO answers of {has} bytes",
            "not CiA 301 §7.2.4.3, an SDO has {due}",
        ),
        Odd.HEARTBEAT_LENGTH: HabitWording(
            "{count} heartbeat of {has} bytes",
            "{count} heartbeats of {has} bytes",
            "not CiA 301 §7.2.8.3, a heartbeat has {due}",
        ),
        Odd.EMCY_LENGTH: HabitWording(
            "{count} emergency message of {has} bytes",
            "{count} emergency messages of {has} bytes",
            "not CiA 301 §7.2.7, an emergency message has {due}",
        ),
        Odd.TPDO_LENGTH: HabitWording(
            "{count} TPDO of {has} bytes",
            "{count} TPDOs of {has} bytes",
            "not CiA 301 §7.2.2, the mapping has {due}",
        ),
        Odd.TPDO_LENGTH_BY_FILE: HabitWording(
            "{count} TPDO of {has} bytes",
            "{count} TPDOs of {has} bytes",
            "the mapping file has {due}",
        ),
        Odd.SDO_LATE: HabitWording(
            "{count} SDO answer {has} ms after the request",
            "{count} SDO answers {has} ms after the request",
            "sdo_timeout_ms is {due}",
        ),
    }
)


@dataclass(frozen=True, slots=True)
class HabitCount:
    """Number of times that one has shown, and the numbers of the last frame; ``str()`` is the sentence."""

    odd: Odd
    count: int
    has: int
    due: int

    def __str__(self) -> str:
        return HABITS[self.odd].said(self.count, self.has, self.due)


@dataclass(slots=True)
class _HabitCounter:
    """``last`` are the numbers of the last frame: what it has, and what is right."""

    last: tuple[int, int]
    count: int = 0
    news_from: int = _NAMED_FROM


class HabitCounter:
    """Odd frames of one node, counted since the first."""

    def __init__(self) -> None:
        self._counts: dict[Odd, _HabitCounter] = {}
        self.has_news = False
        """``take_news`` has something to tell."""

    def note(self, odd: Odd, has: int, due: int) -> None:
        """A frame that ``has`` so many bytes, or came after so many milliseconds, where ``due`` are right."""
        counted = self._counts.setdefault(odd, _HabitCounter((has, due)))
        counted.count += 1
        counted.last = has, due
        self.has_news |= counted.count >= counted.news_from

    def said(self, least: int = 1) -> list[HabitCount]:
        """Each habit that has shown at least ``least`` times."""
        return [_shown(odd, one) for odd, one in self._counts.items() if one.count >= least]

    def habits(self) -> list[HabitCount]:
        """Habits of ``said`` that are too frequent for a disturbance."""
        return self.said(_NAMED_FROM)

    def take_news(self) -> list[HabitCount]:
        """New ones of ``habits`` since the last call, and those that are ten times as frequent."""
        self.has_news = False
        news: list[HabitCount] = []
        for odd, one in self._counts.items():
            if one.count >= one.news_from:
                news.append(_shown(odd, one))
                while one.news_from <= one.count:
                    one.news_from *= _AGAIN_AFTER
        return news


def _shown(odd: Odd, counted: _HabitCounter) -> HabitCount:
    return HabitCount(odd, counted.count, *counted.last)
