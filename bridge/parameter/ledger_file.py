"""File of the EEPROM guard's counts: ``eeprom.json`` in the site's ``state_dir``.

The service and the command line count in the same file: each adds what it has written under a lock, and
takes over the others' counts. The file is replaced, never half written.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import tempfile
from collections.abc import Generator, Mapping
from pathlib import Path
from typing import Final

import msgspec

from bridge.parameter.ledger import MOST_A_DAY, Key, Ledger, WriteRecord

NAME: Final = "eeprom.json"
_VERSION: Final = 1


class _StoredRecord(msgspec.Struct):
    writes: int
    last: list[float] = msgspec.field(default_factory=list[float])


class _LedgerFile(msgspec.Struct):
    version: int
    writes: dict[str, dict[str, _StoredRecord]]


class LedgerFile:
    """One site's file. What adds to it raises OSError where the folder cannot be used."""

    def __init__(self, state_dir: Path) -> None:
        self.path = state_dir / NAME
        self.damaged = ""
        """Path to which a file was put aside that could not be read, or empty."""

    def add(self, ledger: Ledger, epoch_s: float, now: float) -> None:
        """Keep what ``ledger`` has counted, and give it what others have; also the first reading.

        ``epoch_s`` is the wall clock at monotonic 0, ``now`` monotonic. Nothing that was counted is lost
        where that fails.
        """
        unsaved = ledger.take_unsaved()
        try:
            totals = self.merge({key: [epoch_s + time for time in times] for key, times in unsaved.items()})
        except OSError:
            ledger.put_back(unsaved)
            raise
        ledger.restore(totals, epoch_s, now)

    def totals(self) -> dict[Key, int]:
        """Writes of each object by the file as it is now; empty where there is none that can be read."""
        try:
            kept = msgspec.json.decode(self.path.read_bytes(), type=_LedgerFile)
        except (OSError, msgspec.MsgspecError, UnicodeDecodeError):
            return {}
        return {
            (owner, address): one.writes
            for owner, objects in kept.writes.items()
            for address, one in objects.items()
        }

    def merge(self, writes: Mapping[Key, list[float]]) -> dict[Key, WriteRecord]:
        """Add ``writes``, times in seconds since 1970, to the file; all that is in it."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self._lock():
            totals = self._read()
            for key, times in writes.items():
                before = totals.get(key, WriteRecord(0))
                last = sorted([*before.last, *times])[-MOST_A_DAY:]
                totals[key] = WriteRecord(before.writes + len(times), tuple(last))
            if writes:
                self._write(totals)
        return totals

    def _read(self) -> dict[Key, WriteRecord]:
        try:
            content = self.path.read_bytes()
        except FileNotFoundError:
            return {}
        try:
            kept = msgspec.json.decode(content, type=_LedgerFile)
        except (msgspec.MsgspecError, UnicodeDecodeError):
            aside = self.path.with_suffix(".damaged")
            self.path.replace(aside)
            self.damaged = str(aside)
            return {}
        return {
            (owner, address): WriteRecord(one.writes, tuple(one.last))
            for owner, objects in kept.writes.items()
            for address, one in objects.items()
        }

    def _write(self, totals: Mapping[Key, WriteRecord]) -> None:
        writes: dict[str, dict[str, object]] = {}
        for (owner, address), saved in sorted(totals.items()):
            writes.setdefault(owner, {})[address] = {"writes": saved.writes, "last": list(saved.last)}
        text = json.dumps({"version": _VERSION, "writes": writes}, indent=1)
        handle, name = tempfile.mkstemp(prefix=f".{NAME}.", dir=self.path.parent)
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            _like(name, self.path.parent)
            Path(name).replace(self.path)
        except OSError:
            with contextlib.suppress(OSError):
                Path(name).unlink()
            raise

    @contextlib.contextmanager
    def _lock(self) -> Generator[None]:
        """Lock for reading and writing the file. Without file locks (not on Unix) nobody waits."""
        if sys.platform == "win32":
            yield
            return
        import fcntl

        folder = os.open(self.path.parent, os.O_RDONLY)
        try:
            fcntl.flock(folder, fcntl.LOCK_EX)
            yield
        finally:
            os.close(folder)


def _like(name: str, model: Path) -> None:
    """Give a new file to whom ``model`` belongs: what root writes the service has to read."""
    with contextlib.suppress(OSError, AttributeError):
        facts = model.stat()
        Path(name).chmod(0o644)
        os.chown(name, facts.st_uid, facts.st_gid)
