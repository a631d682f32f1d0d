"""Full collections: none but after many sessions have ended."""

from __future__ import annotations

import asyncio
import gc
from collections.abc import Iterator

import pytest

from bridge.uaserver import garbage
from bridge.uaserver.garbage import GarbageCollector


@pytest.fixture
def collections() -> Iterator[list[int]]:
    """Generations that are collected while the test runs."""
    found: list[int] = []

    def note(phase: str, info: dict[str, int]) -> None:
        if phase == "start":
            found.append(info["generation"])

    gc.callbacks.append(note)
    yield found
    gc.callbacks.remove(note)


async def test_the_rest_is_looked_for_after_a_time(
    monkeypatch: pytest.MonkeyPatch, collections: list[int]
) -> None:
    monkeypatch.setattr(garbage, "_PERIOD_S", 0.0)
    collector = GarbageCollector()
    collector.begin()
    try:
        for _ in range(4):
            await asyncio.sleep(0)
        assert collections.count(2) > 1, "and again"
    finally:
        collector.end()
        gc.unfreeze()
    collections.clear()
    for _ in range(4):
        await asyncio.sleep(0)
    assert collections == []


async def test_a_full_collection_waits_for_the_end_of_sessions(collections: list[int]) -> None:
    before, kept = gc.get_threshold(), list[list[int]]()
    collector = GarbageCollector()
    collector.begin()
    try:
        for _ in range(200_000):
            kept.append([])
        assert set(collections) == {0, 1}
        for _ in range(199):
            collector.note_end()
            await asyncio.sleep(0)
        assert collections.count(2) == 1
        collector.note_end()
        assert collections.count(2) == 1, "whoever has ended the session does not wait for it"
        await asyncio.sleep(0)
        assert collections.count(2) == 2
    finally:
        collector.end()
        gc.unfreeze()
    assert gc.get_threshold() == before
