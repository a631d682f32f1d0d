"""Files of the black boxes: on the disk, and as OPC UA's clients see them."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from asyncua.server.address_space import AttributeValue

from bridge.base.guard import Guard
from bridge.northbound.opcua.history.black_box import Column, Trip, table
from bridge.northbound.opcua.space.nodes import LiveType, black_box_id
from bridge.uaserver.history.history import date_time
from bridge.uaserver.library import StatusCodes, data_value, status, ua, variant

_SUFFIX: Final = ".csv"
_PART: Final = ".part"
_TIME: Final = "%Y-%m-%dT%H-%M-%S.%fZ"
"""Time of the trip in the name of its file: no system minds it, and names sort as times do."""
_MODE: Final = 0o640
_CLOSE_S: Final = 2.0
_MIME_TYPE: Final = "text/csv"

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class BlackBoxFile:
    path: Path
    time_us: int
    size: int


class BlackBoxFiles:
    """The newest ``count`` black boxes of each drive in ``folder``, which has a folder for each node and in
    that one for each drive. ``live`` are the values that clients see."""

    def __init__(
        self, folder: Path, drives: Sequence[str], count: int, live: Mapping[str, AttributeValue]
    ) -> None:
        self._folder = folder
        self._count = count
        self._live = live
        self._guard = Guard("OPC UA black box")
        self._files: dict[str, list[BlackBoxFile]] = {drive: [] for drive in drives}
        self._opened: Counter[Path] = Counter()
        self._tasks: set[asyncio.Task[None]] = set()

    async def start(self) -> None:
        """Find the files of earlier runs."""
        with self._guard:
            self._files = await asyncio.to_thread(self._found)
        for drive in self._files:
            await self._show(drive)

    def write(self, trip: Trip, columns: Sequence[Column], start_us: int) -> None:
        """Write a black box, in a thread: the disk may take long."""
        task = asyncio.create_task(self._write(trip, columns, start_us))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    @property
    def is_busy(self) -> bool:
        """Whether one is being written: the next can wait where it is, on a slow disk, too."""
        return bool(self._tasks)

    async def settled(self) -> None:
        """Wait until all is written that is to be, but not for a disk that hangs."""
        if self._tasks:
            await asyncio.wait(self._tasks, timeout=_CLOSE_S)

    def find(self, drive: str, number: int) -> BlackBoxFile | None:
        """The file of a drive with this number, the newest with 1."""
        files = self._files.get(drive, [])
        return files[number - 1] if 0 < number <= len(files) else None

    async def count_opened(self, drive: str, path: Path, change: int) -> None:
        """A client has opened or closed a file."""
        self._opened[path] += change
        if not self._opened[path]:
            del self._opened[path]
        await self._show(drive)

    def _found(self) -> dict[str, list[BlackBoxFile]]:
        found: dict[str, list[BlackBoxFile]] = {}
        for drive in self._files:
            files = list(self._of_drive(drive))
            found[drive], old = files[: self._count], [one.path for one in files[self._count :]]
            # What an earlier run has begun, or the site file has kept then.
            for path in (*old, *(self._folder / drive).glob(f"*{_PART}")):
                path.unlink(missing_ok=True)
        return found

    def _of_drive(self, drive: str) -> Iterator[BlackBoxFile]:
        for path in sorted((self._folder / drive).glob(f"*{_SUFFIX}"), reverse=True):
            with contextlib.suppress(ValueError):
                time = datetime.strptime(path.stem, _TIME).replace(tzinfo=UTC)
                yield BlackBoxFile(path, round(time.timestamp() * 1e6), path.stat().st_size)

    async def _write(self, trip: Trip, columns: Sequence[Column], start_us: int) -> None:
        with self._guard:
            name = f"{date_time(trip.time_us):{_TIME}}{_SUFFIX}"
            path = self._folder / trip.drive / name
            try:
                size = await asyncio.to_thread(_write_file, path, columns, trip.time_us, start_us)
            except OSError as error:
                _log.warning("OPC UA: %s cannot be written: %s", path, error.strerror or error)
                return
            files = [one for one in self._files[trip.drive] if one.path != path]
            files.append(BlackBoxFile(path, trip.time_us, size))
            files.sort(key=lambda one: one.time_us, reverse=True)
            self._files[trip.drive], old = files[: self._count], files[self._count :]
            await self._show(trip.drive)
            for one in old:
                await asyncio.to_thread(one.path.unlink, missing_ok=True)

    async def _show(self, drive: str) -> None:
        for number in range(1, self._count + 1):
            found = self.find(drive, number)
            for name, kind, value in _shown(found, self._opened[found.path] if found else 0):
                await _tell(self._live[f"{black_box_id(drive, number)}/{name}"], _told(value, kind))


def _shown(file: BlackBoxFile | None, opened: int) -> Iterator[tuple[str, LiveType, object]]:
    yield "Size", LiveType.UINT64, file.size if file else 0
    yield "Writable", LiveType.BOOLEAN, False
    yield "UserWritable", LiveType.BOOLEAN, False
    yield "OpenCount", LiveType.UINT16, opened
    yield "MimeType", LiveType.STRING, _MIME_TYPE
    yield "TripTime", LiveType.DATE_TIME, date_time(file.time_us) if file else None


def _told(value: object, kind: LiveType) -> ua.DataValue:
    now = datetime.now(UTC)
    if value is None:
        nothing = variant(None, ua.VariantType.Null)
        return data_value(nothing, status(StatusCodes.BadNoData), now, now)
    return data_value(variant(value, ua.VariantType[kind.value]), None, now, now)


async def _tell(held: AttributeValue, value: ua.DataValue) -> None:
    """Store a value and tell who watches it, unless it is there already."""
    before: Any = held.value
    if before is not None and (before.Value, before.StatusCode) == (value.Value, value.StatusCode):
        return
    held.value = value
    for handle, tell in list(held.datachange_callbacks.items()):
        await tell(handle, value)


def _write_file(path: Path, columns: Sequence[Column], trip_us: int, start_us: int) -> int:
    content = table(columns, trip_us, start_us)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(_PART)
    part.touch(_MODE)
    part.write_bytes(content)
    part.replace(path)
    return len(content)
