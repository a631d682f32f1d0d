"""Black boxes on the disk, and what clients see of them; no server."""

from __future__ import annotations

from pathlib import Path

import pytest
from asyncua import ua

from tests.support.opcua_black_box import DRIVE, NEWEST, SECOND_NEWEST, BlackBoxRig, names


@pytest.fixture
async def rig(tmp_path: Path) -> BlackBoxRig:
    made = BlackBoxRig(tmp_path)
    await made.files.start()
    return made


async def test_the_newest_is_the_first_and_the_oldest_goes(rig: BlackBoxRig, tmp_path: Path) -> None:
    for day in (1, 3, 2, 4):
        await rig.write(day)
    await rig.write(9, "pump/drive")
    assert names(tmp_path) == ["2026-12-03T12-00-00.000000Z.csv", "2026-12-04T12-00-00.000000Z.csv"]
    assert f"{rig.shown('TripTime'):%d}" == "04"
    assert f"{rig.shown('TripTime', SECOND_NEWEST):%d}" == "03"
    assert rig.shown("Size") == (tmp_path / DRIVE / names(tmp_path)[1]).stat().st_size


async def test_files_are_found_at_the_next_start(rig: BlackBoxRig, tmp_path: Path) -> None:
    await rig.write(1)
    await rig.write(2)
    (tmp_path / DRIVE / "notes.csv").write_text("mine")
    (tmp_path / DRIVE / "2026-12-01T12-00-00.000000Z.part").write_text("torn")
    (tmp_path / DRIVE / "2026-11-01T12-00-00.000000Z.csv").write_text("one too many")
    again = BlackBoxRig(tmp_path)
    await again.files.start()
    assert len(names(tmp_path)) == 3, "two, and what is none of ours"
    for name in ("TripTime", "Size"):
        for file in (NEWEST, SECOND_NEWEST):
            assert again.shown(name, file) == rig.shown(name, file)


async def test_who_watches_is_told(rig: BlackBoxRig) -> None:
    told: list[object] = []

    async def tell(handle: int, value: ua.DataValue) -> None:
        told.append((handle, value.Value.Value))

    rig.live[f"{NEWEST.id}/Size"].datachange_callbacks[7] = tell
    await rig.write(1)
    await rig.write(2)
    assert told == [(7, rig.shown("Size"))], "once: the second is as long as the first"


async def test_a_disk_that_takes_nothing_is_told_and_hinders_nothing(
    rig: BlackBoxRig, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "conveyor").write_text("in the way")
    await rig.write(1)
    assert rig.shown("Size") == 0
    assert "cannot be written" in caplog.text
