"""Memory that the proof shares with the owners: what each drive is to be told, and when it was told.

Telegrams are numbered: the number is added to the setpoint, so that the bus itself shows which telegram of
the owner the bridge took last. When that one was sent stands here, in seconds of the monotonic clock.
"""

from __future__ import annotations

import mmap
import struct
from pathlib import Path
from typing import Final

NUMBERS: Final = 32
"""Telegrams are numbered modulo this: more than an owner sends within a time-out."""
_WORD: Final = struct.Struct("=q")
_STAMP: Final = struct.Struct("=d")
_PAIR: Final = struct.Struct("=qq")
RELEASE: Final = -1
"""In place of a control word: the owner gives the drive back, over the connection by which it owns it."""
_BYTES: Final = 1024
_ACCEPTED: Final = 8
_STAMPS: Final = 24


class Board:
    """``drives`` places in the file ``path``, which the first one to come makes."""

    def __init__(self, path: Path, drives: int) -> None:
        if not path.exists():
            path.write_bytes(bytes(_BYTES * drives))
        with path.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), _BYTES * drives)

    def command(self, place: int, control_word: int) -> None:
        """What the owner of this drive is to write from now on."""
        _WORD.pack_into(self._memory, _BYTES * place, control_word)

    def control_word(self, place: int) -> int:
        return int(_WORD.unpack_from(self._memory, _BYTES * place)[0])

    def stamp(self, place: int, number: int, at: float) -> None:
        """Telegram ``number`` is sent now."""
        _STAMP.pack_into(self._memory, _BYTES * place + _STAMPS + 8 * number, at)

    def sent_at(self, place: int, number: int) -> float:
        return float(_STAMP.unpack_from(self._memory, _BYTES * place + _STAMPS + 8 * number)[0])

    def last_sent(self, place: int) -> float:
        """When the latest telegram was sent."""
        return max(self.sent_at(place, number) for number in range(NUMBERS))

    def accept(self, place: int, control_word: int) -> None:
        """A telegram with this word was answered without an error."""
        count, _ = self.accepted(place)
        _PAIR.pack_into(self._memory, _BYTES * place + _ACCEPTED, count + 1, control_word)

    def accepted(self, place: int) -> tuple[int, int]:
        """How many telegrams, and the word of the last one."""
        count, control_word = _PAIR.unpack_from(self._memory, _BYTES * place + _ACCEPTED)
        return int(count), int(control_word)
