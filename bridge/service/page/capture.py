"""Capture of a bus for the page, as python-can writes it to a file."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable
from typing import Any

from bridge.canopen.frame import Frame


class CaptureFile:
    """A capture as text. ``form`` is ``candump`` or ``asc``; ``epoch_ns`` turns monotonic seconds into ns
    since 1970. Written as frames come, because a line takes less memory than its frame."""

    def __init__(self, channel: str, form: str, epoch_ns: Callable[[float], int]) -> None:
        # Imported where somebody wants a file: it takes long.
        from can.io.asc import ASCWriter
        from can.io.canutils import CanutilsLogWriter

        self.frames = 0
        self._channel: Any = channel if form == "candump" else 1
        self._epoch_ns = epoch_ns
        self._file = io.StringIO()
        self._close: Any = self._file.close
        self._file.close = lambda: None  # type: ignore[method-assign]  # the writer closes what it has written
        self._writer = ASCWriter(self._file) if form == "asc" else CanutilsLogWriter(self._file, channel)

    def add(self, frames: Iterable[Frame]) -> None:
        from bridge.can.pythoncan import message_of

        for frame in frames:
            message = message_of(frame, self._epoch_ns(frame.time) / 1e9, self._channel)
            self._writer.on_message_received(message)
            self.frames += 1

    def content(self) -> bytes:
        """The whole file; nothing can be added after that."""
        self._writer.stop()
        content = self._file.getvalue().encode()
        self._close()
        return content
