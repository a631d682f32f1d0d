"""The EEPROM guard: how often each parameter was written, and which writes are too many.

Writing wears an EEPROM out: NORD's endures 100,000 writes (BU 2500 §6.6). Each write is counted by drive and
object and kept across restarts (``ledger_file``); a warning comes at every tenth of what the family's EEPROM
endures. More than ``MOST_WRITES`` writes of a parameter within ``WINDOW_S``, or more than ``MOST_A_DAY``
within a day, are cyclic writing, which no EEPROM is made for, and are refused; so is every write
beyond what the EEPROM endures.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from bridge.parameter.error import ParameterError, Why
from bridge.text import Said, Text

MOST_WRITES: Final = 10
WINDOW_S: Final = 600.0
MOST_A_DAY: Final = 100
DAY_S: Final = 86_400.0
_WINDOWS: Final = ((MOST_WRITES, WINDOW_S, "10 min"), (MOST_A_DAY, DAY_S, "24 h"))

Key = tuple[str, str]
"""The drive's or the node's name, and the object such as ``2066:01``."""


@dataclass(frozen=True, slots=True)
class WriteRecord:
    """Record of one object: writes so far, and when the last were, in seconds since 1970 UTC."""

    writes: int
    last: tuple[float, ...] = ()


@dataclass(slots=True)
class _WriteCount:
    writes: int = 0
    recent: deque[float] = field(default_factory=lambda: deque[float](maxlen=MOST_A_DAY))


class Ledger:
    """Counts in memory; times are monotonic seconds. ``take_unsaved`` and ``restore`` are for who keeps
    them."""

    def __init__(self) -> None:
        self._counts: dict[Key, _WriteCount] = {}
        self._unsaved: dict[Key, list[float]] = {}

    def writes(self, key: Key) -> int:
        """Writes so far."""
        count = self._counts.get(key)
        return count.writes if count else 0

    def check(self, key: Key, name: str, now: float, cycles: int | None = None) -> None:
        """Raises ``ParameterError`` where one more write would be one too many; ``cycles`` is what the
        EEPROM endures."""
        count = self._counts.get(key)
        if count is None:
            return
        if cycles and count.writes >= cycles:
            owner, ref = key
            said = Text.of(
                "eeprom.worn_out", name=name, owner=owner, count=count.writes, cycles=cycles, object=ref
            )
            raise ParameterError(Why.TOO_OFTEN, said)
        for most, window_s, within in _WINDOWS:
            left_s = count.recent[-most] + window_s - now if len(count.recent) >= most else 0.0
            if left_s > 0:
                said = Text.of("eeprom.too_often", name=name, count=most, within=within, left_s=left_s)
                raise ParameterError(Why.TOO_OFTEN, said)

    def count(self, key: Key, name: str, cycles: int | None, now: float) -> Said:
        """One more write. The warning where it is one of the tenths of ``cycles``, or nothing."""
        count = self._counts.setdefault(key, _WriteCount())
        count.writes += 1
        count.recent.append(now)
        self._unsaved.setdefault(key, []).append(now)
        if not cycles or count.writes * 10 // cycles == (count.writes - 1) * 10 // cycles:
            return ""
        return Text.of("eeprom.wears", name=name, owner=key[0], count=count.writes, cycles=cycles)

    def take_unsaved(self) -> dict[Key, list[float]]:
        """The times of the writes since the last call."""
        unsaved, self._unsaved = self._unsaved, {}
        return unsaved

    def put_back(self, unsaved: Mapping[Key, list[float]]) -> None:
        """Put counts back that could not be kept: they are there again the next time."""
        for key, times in unsaved.items():
            self._unsaved[key] = [*times, *self._unsaved.get(key, ())]

    def restore(self, saved: Mapping[Key, WriteRecord], epoch_s: float, now: float) -> None:
        """Take over what is kept, which includes all that ``take_unsaved`` has given.

        ``epoch_s`` is the wall clock, in seconds since 1970, at monotonic 0. What was written in the
        future, by a clock that was set back meanwhile, counts and is not recent.
        """
        for key, record in saved.items():
            unsaved = self._unsaved.get(key, [])
            times = [time - epoch_s for time in record.last]
            recent = sorted([*(time for time in times if time <= now), *unsaved])[-MOST_A_DAY:]
            count = self._counts.setdefault(key, _WriteCount())
            count.writes = record.writes + len(unsaved)
            count.recent = deque(recent, maxlen=MOST_A_DAY)
