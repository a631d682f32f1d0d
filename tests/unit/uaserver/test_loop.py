"""Work that takes long lets others have their turn; the clock is the test's."""

from __future__ import annotations

import asyncio
import time

import pytest

from bridge.uaserver.loop import Stint


async def test_others_have_their_turn_after_a_few_milliseconds_and_not_before(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now, turns_of_others = 100.0, 0
    monkeypatch.setattr(time, "perf_counter", lambda: now)

    async def others() -> None:
        nonlocal turns_of_others
        while True:
            turns_of_others += 1
            await asyncio.sleep(0)

    task = asyncio.create_task(others())
    await asyncio.sleep(0)
    stint, before = Stint(), turns_of_others
    pauses = 0
    for _ in range(40):
        now += 0.001
        pauses += await stint.pause()
    task.cancel()
    assert turns_of_others - before == pauses == 8
