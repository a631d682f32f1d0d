"""Events of the last hours, in memory and in a file that is read at the next start."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Final

from bridge.northbound.opcua.events.event_records import EventCodec, EventRecord, read_record
from bridge.northbound.opcua.space.notifiers import Notifiers
from bridge.uaserver.filters.eventfilter import Occurrence
from bridge.uaserver.history.history import EventHistory
from bridge.uaserver.library import ua

_HOUR_US: Final = 3_600_000_000
_RECORD_BYTES: Final = 240
"""Bytes that a record takes beside its line, about."""


class EventLog:
    """Records of events, numbered as they came: those of the last ``hours``, and ``most_bytes`` at most."""

    def __init__(self, codec: EventCodec, notifiers: Notifiers, hours: int, most_bytes: int) -> None:
        self.codec = codec
        self.first = 0
        self.end = 0
        self._hours_us = hours * _HOUR_US
        self._most_bytes = most_bytes
        self._bytes = 0
        self._records: dict[int, EventRecord] = {}
        self._emitters = lru_cache(maxsize=1000)(notifiers.emitters)
        self._histories = {where: _Told(self, where) for where in notifiers.all}

    def add(self, records: Iterable[EventRecord], now_us: int) -> None:
        for one in records:
            self._records[self.end] = one
            self.end += 1
            self._bytes += len(one.line) + _RECORD_BYTES
        self._forget(now_us)

    def history(self, where: ua.NodeId, now_us: int) -> EventHistory | None:
        """Events that this object has told; None for one that tells none."""
        self._forget(now_us)
        return self._histories.get(where)

    def record(self, number: int) -> EventRecord:
        return self._records[number]

    def is_told_by(self, where: ua.NodeId, record: EventRecord) -> bool:
        return where in self._emitters(record.source)

    def _forget(self, now_us: int) -> None:
        while self._records and (
            self._bytes > self._most_bytes or self._records[self.first].time_us < now_us - self._hours_us
        ):
            self._bytes -= len(self._records.pop(self.first).line) + _RECORD_BYTES
            self.first += 1


class _Told:
    """Events that one object has told."""

    def __init__(self, log: EventLog, where: ua.NodeId) -> None:
        self._log = log
        self._where = where

    @property
    def first(self) -> int:
        return self._log.first

    @property
    def end(self) -> int:
        return self._log.end

    def time_us(self, number: int) -> int:
        return self._log.record(number).time_us

    def event(self, number: int) -> Occurrence | None:
        record = self._log.record(number)
        if not self._log.is_told_by(self._where, record):
            return None
        return Occurrence(self._where, self._log.codec.fields(record))


def read_records(path: Path) -> list[EventRecord]:
    """Records of the file and of the one before it; lines that are none are left out. A last line that was
    torn off is taken away, so that the next one begins at its beginning. Raises OSError."""
    found: list[EventRecord] = []
    for one in (path.with_name(f"{path.name}.1"), path):
        with contextlib.suppress(FileNotFoundError):
            content = one.read_bytes()
            if one == path and not content.endswith(b"\n"):
                os.truncate(path, content.rfind(b"\n") + 1)
            found += filter(None, map(read_record, content.splitlines(keepends=True)))
    return found
