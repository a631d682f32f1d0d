"""Turns of what takes long: after a few milliseconds of it others have theirs."""

from __future__ import annotations

import asyncio
import time
from typing import Final

_TURN_S: Final = 0.005


class Turns:
    """One piece of work, which asks between its parts."""

    def __init__(self) -> None:
        self._ends_at = time.perf_counter() + _TURN_S

    async def pause(self) -> None:
        """Let others have their turn where this one is over."""
        if time.perf_counter() < self._ends_at:
            return
        await asyncio.sleep(0)
        self._ends_at = time.perf_counter() + _TURN_S
