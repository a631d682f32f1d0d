"""An event loop whose time passes only where it would have waited."""

from __future__ import annotations

import asyncio
import selectors


class _Selector(selectors.DefaultSelector):
    def __init__(self) -> None:
        super().__init__()
        self.now = 0.0

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        ready = super().select(0)
        if not ready:
            self.now += timeout or 0.0
        return ready


class VirtualLoop(asyncio.SelectorEventLoop):
    """For what waits for nothing but time."""

    def __init__(self) -> None:
        self._virtual = _Selector()
        super().__init__(self._virtual)

    def hold_up(self, pause_s: float) -> None:
        """Let time pass in which nothing could run."""
        self._virtual.now += pause_s

    def time(self) -> float:
        return self._virtual.now
