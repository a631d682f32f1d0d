"""The kernel's broadcast manager, as far as finite bursts need it (<linux/can/bcm.h>, net/can/bcm.c): for a
bus that is a pair of sockets. It has no socket and no clock of its own."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass

from bridge.canopen.frame import Frame
from tests.peers.can_end import FRAME

_HEAD = struct.Struct("@IIIllllII0q")
_TX_SETUP = 1
_TX_DELETE = 2
_SETTIMER = 1
_STARTTIMER = 2
_TX_ANNOUNCE = 8
_TX_RESET_MULTI_IDX = 0x200
MOST_BYTES = _HEAD.size + 256 * FRAME.size
_NEVER = float("inf")


@dataclass(slots=True)
class _Task:
    frames: list[Frame]
    place: int = 0
    left: int = 0
    period_s: float = 0.0
    due: float = _NEVER

    def next_frame(self) -> Frame:
        frame = self.frames[self.place]
        self.place = (self.place + 1) % len(self.frames)
        self.left = max(0, self.left - 1)
        return frame


class BroadcastManager:
    """``take`` a message, ``send`` what is due. Times are monotonic seconds."""

    def __init__(self) -> None:
        self._tasks: dict[int, _Task] = {}
        self.due = _NEVER

    def take(self, message: bytes, now: float) -> Iterator[Frame]:
        """Carry out a message; gives the frame that is sent at once, if any."""
        opcode, flags, count, seconds, microseconds, _, _, can_id, number = _HEAD.unpack_from(message)
        if opcode == _TX_DELETE:
            self._tasks.pop(can_id, None)
        elif opcode == _TX_SETUP:
            places = range(_HEAD.size, _HEAD.size + number * FRAME.size, FRAME.size)
            frames = [_frame(*FRAME.unpack_from(message, place)) for place in places]
            task = self._tasks.setdefault(can_id, _Task(frames))
            task.frames = frames
            if flags & _TX_RESET_MULTI_IDX or task.place >= len(frames):
                task.place = 0
            if flags & _SETTIMER:
                task.left, task.period_s = count, seconds + microseconds / 1e6
            if flags & (_STARTTIMER | _TX_ANNOUNCE):
                yield task.next_frame()
            if flags & _STARTTIMER:
                task.due = now + task.period_s if task.left else _NEVER
        else:
            raise ValueError(f"the broadcast manager of the bench knows no opcode {opcode}")
        self._plan()

    def send(self, now: float) -> Iterator[Frame]:
        """The frames that are due."""
        if now < self.due:
            return
        for task in self._tasks.values():
            if task.due <= now:
                # As the kernel's timer: what was missed is not made up for.
                task.due += task.period_s * (1 + (now - task.due) // task.period_s)
                yield task.next_frame()
                if not task.left:
                    task.due = _NEVER
        self._plan()

    def _plan(self) -> None:
        self.due = min((task.due for task in self._tasks.values()), default=_NEVER)


def _frame(can_id: int, length: int, data: bytes) -> Frame:
    return Frame(can_id, data[:length])
