"""EMCY frames and the error list 1003h (CiA 301 §7.2.7, BU 2500 §8.3)."""

from __future__ import annotations

from collections import deque
from typing import Final

from bridge.sim.core.communication_settings import CommunicationSettings, SlaveRules
from bridge.sim.core.dirty_flag import DirtyFlag
from bridge.sim.core.store import Store

_WAITING_MAX: Final = 16


class EmcyProducer:
    """Sends errors no faster than 1015h allows and remembers the last ones."""

    def __init__(self, store: Store[CommunicationSettings], rules: SlaveRules) -> None:
        self._store = store
        self._rules = rules
        self._waiting: deque[bytes] = deque(maxlen=_WAITING_MAX)
        self._sent_at: float | None = None
        self._history: deque[int] = deque(maxlen=rules.error_entries)
        self.error_register = 0
        self.dirty = DirtyFlag()

    @property
    def history_size(self) -> int:
        """Number of errors that 1003h remembers."""
        return self._rules.error_entries

    @property
    def history(self) -> list[int]:
        """1003h, newest first: error code in the low word, first manufacturer byte in the high word."""
        return list(self._history)

    def clear_history(self) -> None:
        self._history.clear()

    def reset(self) -> None:
        self._waiting.clear()
        self._sent_at = None

    def report(self, code: int, register: int, specific: bytes = b"") -> None:
        """Report an error, or with code 0000h that it is gone. ``specific`` is bytes 3…7."""
        self.error_register = register
        self.dirty.is_set = True
        if code:
            self._history.appendleft(code | (specific[0] if specific else 0) << 16)
        if self._store.current.emcy.enabled:
            self._waiting.append(code.to_bytes(2, "little") + bytes([register]) + specific.ljust(5, b"\0"))

    def due(self, now: float) -> list[bytes]:
        """The frames that may be sent now."""
        frames: list[bytes] = []
        while self._waiting and now >= self._free_at():
            frames.append(self._waiting.popleft())
            self._sent_at = now
        return frames

    def next_deadline(self) -> float | None:
        return self._free_at() if self._waiting else None

    def _free_at(self) -> float:
        if self._sent_at is None:
            return 0.0
        return self._sent_at + self._store.current.emcy_inhibit * self._rules.emcy_inhibit_unit_s
