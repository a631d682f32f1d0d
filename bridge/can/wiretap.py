"""Passes the frames of a bus that only this process can hear on to other processes of ours.

A reader that is too slow loses frames, and is told how many; the bus never waits for it. While nobody reads,
it costs nothing.
"""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path
from typing import Final

from bridge.base.errors import Unavailable
from bridge.can.listener import LOST, RECORD
from bridge.can.softbus import SoftBus

_PERIOD_S: Final = 0.02
_MOST_BYTES: Final = 1 << 20
"""Waiting for one reader."""
_MOST_READERS: Final = 16


class Wiretap:
    """Tap on ``bus``, at the Unix socket ``path`` in a folder that is ours alone."""

    def __init__(self, bus: SoftBus, path: Path) -> None:
        self._bus = bus
        self._path = path
        self._server: asyncio.Server | None = None
        self._readers: dict[asyncio.StreamWriter, int] = {}
        """With the number of frames that each has lost and was not told of."""
        self._passing: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Raises ``Unavailable``."""
        try:
            self._path.unlink(missing_ok=True)
            self._server = await asyncio.start_unix_server(self._serve, self._path)
            self._path.chmod(0o600)
        except OSError as error:
            raise Unavailable(f"{self._path}: {error.strerror or error}") from error

    async def close(self) -> None:
        if self._server:
            self._server.close()
        for reader in self._readers:
            reader.close()
        if self._passing:
            self._passing.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._passing
        with contextlib.suppress(OSError):
            self._path.unlink(missing_ok=True)

    async def _serve(self, incoming: asyncio.StreamReader, reader: asyncio.StreamWriter) -> None:
        if len(self._readers) >= _MOST_READERS:
            reader.close()
            return
        self._readers[reader] = 0
        self._bus.overhear(is_on=True)
        if self._passing is None or self._passing.done():
            self._passing = asyncio.create_task(self._pass_on(), name=f"wiretap {self._bus.name}")
        with contextlib.suppress(OSError):
            await incoming.read()  # until it goes: it has nothing to say
        self._readers.pop(reader, None)
        reader.close()

    async def _pass_on(self) -> None:
        """Until nobody reads any more."""
        while self._readers:
            await asyncio.sleep(_PERIOD_S)
            frames = self._bus.take_overheard()
            data = b"".join(
                RECORD.pack(frame.time, frame.can_id, len(frame.data), frame.data) for frame in frames
            )
            for reader, lost in self._readers.items():
                if reader.transport.get_write_buffer_size() > _MOST_BYTES:
                    self._readers[reader] = lost + len(frames)
                    continue
                if lost:
                    reader.write(RECORD.pack(lost, LOST, 0, b""))
                    self._readers[reader] = 0
                reader.write(data)
        self._bus.overhear(is_on=False)
