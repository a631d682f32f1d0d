"""The files of a recorder, written by a thread of their own: a disk that is full, slow or not writable costs
the recording, never time.

``recorder`` has the latest segments, as a ring, each in two files: ``N.state`` with its header and its
checkpoint, which a child process writes, and ``N.turns``. ``black_box`` has what was written out around an
incident. Each folder has a bound.
"""

from __future__ import annotations

import contextlib
import os
import queue
import threading
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Final

from bridge.recorder.recording import MAGIC, SUFFIX, turns_chunk, whole_chunks

STATE: Final = ".state"
TURNS: Final = ".turns"
_MOST_WAITING: Final = 200
_CLOSE_S: Final = 2.0
_FLAGS: Final = os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC
_MODE: Final = 0o640
_FOLDER_MODE: Final = 0o750
_SHARE: Final = 3 / 8
"""Share of the ring's bound: most for the turns of the present segment, and for all earlier segments."""
_STATE_SHARE: Final = 1 / 8
"""Share of the ring's bound: most for a checkpoint."""
_SEGMENT_SHARE: Final = 1 / 8
"""Share of the ring's bound: size of a segment after which another is begun."""


def segments_in(folder: Path) -> list[int]:
    """Numbers of the segments in a ring's folder, the oldest first."""
    found = (path.stem for path in folder.glob(f"*{TURNS}"))
    return sorted(int(stem) for stem in found if stem.isdecimal())


def parts_of(folder: Path, numbers: Iterable[int]) -> list[Path]:
    """The files that make a recording of these segments, in order. One without a checkpoint is left out."""
    found: list[Path] = []
    for number in numbers:
        state, turns = (folder / f"{number:06}{kind}" for kind in (STATE, TURNS))
        if state.exists() and turns.exists():
            found += (state, turns)
    return found


def write_recording(parts: Iterable[Path], target: Path) -> None:
    """Join the files of segments to a recording. What is cut off at the end of one is left out. Raises
    OSError; there is no half file then."""
    part = target.with_name(f"{target.name}.part")
    try:
        with os.fdopen(os.open(part, _FLAGS | os.O_TRUNC, _MODE), "wb") as out:
            out.write(MAGIC)
            for path in parts:
                with path.open("rb") as source:
                    for chunk in whole_chunks(source):
                        out.write(chunk)
        part.replace(target)
    except OSError:
        with contextlib.suppress(OSError):
            part.unlink()
        raise


class Ring:
    """The ring in ``folder`` with ``most_bytes`` at most, and the incidents in ``black_box`` with
    ``most_kept_bytes``.

    ``fault`` says why nothing can be written, empty while it can; ``size`` is that of the present segment.
    ``has_lost`` is set where turns of it could not be written: nothing after them can be replayed.
    """

    def __init__(self, folder: Path, most_bytes: int, black_box: Path, most_kept_bytes: int) -> None:
        self.folder = folder
        self.black_box = black_box
        self.fault = ""
        self.size = 0
        self.has_lost = False
        self._most_bytes = most_bytes
        self._most_kept_bytes = most_kept_bytes
        self._file: int | None = None
        self._work: queue.Queue[Callable[[], None] | None] = queue.Queue(_MOST_WAITING)
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)

    def start(self) -> int:
        """Make the folders and begin; returns the number of the last segment, 0 for none. Raises OSError."""
        for folder in (self.folder, self.black_box):
            folder.mkdir(mode=_FOLDER_MODE, parents=True, exist_ok=True)
        numbers = segments_in(self.folder)
        self._thread.start()
        return numbers[-1] if numbers else 0

    @property
    def most_state(self) -> float:
        """Most bytes of a checkpoint."""
        return self._most_bytes * _STATE_SHARE

    @property
    def is_long(self) -> bool:
        """True if another segment is due for the size of this one."""
        return self.size > self._most_bytes * _SEGMENT_SHARE

    def state_path(self, number: int) -> Path:
        """File for the checkpoint of a segment."""
        return self.folder / f"{number:06}{STATE}"

    def begin(self, number: int) -> None:
        """Begin the segment of this number."""
        self.size = 0
        self.has_lost = not self._put(partial(self._begin, number))

    def put(self, turns: list[bytes]) -> None:
        """Add turns to the segment, without waiting."""
        if not self.has_lost and not self._put(partial(self._add, turns)):
            self.has_lost = True

    def keep(self, numbers: list[int], name: str) -> None:
        """Write these segments to a file of this name among the incidents."""
        self._put(partial(self._keep, numbers, name))

    def close(self) -> None:
        """Write what waits, but do not wait for a disk that hangs."""
        with contextlib.suppress(queue.Full):
            self._work.put(None, timeout=_CLOSE_S)
            self._thread.join(_CLOSE_S)

    def _put(self, work: Callable[[], None]) -> bool:
        try:
            self._work.put_nowait(work)
        except queue.Full:
            return False
        return True

    # the thread

    def _run(self) -> None:
        while (work := self._work.get()) is not None:
            try:
                work()
            except OSError as error:
                self.fault = error.strerror or str(error)
                self.has_lost = True
            else:
                self.fault = ""
        self._drop_file()

    def _begin(self, number: int) -> None:
        self._drop_file()
        self._make_room(number)
        path = self.folder / f"{number:06}{TURNS}"
        self._file = os.open(path, _FLAGS | os.O_APPEND | os.O_TRUNC, _MODE)

    def _add(self, turns: list[bytes]) -> None:
        if self._file is not None and not self.has_lost:
            self._write(turns_chunk(turns))

    def _write(self, chunk: bytes) -> None:
        assert self._file is not None
        if self.size + len(chunk) > self._most_bytes * _SHARE:
            # A segment that cannot be followed by another one, because no checkpoint could be made.
            self.has_lost = True
            return
        written = os.write(self._file, chunk)
        if written < len(chunk):
            os.ftruncate(self._file, self.size)
            raise OSError(0, "the disk is full")
        self.size += written

    def _make_room(self, beginning: int) -> None:
        """Delete the oldest segments beyond the share of those before ``beginning``."""
        numbers = [number for number in segments_in(self.folder) if number != beginning]
        sizes = {number: self._size_of(number) for number in numbers}
        left = sum(sizes.values())
        for number in numbers:
            if left <= self._most_bytes * _SHARE:
                break
            left -= sizes[number]
            for kind in (TURNS, STATE):
                (self.folder / f"{number:06}{kind}").unlink(missing_ok=True)

    def _size_of(self, number: int) -> int:
        size = 0
        for kind in (TURNS, STATE):
            with contextlib.suppress(FileNotFoundError):
                size += (self.folder / f"{number:06}{kind}").stat().st_size
        return size

    def _keep(self, numbers: list[int], name: str) -> None:
        parts = parts_of(self.folder, numbers)
        room = self._most_kept_bytes - sum(path.stat().st_size for path in parts)
        files = sorted(self.black_box.glob(f"*{SUFFIX}"), key=lambda path: path.stat().st_mtime)
        kept = sum(path.stat().st_size for path in files)
        for path in files:
            if kept <= room:
                break
            kept -= path.stat().st_size
            path.unlink(missing_ok=True)
        if parts and kept <= room:
            write_recording(parts, self.black_box / f"{name}{SUFFIX}")

    def _drop_file(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            with contextlib.suppress(OSError):
                os.close(file)
