"""The signals that end a process, from its first line to its last. Nothing heavy is imported here."""

from __future__ import annotations

import signal
from collections.abc import Callable
from types import FrameType
from typing import Any, Final

_NAMES: Final = ("SIGTERM", "SIGINT", "SIGHUP", "SIGQUIT")
ENDING: Final = tuple(getattr(signal, name) for name in _NAMES if hasattr(signal, name))


class EndingSignals:
    """Caught from ``hold`` on. The first one is passed on to whoever asks, now or later; later ones change
    nothing, so that they cannot interrupt the stopping."""

    def __init__(self) -> None:
        self.has_come = False
        self._tell: Callable[[], None] | None = None
        self._before: dict[int, Any] = {}

    @property
    def is_held(self) -> bool:
        return bool(self._before)

    def hold(self) -> None:
        """Neither Python's traceback nor the kernel's end or core dump from now on."""
        self.has_come = False
        self._before = {number: signal.signal(number, self._on_signal) for number in ENDING}

    def release(self) -> None:
        """Restore the state before ``hold``."""
        for number, handler in self._before.items():
            # None: it was not set from Python.
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        self._before = {}

    def let_kill(self) -> None:
        """End by each of them from now on, at once and without a word; also by one that has come."""
        if self.has_come:
            raise SystemExit(0)
        for number in ENDING:
            signal.signal(number, signal.SIG_DFL)
        self._before = {}

    def tell(self, act: Callable[[], None] | None) -> None:
        """``act`` is called between two instructions of the main thread, when the first has come."""
        self._tell = act

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if not self.has_come:
            self.has_come = True
            if self._tell:
                self._tell()


ending_signals: Final = EndingSignals()
"""There is one set of handlers in a process."""
