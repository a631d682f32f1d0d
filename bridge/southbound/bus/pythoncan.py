"""Every interface that python-can knows and SocketCAN does not: USB adapters, serial lines, UDP.

python-can blocks, so one thread receives and one sends; the loop only ever touches queues.
"""

from __future__ import annotations

import asyncio
import queue
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any, Final

import can

from bridge.errors import Unavailable
from bridge.southbound.bus.frame import EXTENDED, REMOTE, Frame
from bridge.southbound.bus.interface import BusStatus, ControllerState
from bridge.southbound.bus.softbeat import SoftBeat

_MOST_WAITING: Final = 1 << 14
_MOST_TO_SEND: Final = 256
_POLL_S: Final = 0.2


class PythonCanBus:
    """A python-can bus behind two threads."""

    def __init__(self, name: str, interface: str, channel: str, bitrate: int) -> None:
        self._name = name
        self._interface, self._channel, self._bitrate = interface, channel, bitrate
        self._status = BusStatus()
        self._beats = SoftBeat()
        self._received: deque[Frame] = deque(maxlen=_MOST_WAITING)
        self._to_send: queue.Queue[tuple[Frame, float] | None] = queue.Queue(_MOST_TO_SEND)
        self._accepted: frozenset[int] | None = None
        self._bus: can.BusABC | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._wake: Callable[[], None] = lambda: None
        self._woken = False
        self._stopping = threading.Event()
        self._threads: list[threading.Thread] = []

    @property
    def name(self) -> str:
        return self._name

    @property
    def status(self) -> BusStatus:
        return self._status

    def open(self, wake: Callable[[], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._wake = wake
        options: dict[str, Any] = {"bitrate": self._bitrate}
        try:
            self._bus = can.Bus(interface=self._interface, channel=self._channel, **options)
        except (can.CanError, OSError, ValueError, ImportError, TypeError, AttributeError) as error:
            raise Unavailable(
                f"bus {self._name}: interface {self._interface!r}, channel {self._channel!r}: {error}"
            ) from error
        for work in (self._receive, self._transmit):
            thread = threading.Thread(target=work, name=f"{self._name}-{work.__name__}", daemon=True)
            thread.start()
            self._threads.append(thread)

    def accept(self, can_ids: list[int]) -> None:
        self._accepted = frozenset(can_ids)

    def _receive(self) -> None:
        """Thread: everything that comes, each frame stamped as it comes."""
        bus = self._bus
        while bus is not None and not self._stopping.is_set():
            try:
                message = bus.recv(_POLL_S)
            except (can.CanError, OSError, ValueError):
                self._status.state = ControllerState.DOWN
                self._rouse()
                self._stopping.wait(_POLL_S)
                continue
            if message is None:
                continue
            if self._status.state is ControllerState.DOWN:
                self._status.state = ControllerState.OK
            if message.is_error_frame or message.is_fd:
                continue
            flags = (EXTENDED if message.is_extended_id else 0) | (REMOTE if message.is_remote_frame else 0)
            can_id = message.arbitration_id | flags
            if self._accepted is not None and can_id not in self._accepted:
                continue
            if len(self._received) == _MOST_WAITING:
                self._status.frames_lost += 1
            self._received.append(Frame(can_id, bytes(message.data), time.monotonic()))
            self._rouse()

    def _transmit(self) -> None:
        """Thread: sends in order; what is past its deadline is dropped."""
        bus = self._bus
        while bus is not None and (item := self._to_send.get()) is not None:
            frame, deadline = item
            if time.monotonic() > deadline:
                self._status.frames_expired += 1
                continue
            remote = bool(frame.can_id & REMOTE)
            message = can.Message(
                arbitration_id=frame.can_id & 0x1FFF_FFFF,
                data=frame.data,
                is_extended_id=bool(frame.can_id & EXTENDED),
                is_remote_frame=remote,
                dlc=1 if remote else len(frame.data),
            )
            try:
                bus.send(message, timeout=max(0.0, deadline - time.monotonic()))
                self._status.frames_sent += 1
            except (can.CanError, OSError, ValueError):
                self._status.frames_expired += 1

    def _rouse(self) -> None:
        if self._loop and not self._woken:
            self._woken = True
            self._loop.call_soon_threadsafe(self._wake_up)

    def _wake_up(self) -> None:
        self._woken = False
        self._wake()

    def drain(self, now: float) -> list[Frame]:
        frames: list[Frame] = []
        while self._received:
            frames.append(self._received.popleft())
        self._status.frames_received += len(frames)
        return frames

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        try:
            self._to_send.put_nowait((frame, deadline))
        except queue.Full:
            self._status.frames_expired += 1

    def beat(self, frame: Frame, now: float, period_s: float, count: int, *, at_once: bool = False) -> None:
        if self._beats.beat(frame, now, period_s, count, at_once=at_once):
            self.send(frame, now, now + period_s)

    def silence(self, can_id: int) -> None:
        self._beats.silence(can_id)

    def next_deadline(self) -> float | None:
        return self._beats.next_deadline()

    def on_time(self, now: float) -> None:
        for frame in self._beats.due(now):
            self.send(frame, now, now + 0.05)

    def close(self) -> None:
        self._beats.clear()
        self._stopping.set()
        try:
            self._to_send.put_nowait(None)
        except queue.Full:
            self._to_send.queue.clear()
            self._to_send.put_nowait(None)
        for thread in self._threads:
            thread.join(2 * _POLL_S)
        if self._bus:
            self._bus.shutdown()
            self._bus = None
