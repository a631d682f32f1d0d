"""Keeps the events that are told to clients, also over a restart."""

from __future__ import annotations

import asyncio
import logging
import time
from pathlib import Path
from typing import Final

from bridge.base.guard import Guard
from bridge.base.line_file import LineFile
from bridge.northbound.opcua.events.event_file import EventLog, read_records
from bridge.northbound.opcua.events.event_records import Fields
from bridge.uaserver.history.history import EventHistory, time_us
from bridge.uaserver.library import ua

FILE_NAME: Final = "events.jsonl"
_FILES: Final = 2
"""Files among which the bytes of all are divided: the one that is written, and the one before it."""

_log = logging.getLogger(__name__)


class EventKeeper:
    """``log`` in memory, and a file in ``folder`` that has the same."""

    def __init__(self, log: EventLog, folder: Path, most_bytes: int) -> None:
        self._log = log
        self._file = LineFile(folder / FILE_NAME, most_bytes // _FILES, _FILES - 1)
        self._guard = Guard("OPC UA event history")
        self._fault = ""
        self._is_open = False

    async def start(self) -> None:
        """Take in what the file has. One that cannot be read is told, and hinders nothing."""
        try:
            records = await asyncio.to_thread(read_records, self._file.path)
        except OSError as error:
            _log.warning("OPC UA: %s cannot be read: %s", self._file.path, error.strerror or error)
            records = []
        self._log.add(records, _now_us())
        self._file.start()
        self._is_open = True

    def keep(self, fields: Fields) -> None:
        """Keep an event with these fields, ``Time`` and ``SourceName`` among them."""
        # Who is told of events must not lose them because they cannot be kept.
        with self._guard:
            at = time_us(fields["Time"].Value)
            record = self._log.codec.record(at or _now_us(), fields["SourceName"].Value, fields)
            self._log.add([record], _now_us())
            self._file.put(record.line)
        if self._file.fault != self._fault:
            self._fault = self._file.fault
            if self._fault:
                _log.warning("OPC UA: %s cannot be written: %s", self._file.path, self._fault)

    def history(self, where: ua.NodeId) -> EventHistory | None:
        return self._log.history(where, _now_us())

    async def close(self) -> None:
        """Write what waits. May be called again."""
        if self._is_open:
            self._is_open = False
            await asyncio.to_thread(self._file.close)


def _now_us() -> int:
    return time.time_ns() // 1000
