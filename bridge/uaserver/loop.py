"""The event loop: its time, and its share for work that takes long."""

from __future__ import annotations

import asyncio
import time
from typing import Final

_TURN_S: Final = 0.005


class Stint:
    """One piece of work, which lets others have their turn after a few milliseconds."""

    def __init__(self) -> None:
        self._ends_at = time.perf_counter() + _TURN_S

    async def pause(self) -> bool:
        """Let others have their turn where this one is over; whether they had it."""
        if time.perf_counter() < self._ends_at:
            return False
        await asyncio.sleep(0)
        self._ends_at = time.perf_counter() + _TURN_S
        return True


def loop_time() -> float:
    return asyncio.get_running_loop().time()
