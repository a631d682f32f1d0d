"""What strangers on the network do wrong, in the log: one line for each kind and source, then counts."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

_PAUSE_S: Final = 60.0
_MOST_KEYS: Final = 500
_LONGEST: Final = 200
_OTHERS: Final = "others"

Tell = Callable[[str, str, str], None]
"""As ``Notices.tell``."""


@dataclass(slots=True)
class _Told:
    at: float
    left_out: int = 0


class Notices:
    """``clock`` is monotonic. A kind is told at once; what follows from the same source only as a number, a
    minute later at the earliest."""

    def __init__(self, log: logging.Logger, clock: Callable[[], float]) -> None:
        self._log = log
        self._clock = clock
        self._told: dict[tuple[str, str], _Told] = {}

    def tell(self, kind: str, source: str, detail: str = "", level: int = logging.WARNING) -> None:
        """``kind`` is a phrase such as "refused logins", ``detail`` what is known of this one."""
        if (kind, source) not in self._told and len(self._told) >= _MOST_KEYS:
            source = _OTHERS
        told = self._told.get((kind, source))
        if told is not None:
            told.left_out += 1
            return
        self._told[kind, source] = _Told(self._clock())
        more = f": {detail[:_LONGEST]}" if detail else ""
        self._log.log(level, "OPC UA: %s from %s%s", kind, source, more)

    def sum_up(self) -> None:
        """Tell the numbers that are due. To be called about once a second."""
        now = self._clock()
        for (kind, source), told in list(self._told.items()):
            if now - told.at < _PAUSE_S:
                continue
            if told.left_out:
                self._log.warning("OPC UA: %s from %s: %d more", kind, source, told.left_out)
                told.at, told.left_out = now, 0
            else:
                del self._told[kind, source]
