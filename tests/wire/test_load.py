"""What heavy traffic does to the bus: nothing."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from tests.support.load import TIMEOUT_S, loaded
from tests.support.process import peer

ALLOWED_S = 0.020
NOISE_S = 0.150
"""A machine that is busy with other things; ``make bench`` prints the figures without it."""


async def test_5000_pdos_a_second_lose_nothing(tmp_path: Path) -> None:
    async with loaded(tmp_path) as load:
        sent, arrived = await load.fire(5000, 3.0)
        assert sent > 12_000, "the machine could not even send"
        assert arrived == sent
        assert load.end.status.frames_lost == 0
        assert load.service.plant.image.read("bus/can0/frames_lost").value == 0


@pytest.mark.landing
async def test_ten_thousand_monitored_items_delay_neither_sync_nor_watchdog(tmp_path: Path) -> None:
    async with loaded(tmp_path) as load:
        with peer(tmp_path, "opcua_flood", load.opcua_url, "10000") as client:
            await asyncio.to_thread(client.wait_output, "creating", 60)
            load.syncs.clear()
            load.reactions.clear()
            await load.trip(4)
            await asyncio.to_thread(client.wait_output, "created 10000", 60)
        assert len(load.reactions) == 4, "each silence was answered"
        assert max(load.sync_lateness_s()) <= ALLOWED_S + NOISE_S
        assert min(load.reactions) >= TIMEOUT_S
        assert max(load.reactions) <= TIMEOUT_S + ALLOWED_S + NOISE_S
