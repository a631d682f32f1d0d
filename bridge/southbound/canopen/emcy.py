"""Emergency messages (CiA 301 §7.2.7): codec, history, and a limit on how often they are told."""

from __future__ import annotations

import json
import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from bridge.ratelimit import RateLimit

_HEAD: Final = struct.Struct("<HB")
_HISTORY: Final = 8
"""As many as 1003h of most devices."""
_BURST: Final = 16
_EVERY_S: Final = 0.1
"""A node tells its own inhibit time by 1015h; a babbling one keeps to nothing."""
_MOST_PENDING: Final = 16


@dataclass(frozen=True, slots=True)
class Emergency:
    """``vendor`` is the manufacturer's five bytes (fewer where the node sent a short message)."""

    code: int
    register: int
    vendor: bytes


def decode(data: bytes) -> Emergency | None:
    """The emergency in ``data``, or None where it is too short to hold a code and a register."""
    if len(data) < _HEAD.size:
        return None
    code, register = _HEAD.unpack_from(data)
    return Emergency(code, register, data[3:8])


class EmergencyLog:
    """What one node has told: the last eight, and which of them may be told on.

    ``number`` is the drive that an emergency is about, for nodes with several. Of what comes too fast
    only the newest for each drive is kept and told later, so that the last word always arrives.
    """

    def __init__(self) -> None:
        self.suppressed = 0
        self._limit = RateLimit(_BURST, _EVERY_S)
        self._history: deque[Emergency] = deque(maxlen=_HISTORY)
        self._pending: dict[int | None, tuple[Emergency, float]] = {}
        self._due: float | None = None
        self.changed = True
        """Since the last ``as_json``."""

    def add(self, emergency: Emergency, number: int | None, at: float) -> bool:
        """True where it may be told now."""
        self._history.appendleft(emergency)
        self.changed = True
        if not self._pending and self._limit.allows(at):
            return True
        is_known = number in self._pending
        if is_known or len(self._pending) >= _MOST_PENDING:
            self.suppressed += 1
        if is_known or len(self._pending) < _MOST_PENDING:
            self._pending[number] = (emergency, at)
        if self._due is None:
            self._due = at + _EVERY_S
        return False

    def next_deadline(self) -> float | None:
        return self._due

    def on_time(self, now: float) -> list[tuple[Emergency, int | None, float]]:
        """What was held back and may be told now, with its drive and the time at which it came."""
        if self._due is None or now < self._due:
            return []
        told: list[tuple[Emergency, int | None, float]] = []
        while self._pending and self._limit.allows(now):
            number = next(iter(self._pending))
            told.append((self._pending[number][0], number, self._pending[number][1]))
            del self._pending[number]
        self._due = now + _EVERY_S if self._pending else None
        return told

    def as_json(self, text: Callable[[Emergency], str]) -> str:
        """The history, newest first; ``text`` puts a message into the family's words."""
        self.changed = False
        return json.dumps(
            [
                {
                    "code": f"{entry.code:04X}h",
                    "register": f"{entry.register:02X}h",
                    "vendor": entry.vendor.hex().upper(),
                    "text": text(entry),
                }
                for entry in self._history
            ]
        )
