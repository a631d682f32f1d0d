"""Recorded traces: what candump, CANalyzer and PCAN-View have written, as python-can reads it."""

from __future__ import annotations

import io
import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import can
from can.io.blf import BLFParseError
from can.io.generic import MessageReader

from bridge.base.errors import OperationFailed
from bridge.can.pythoncan import frame_of
from bridge.canopen.frame import Frame

_TEXTS: Final[dict[str, Callable[[Any], MessageReader]]] = {
    ".log": can.CanutilsLogReader,
    ".asc": can.ASCReader,
    ".trc": can.TRCReader,
}
SUFFIXES: Final = (*_TEXTS, ".blf")
_UNREADABLE: Final = (
    can.CanError,
    BLFParseError,
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    ArithmeticError,
    NotImplementedError,
    EOFError,
    struct.error,
    zlib.error,
)
"""Exceptions of python-can's readers for files that are not what their names say."""


class _Lines(io.TextIOWrapper):
    """A text file with the number of the line that was read last. The formats are ASCII; a comment may be in
    any code page."""

    number = 0

    def __next__(self) -> str:
        line = super().__next__()
        self.number += 1
        return line


class Trace:
    """The classical CAN frames of one channel of a file, with its own times in seconds.

    ``channel`` is the one that was asked for. Without it the first frame's is taken; that others follow is
    an error then, unless it is the ``expected`` one.
    """

    def __init__(self, path: Path, channel: str | None, expected: str | None) -> None:
        self._path = path
        self._channel = channel
        self._is_sure = channel is not None
        self._expected = expected
        self._left_out: Counter[str] = Counter()
        self._lines: _Lines | None = None
        self._count = 0

    @property
    def place(self) -> str:
        """Place in the file of the frame that was given last: its line, or its number in a binary one."""
        return f"line {self._lines.number}" if self._lines else f"frame {self._count}"

    def frames(self) -> Iterator[Frame]:
        """Raises ``OperationFailed`` where the file cannot be read, or it has several channels."""
        is_empty = True
        for message in self._messages():
            if message.channel is not None and not self._is_meant(str(message.channel)):
                self._left_out["frames of other channels"] += 1
            elif message.is_error_frame:
                self._left_out["error frames"] += 1
            elif message.is_fd:
                self._left_out["CAN FD frames"] += 1
            else:
                is_empty = False
                yield frame_of(message, message.timestamp)
        if is_empty:
            of = f" of channel {self._channel}" if self._channel else ""
            raise OperationFailed(f"{self._path} has no CAN frame{of}; {self.left_out or 'it is empty'}")

    def _is_meant(self, channel: str) -> bool:
        if self._channel is None:
            self._channel, self._is_sure = channel, channel == self._expected
        if channel == self._channel:
            return True
        if not self._is_sure:
            raise OperationFailed(
                f"{self._path} has frames of several channels, of {self._channel} and {channel}: "
                "say which by --channel"
            )
        return False

    @property
    def left_out(self) -> str:
        """The kinds of frames that were not shown, with their counts; empty where there are none."""
        return ", ".join(f"{count} {what}" for what, count in sorted(self._left_out.items()))

    def _messages(self) -> Iterator[can.Message]:
        try:
            with self._reader() as reader:
                for message in reader:
                    self._count += 1
                    yield message
        except OSError as error:
            raise OperationFailed(f"{self._path} cannot be read: {error.strerror or error}") from None
        except _UNREADABLE as error:
            after = f"after {self._count} frames" if self._count else "from the start"
            raise OperationFailed(f"{self._path} is no {self._path.suffix} trace {after}: {error}") from None

    def _reader(self) -> MessageReader:
        reader = _TEXTS.get(self._path.suffix.lower())
        if reader is None:
            return can.BLFReader(self._path)
        self._lines = _Lines(self._path.open("rb"), encoding="latin-1")
        return reader(self._lines)
