"""The master's shell in a real event loop."""

from __future__ import annotations

import asyncio
import time
from pathlib import Path

import pytest

from bridge.base.errors import OperationFailed
from tests.support.load import SYNC_PERIOD_S, loaded

DEADMAN_S = 0.5


async def test_a_fault_of_our_own_leaves_no_drive_running_and_is_told(tmp_path: Path) -> None:
    async with loaded(tmp_path) as load:
        master, plant = load.service.master, load.service.plant
        plant.enforcements = broken  # type: ignore[method-assign]
        broke = time.monotonic()
        told = "the master has failed: ZeroDivisionError"
        with pytest.raises(OperationFailed, match=told):
            await asyncio.wait_for(master.failed(), 5.0)
        await asyncio.sleep(DEADMAN_S + 0.3)
        assert max(load.syncs) <= broke + DEADMAN_S + SYNC_PERIOD_S
        # The service ends by that, its front with it.
        assert load.serving
        with pytest.raises(OperationFailed, match=told):
            await asyncio.wait_for(load.serving, 60.0)


def broken(*_: object) -> None:
    raise ZeroDivisionError("a fault of our own")
