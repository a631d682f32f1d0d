"""Delays of the answers to logins that fail, so that nobody tries many (OPC 10000-4 §5.7.3.1). Sans-IO.

Nobody is locked out: a login that is right is answered at once, whatever failed before it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

_AT_ONCE: Final = 3
"""Failures of an address that are answered at once: people mistype."""
_FIRST_S: Final = 0.25
_LONGEST_S: Final = 2.0
"""Limit of the delay, which doubles: clients wait for an answer some seconds."""
_FORGOTTEN_S: Final = 60.0
"""Time without a failure after which the next one is the first again."""
_MOST_SOURCES: Final = 1_000


@dataclass(frozen=True, slots=True)
class _Failures:
    count: int
    last_at: float


class FailedLogins:
    """Failed logins by the source of their connections: an address, or a network."""

    def __init__(self) -> None:
        self._failures: dict[str, _Failures] = {}

    def delay_s(self, source: str, now: float) -> float:
        """Delay of the answer to a login that has failed; it is counted."""
        before = self._failures.pop(source, None)
        is_known = before is not None and now - before.last_at <= _FORGOTTEN_S
        count = before.count + 1 if before and is_known else 1
        # Behind all others: the first is the one that has failed the longest time ago.
        self._failures[source] = _Failures(count, now)
        if len(self._failures) > _MOST_SOURCES:
            del self._failures[next(iter(self._failures))]
        if count <= _AT_ONCE:
            return 0.0
        return min(_FIRST_S * 2.0 ** min(count - _AT_ONCE - 1, 10), _LONGEST_S)
