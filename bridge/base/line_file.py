"""File of lines that is rotated by size, written by a thread of its own: a disk that is full, slow or not
writable costs lines, never time."""

from __future__ import annotations

import contextlib
import os
import queue
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

_MOST_WAITING: Final = 10_000
_PAUSE_S: Final = 1.0
"""Pause after an error before the file is tried again, seconds; lines are dropped meanwhile."""
_CLOSE_S: Final = 2.0
_MODE: Final = 0o640


class LineFile:
    """The file ``path`` with ``keep`` older ones beside it, ``path.1`` the youngest, each of ``max_bytes`` at
    most.

    A line is one ``write`` to a file opened with O_APPEND. What could not be written in full is taken back
    and counted as ``lost``; ``fault`` then says why, and is empty again when a line could be written.
    """

    def __init__(
        self, path: Path, max_bytes: int, keep: int, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.path = path
        self.lost = 0
        self.fault = ""
        self._max_bytes = max_bytes
        self._keep = keep
        self._clock = clock
        self._lines: queue.Queue[bytes | None] = queue.Queue(_MOST_WAITING)
        self._dropped = 0
        self._file: int | None = None
        self._size = 0
        self._try_at = 0.0
        self._thread = threading.Thread(target=self._run, name=self.path.name, daemon=True)

    def start(self) -> None:
        self._thread.start()

    def put(self, line: bytes) -> None:
        """Queue ``line`` to be written, without waiting."""
        try:
            self._lines.put_nowait(line)
        except queue.Full:
            self._dropped += 1

    @property
    def all_lost(self) -> int:
        """Lines that are not in the file."""
        return self.lost + self._dropped

    def close(self) -> None:
        """Write the queued lines, but do not wait for a disk that hangs."""
        with contextlib.suppress(queue.Full):
            self._lines.put(None, timeout=_CLOSE_S)
            self._thread.join(_CLOSE_S)

    # the thread

    def _run(self) -> None:
        while (line := self._lines.get()) is not None:
            self._write(line)
        if self._file is not None:
            os.close(self._file)

    def _write(self, line: bytes) -> None:
        if self._clock() < self._try_at:
            self.lost += 1
            return
        try:
            self._append(line)
        except OSError as error:
            self.lost += 1
            self.fault = error.strerror or str(error)
            self._try_at = self._clock() + _PAUSE_S
            self._drop_file()
        else:
            self.fault = ""

    def _append(self, line: bytes) -> None:
        file = self._opened()
        if self._size and self._size + len(line) > self._max_bytes:
            self._rotate()
            file = self._opened()
        written = os.write(file, line)
        if written < len(line):
            # No half lines: readers expect JSON.
            os.ftruncate(file, self._size)
            raise OSError(0, "the disk is full")
        self._size += written

    def _opened(self) -> int:
        if self._file is None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC
            self._file = os.open(self.path, flags, _MODE)
            self._size = os.fstat(self._file).st_size
        return self._file

    def _rotate(self) -> None:
        self._drop_file()
        names = [self.path, *(self.path.with_name(f"{self.path.name}.{n}") for n in range(1, self._keep + 1))]
        for older, newer in zip(reversed(names[1:]), reversed(names[:-1]), strict=True):
            with contextlib.suppress(FileNotFoundError):
                newer.replace(older)
        if not self._keep:
            self.path.unlink()

    def _drop_file(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            with contextlib.suppress(OSError):
                os.close(file)
