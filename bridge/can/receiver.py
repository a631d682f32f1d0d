"""Frames out of a raw CAN socket, many with one system call (recvmmsg(2)).

A system call for each frame would cost more than everything that is done with the frame
(``tests/bench/lab/bench_receive.py``), and Python's socket module has none for several.
"""

from __future__ import annotations

import ctypes
import errno
import os
import socket
import struct
from collections.abc import Callable
from typing import Final, NamedTuple

from bridge.canopen.frame import ERROR, Frame

_FRAME: Final = struct.Struct("=IB3x8s")  # struct can_frame: identifier with flags, length, data

_SO_TIMESTAMPNS: Final = 35
_SO_RXQ_OVFL: Final = 40
# Two control messages in the kernel's order, aligned as CMSG_ALIGN does: time stamp (s, ns), drop counter.
_HEAD_BYTES: Final = struct.calcsize("@Nii")
_CONTROL: Final = struct.Struct(f"@{_HEAD_BYTES}xll{_HEAD_BYTES}xI0N")
_MSG_DONTWAIT: Final = 0x40
_MSG_DONTROUTE: Final = 0x04
"""Flag of the kernel for frames that came from a socket of this host (raw_rcv in net/can/raw.c)."""
BATCH: Final = 64
"""Frames per call at most."""

_FULL: Final = 8


class Stamps(NamedTuple):
    """Conversion of time stamps to monotonic seconds: the offset from the wall clock, and the limits."""

    wall_offset: float
    earliest: float
    latest: float


class _Vector(ctypes.Structure):
    _fields_ = (("base", ctypes.c_void_p), ("length", ctypes.c_size_t))


class _Header(ctypes.Structure):  # struct msghdr
    _fields_ = (
        ("name", ctypes.c_void_p),
        ("name_length", ctypes.c_uint32),
        ("vector", ctypes.c_void_p),
        ("vectors", ctypes.c_size_t),
        ("control", ctypes.c_void_p),
        ("control_length", ctypes.c_size_t),
        ("flags", ctypes.c_int),
    )


class _Message(ctypes.Structure):  # struct mmsghdr
    _fields_ = (("header", _Header), ("length", ctypes.c_uint))


_MESSAGE_BYTES: Final = ctypes.sizeof(_Message)
_FLAGS_AT: Final = _Header.flags.offset
_FLAGS: Final = struct.Struct(f"@{_FLAGS_AT}xi{_MESSAGE_BYTES - _FLAGS_AT - ctypes.sizeof(ctypes.c_int)}x")


class _Batches:
    """Fills buffers that are made once from one socket, without waiting."""

    def __init__(self, raw: socket.socket) -> None:
        """Asks for time stamps and drop counters. Raises OSError."""
        raw.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        raw.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)
        self._raw = raw
        self._receive = ctypes.CDLL(None, use_errno=True).recvmmsg
        frames = ctypes.create_string_buffer(BATCH * _FRAME.size)
        controls = ctypes.create_string_buffer(BATCH * _CONTROL.size)
        self._vectors = (_Vector * BATCH)()
        self._messages = (_Message * BATCH)()
        for place, (vector, message) in enumerate(zip(self._vectors, self._messages, strict=True)):
            vector.base = ctypes.addressof(frames) + place * _FRAME.size
            vector.length = _FRAME.size
            message.header.vector = ctypes.addressof(vector)
            message.header.vectors = 1
            message.header.control = ctypes.addressof(controls) + place * _CONTROL.size
            message.header.control_length = _CONTROL.size
        # The kernel writes lengths and flags into the messages it fills: they are made fresh again.
        self._fresh = bytes(self._messages)
        self._message_view = memoryview(self._messages).cast("B")
        self._used = 0
        """Bytes of the messages that the last call may have written to."""
        self._buffers = frames, controls
        self._frame_view, self._control_view = memoryview(frames), memoryview(controls)

    def _fill(self) -> int:
        """The number of messages that came, at most ``BATCH``. Raises OSError where the interface is gone or
        down."""
        used = self._used
        self._message_view[:used] = self._fresh[:used]
        count: int = self._receive(self._raw.fileno(), self._messages, BATCH, _MSG_DONTWAIT, None)
        self._used = min(max(count, 0) + 1, BATCH) * _MESSAGE_BYTES
        if count < 0:
            number = ctypes.get_errno()
            if number in (errno.EAGAIN, errno.EINTR):
                return 0
            raise OSError(number, os.strerror(number))
        return count


class Receiver(_Batches):
    """Receives what is waited for."""

    def __init__(self, raw: socket.socket) -> None:
        super().__init__(raw)
        self.drops = 0
        """Frames that the kernel has dropped since the opening, modulo 2³²."""

    def receive(self, frames: list[Frame], stamps: Stamps) -> tuple[int, list[tuple[int, bytes]]]:
        """Put the next frames into ``frames``, at most ``BATCH`` of them.

        Gives the number of all that came, and the identifiers and data of the error frames among them.
        Raises OSError where the interface is gone or down.
        """
        count = self._fill()
        errors: list[tuple[int, bytes]] = []
        wall_offset, earliest, latest = stamps
        for (can_id, length, data), (seconds, nanoseconds, drops) in zip(
            _FRAME.iter_unpack(self._frame_view[: count * _FRAME.size]),
            _CONTROL.iter_unpack(self._control_view[: count * _CONTROL.size]),
            strict=True,
        ):
            self.drops = drops
            if can_id & ERROR:
                errors.append((can_id, data))
                continue
            stamp = seconds + nanoseconds * 1e-9 + wall_offset
            if stamp > latest:
                stamp = latest
            elif stamp < earliest:
                stamp = earliest
            frames.append(Frame(can_id, data if length == _FULL else data[:length], stamp))
        return count, errors


class WatchReceiver(_Batches):
    """Receives what only we should send: mostly our own frames, which come back."""

    def __init__(self, raw: socket.socket) -> None:
        super().__init__(raw)
        self._has_marks = False
        """Frames of local senders come with the mark here. As long as none did, a driver may have lost it."""

    def receive(
        self, frames: list[Frame], stamps: Stamps, is_own: Callable[[int, bytes, float], bool]
    ) -> int:
        """Put those of the next frames that are somebody else's into ``frames``: those without the mark of a
        local sender, and those with it of which ``is_own`` says no. Gives the number of all that came.

        Raises OSError where the interface is gone or down.
        """
        count = self._fill()
        wall_offset, earliest, latest = stamps
        for (can_id, length, data), (seconds, nanoseconds, _), (flags,) in zip(
            _FRAME.iter_unpack(self._frame_view[: count * _FRAME.size]),
            _CONTROL.iter_unpack(self._control_view[: count * _CONTROL.size]),
            _FLAGS.iter_unpack(self._message_view[: count * _MESSAGE_BYTES]),
            strict=True,
        ):
            stamp = min(max(seconds + nanoseconds * 1e-9 + wall_offset, earliest), latest)
            data = data if length == _FULL else data[:length]
            is_marked = bool(flags & _MSG_DONTROUTE)
            self._has_marks |= is_marked
            if (is_marked or not self._has_marks) and is_own(can_id, data, stamp):
                continue
            frames.append(Frame(can_id, data, stamp))
        return count
