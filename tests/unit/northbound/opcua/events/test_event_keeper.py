"""Events that are kept over a restart, and a disk that does not take them."""

from __future__ import annotations

from pathlib import Path

import pytest
from asyncua import ua

from bridge.northbound.opcua.events import event_keeper
from bridge.northbound.opcua.events.event_keeper import FILE_NAME, EventKeeper
from tests.support.opcua_events import event_log, fields
from tests.support.opcua_history import times_of

SERVER = ua.NodeId(ua.ObjectIds.Server)
NOW = 1_000_000_000


@pytest.fixture(autouse=True)
def _clock(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(event_keeper, "_now_us", lambda: NOW)


async def kept(folder: Path, *times: int, most_bytes: int = 100_000) -> list[int]:
    """Times of what a keeper has found and of what it was given; it is closed then."""
    keeper = EventKeeper(event_log(most_bytes=most_bytes), folder, most_bytes)
    await keeper.start()
    for time in times:
        keeper.keep(fields(time))
    history = keeper.history(SERVER)
    assert history is not None
    found = times_of(history)
    await keeper.close()
    await keeper.close()
    return found


def sizes_in(folder: Path) -> dict[str, int]:
    return {path.name: path.stat().st_size for path in folder.iterdir()}


async def test_events_are_there_after_a_restart(tmp_path: Path) -> None:
    assert await kept(tmp_path, 1, 2) == [1, 2]
    assert await kept(tmp_path, 3) == [1, 2, 3]
    assert await kept(tmp_path) == [1, 2, 3]


async def test_the_files_stay_within_their_size(tmp_path: Path) -> None:
    await kept(tmp_path, *range(1000), most_bytes=50_000)
    sizes = sizes_in(tmp_path)
    assert sorted(sizes) == [FILE_NAME, f"{FILE_NAME}.1"]
    assert all(size <= 25_000 for size in sizes.values())
    found = await kept(tmp_path, most_bytes=50_000)
    assert found == list(range(1000))[-len(found) :]
    assert len(found) > 50


async def test_events_are_told_where_they_cannot_be_kept(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / FILE_NAME).mkdir()
    assert await kept(tmp_path, 1) == [1]
    assert "cannot be read" in caplog.text


async def test_an_event_that_cannot_be_kept_hinders_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    keeper = EventKeeper(event_log(), tmp_path, 100_000)
    await keeper.start()
    keeper.keep({})
    history = keeper.history(SERVER)
    assert history is not None
    assert times_of(history) == []
    assert "OPC UA event history" in caplog.text
    await keeper.close()
