"""Every interface that python-can knows and SocketCAN does not: USB adapters, serial lines, UDP.

python-can blocks, so one thread receives and one sends; the loop only ever touches queues.
"""

from __future__ import annotations

import asyncio
import contextlib
import queue
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any, Final

import can

from bridge.base.errors import Unavailable
from bridge.can.interface import ControllerState
from bridge.can.ownframes import OwnFrames
from bridge.can.softbus import SoftBus
from bridge.canopen.frame import EXTENDED, REMOTE, STANDARD_MASK, Frame
from bridge.text import Text

_MOST_WAITING: Final = 1 << 14
_MOST_TO_SEND: Final = 256
_POLL_S: Final = 0.2
_REOPEN_S: Final = (0.2, 5.0)
_ERROR_BYTES: Final = 8
_ECHOES: Final = frozenset({"udp_multicast"})
"""Interfaces that give a process what it has sent itself, without a mark (``Message.is_rx``)."""
_FAILURES: Final = (can.CanError, OSError, ValueError, ImportError, TypeError, AttributeError)


class PythonCanBus(SoftBus):
    """A python-can bus behind two threads."""

    def __init__(self, name: str, interface: str, channel: str, bitrate: int) -> None:
        super().__init__(name)
        self._interface, self._channel, self._bitrate = interface, channel, bitrate
        self._received: deque[Frame] = deque(maxlen=_MOST_WAITING)
        self._to_send: queue.Queue[tuple[Frame, float] | None] = queue.Queue(_MOST_TO_SEND)
        self._foreign: deque[Frame] = deque(maxlen=_MOST_WAITING)
        self._bus: can.BusABC | None = None
        self._own = OwnFrames() if interface in _ECHOES else None
        self._own_lock = threading.Lock()
        self._stopping = threading.Event()
        self._threads: list[threading.Thread] = []

    def open(self, wake: Callable[[], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._wake = wake
        try:
            self._bus = self._make()
        except _FAILURES as error:
            raise Unavailable(
                f"bus {self._name}: interface {self._interface!r}, channel {self._channel!r}: {error}"
            ) from error
        for work in (self._receive, self._transmit):
            thread = threading.Thread(target=work, name=f"{self._name}-{work.__name__}", daemon=True)
            thread.start()
            self._threads.append(thread)

    def _make(self) -> can.BusABC:
        options: dict[str, Any] = {"bitrate": self._bitrate}
        return can.Bus(interface=self._interface, channel=self._channel, **options)

    def take_foreign(self, now: float, *, at_once: bool = False) -> list[Frame]:
        frames: list[Frame] = []
        while self._foreign:
            frames.append(self._foreign.popleft())
        return frames

    def _receive(self) -> None:
        """Thread: everything that comes, each frame stamped as it comes."""
        while not self._stopping.is_set():
            bus = self._bus
            if bus is None:
                return
            try:
                message = bus.recv(_POLL_S)
            except (can.CanError, OSError, ValueError) as error:
                self._break_down(bus, error)
                continue
            if message is not None:
                self._take(message)

    def _take(self, message: can.Message) -> None:
        if message.is_error_frame:
            self._status.error_frames += 1
            data = bytes(message.data)
            if len(data) == _ERROR_BYTES:
                self._status.note_error((message.arbitration_id, data))
            return
        if message.is_fd:
            self._status.note_error(Text.of("can.fd_frame", can_id=message.arbitration_id))
            return
        frame = frame_of(message, time.monotonic())
        if not message.is_rx or self._is_own(frame):
            return
        self._passes(frame)
        if frame.can_id in self._ours:
            self._foreign.append(frame)
            self._rouse()
        if self._accepted is None or frame.can_id in self._accepted:
            self._give(frame, frame.time)

    def _is_own(self, frame: Frame) -> bool:
        if self._own is None:
            return False
        with self._own_lock:
            return self._own.is_own(frame.can_id, frame.data, frame.time)

    def _note_own(self, frame: Frame) -> None:
        """Before it is sent: it may come back at once."""
        if self._own is not None:
            with self._own_lock:
                self._own.sent(frame, time.monotonic())

    def _give(self, frame: Frame, now: float) -> None:
        del now
        if len(self._received) == _MOST_WAITING:
            self._status.frames_lost += 1
        self._received.append(frame)
        self._rouse()

    def _break_down(self, broken: can.BusABC, error: Exception) -> None:
        """Receiving thread: the adapter is gone. Looks for it, less and less often, until it is back."""
        self._status.outages += 1
        self._status.state = ControllerState.DOWN
        said = Text.of("can.adapter", interface=self._interface, channel=self._channel, why=str(error))
        self._status.note_error(said)
        self._rouse()
        _shut_down(broken)
        pause_s = _REOPEN_S[0]
        while not self._stopping.wait(pause_s):
            pause_s = min(2 * pause_s, _REOPEN_S[1])
            try:
                self._bus = self._make()
            except _FAILURES:
                continue
            # What was to be sent to the adapter that is gone is stale.
            self._status.frames_expired += self._to_send.qsize()
            self._to_send.queue.clear()
            self._status.state = ControllerState.OK
            self._rouse()
            return

    def _transmit(self) -> None:
        """Thread: sends in order; what is past its deadline is dropped."""
        while (item := self._to_send.get()) is not None:
            frame, deadline = item
            bus = self._bus
            if bus is None or self._status.state is ControllerState.DOWN or time.monotonic() > deadline:
                self._status.frames_expired += 1
                continue
            remote = bool(frame.can_id & REMOTE)
            message = can.Message(
                arbitration_id=frame.can_id & 0x1FFF_FFFF,
                is_extended_id=bool(frame.can_id & EXTENDED),
                is_remote_frame=remote,
                # A remote frame has the length of what it asks for, and no data.
                data=b"" if remote else frame.data,
                dlc=len(frame.data) or int(remote),
            )
            self._note_own(frame)
            try:
                bus.send(message, timeout=max(0.0, deadline - time.monotonic()))
                self._passes(frame._replace(time=time.monotonic()))
            except (can.CanError, OSError, ValueError):
                self._status.frames_expired += 1

    def _rouse(self) -> None:
        if self._loop and not self._woken:
            self._woken = True
            self._loop.call_soon_threadsafe(self._wake_up)

    def drain(self, now: float) -> list[Frame]:
        frames: list[Frame] = []
        while self._received:
            frames.append(self._received.popleft())
        self._status.frames_received += len(frames)
        return frames

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        if self._status.state is ControllerState.DOWN:
            self._status.frames_expired += 1
            return
        try:
            self._to_send.put_nowait((frame, deadline))
        except queue.Full:
            self._status.frames_expired += 1

    def close(self) -> None:
        self._bursts.clear()
        self._stopping.set()
        try:
            self._to_send.put_nowait(None)
        except queue.Full:
            self._to_send.queue.clear()
            self._to_send.put_nowait(None)
        for thread in self._threads:
            thread.join(2 * _POLL_S)
        if self._bus:
            _shut_down(self._bus)
            self._bus = None


def message_of(
    frame: Frame, at: float, channel: str | int | None = None, *, is_rx: bool = True
) -> can.Message:
    """A frame as python-can has it, ``at`` a time of whoever is to read it. A remote frame has a length and
    no data."""
    is_remote, is_extended = bool(frame.can_id & REMOTE), bool(frame.can_id & EXTENDED)
    return can.Message(
        timestamp=at,
        arbitration_id=frame.can_id & (0x1FFF_FFFF if is_extended else STANDARD_MASK),
        is_extended_id=is_extended,
        is_remote_frame=is_remote,
        data=None if is_remote else frame.data,
        dlc=len(frame.data),
        channel=channel,
        is_rx=is_rx,
    )


def frame_of(message: can.Message, at: float) -> Frame:
    """The frame in a message of classical CAN, received at ``at``."""
    flags = (EXTENDED if message.is_extended_id else 0) | (REMOTE if message.is_remote_frame else 0)
    return Frame(message.arbitration_id | flags, bytes(message.data), at)


def _shut_down(bus: can.BusABC) -> None:
    """An adapter that is gone may fail here, too: nothing is left to be done about it."""
    with contextlib.suppress(can.CanError, OSError, ValueError):
        bus.shutdown()
