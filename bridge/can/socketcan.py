"""SocketCAN: a bus on one interface of the kernel.

Receives on a raw socket in batches, each frame with its kernel time stamp; lets the broadcast manager
send what is repeated, in bursts that end unless they are renewed. What passes on the bus is not counted
frame by frame but asked of the kernel once a second: its counters see every node's frames and our own
bursts, cost nothing while the bus is busy, and leave the receive filter closed.
"""

from __future__ import annotations

import asyncio
import errno
import socket
import time
from collections.abc import Callable
from typing import Final

from bridge.base.errors import Unavailable
from bridge.can import bcm
from bridge.can.burstend import Burst
from bridge.can.cansockets import CanSockets
from bridge.can.errorframe import judge
from bridge.can.explain import TooSlow, WrongBitrate, explain
from bridge.can.foreignwatch import ForeignWatch
from bridge.can.interface import BusStatus, ControllerState
from bridge.can.kernelbursts import KernelBursts
from bridge.can.linkwatch import LinkWatch
from bridge.can.netlink import Link
from bridge.can.outbox import Outbox
from bridge.can.receiver import BATCH, Receiver, Stamps
from bridge.can.wakeups import Wakeups
from bridge.can.wirebits import WireBits
from bridge.canopen.frame import Frame

_MOST_PER_ROUND: Final = 2048
_BEAT_LIMIT_S: Final = 0.01
_OUTAGES: Final = (ControllerState.BUS_OFF, ControllerState.PASSIVE)


class SocketCanBus:
    """One SocketCAN interface."""

    def __init__(
        self,
        name: str,
        channel: str,
        bitrate: int | None = None,
        sockets: CanSockets | None = None,
        *,
        at_least: int = 0,
    ) -> None:
        """``bitrate`` (bit/s) is compared with the interface's own, where it says one; so is ``at_least``.
        ``sockets`` are those of ``channel``, unless given."""
        self._name = name
        self._bitrate = bitrate
        self._at_least = at_least
        self._channel = channel
        self._status = BusStatus()
        self._raw: socket.socket | None = None
        self._receiver: Receiver | None = None
        self._wakeups = Wakeups()
        self._sockets = sockets or CanSockets(channel)
        self._watch = LinkWatch(self._sockets.link)
        self._foreign = ForeignWatch(self._sockets)
        self._bursts = KernelBursts(time.monotonic)
        self._outbox = Outbox()
        self._accepted: frozenset[int] = frozenset()
        self._own: list[Frame] = []
        """Frames of bursts that we have sent ourselves: the kernel gives back only its own."""
        self._wire = WireBits()
        self._passed = (0, 0)
        self._drops = 0
        self._last_drain = 0.0

    @property
    def name(self) -> str:
        return self._name

    @property
    def status(self) -> BusStatus:
        return self._status

    # opening and closing

    def open(self, wake: Callable[[], None]) -> None:
        loop = asyncio.get_running_loop()
        self._wakeups.begin(loop, wake)
        self._watch.begin(loop, wake)
        try:
            self._open(self._sockets.link())
        except OSError as error:
            self._close_sockets()
            raise Unavailable(f"bus {self._name}: {explain(error, self._channel)}") from error

    def _open(self, link: Link) -> None:
        # First: a socket binds to an interface that is down without complaint.
        self._check_link(link)
        raw = self._raw = self._sockets.raw()
        self._receiver = Receiver(raw)
        self._drops = 0
        self._open_manager()
        self._last_drain = time.monotonic()
        self._foreign.open(self._last_drain)
        self._foreign.own.stalled(self._last_drain, is_stalled=False)
        self._watch.opened(self._last_drain)
        self._status.state = ControllerState.OK
        self._wakeups.open(raw.fileno())

    def _open_manager(self) -> None:
        self._bursts.open(self._sockets.manager())
        self._status.bursts_refused = ""

    def _check_link(self, link: Link) -> None:
        if not link.is_up:
            raise OSError(errno.ENETDOWN, "the interface is down")
        if self._bitrate and link.bitrate and link.bitrate != self._bitrate:
            raise WrongBitrate(self._channel, link.bitrate, self._bitrate)
        if link.bitrate and link.bitrate < self._at_least:
            raise TooSlow(self._channel, link.bitrate, self._at_least)
        self._passed = link.frames, link.data_bytes

    def accept(self, can_ids: list[int]) -> None:
        self._accepted = frozenset(can_ids)
        self._sockets.accept(can_ids, self._raw)

    def watch(self, can_ids: frozenset[int]) -> None:
        self._foreign.watch(can_ids)

    def close(self) -> None:
        self._watch.end()
        self._close_sockets()

    def _close_sockets(self) -> None:
        self._bursts.close()
        self._own.clear()
        self._drop_waiting()
        self._foreign.own.silenced_all(self._last_drain)
        self._foreign.close()
        self._receiver = None
        if self._raw:
            self._wakeups.close()
            self._raw.close()
            self._raw = None

    def _break_down(self, error: OSError, now: float) -> None:
        """The interface is gone or down. Its bursts go first: they would outlive a short outage."""
        self._close_sockets()
        self._status.outages += 1
        self._status.state = ControllerState.DOWN
        self._status.note_error(explain(error, self._channel))
        self._watch.lost(now)

    # receiving

    def drain(self, now: float) -> list[Frame]:
        frames: list[Frame] = []
        receiver = self._receiver
        # The stamp is wall clock; its age at the drain is not, and cannot be longer than the last drain
        # is ago. So a stepped clock moves no deadline.
        stamps = Stamps(now - time.time(), self._last_drain, now)
        for _ in range(_MOST_PER_ROUND // BATCH):
            if receiver is None or receiver is not self._receiver:
                break
            try:
                number, errors = receiver.receive(frames, stamps)
            except OSError as error:
                self._break_down(error, now)
                break
            self._wakeups.fetched(number)
            for can_id, data in errors:
                self._on_error_frame(can_id, data, now)
            if number < BATCH:
                break
        if receiver:
            self._count_drops(receiver.drops)
        self._last_drain = now
        if frames:
            self._status.frames_received += len(frames)
            self._wire.sample(frames[-1])
        if self._own:
            frames = self._own + frames
            self._own = []
        if self._outbox:
            self._send_waiting(now)
        return frames

    def take_foreign(self, now: float, *, at_once: bool = False) -> list[Frame]:
        return self._foreign.take(now, at_once=at_once)

    def _count_drops(self, drops: int) -> None:
        """The kernel counts from the socket's opening, modulo 2³²."""
        if drops != self._drops:
            self._status.frames_lost += (drops - self._drops) & 0xFFFF_FFFF
            self._drops = drops

    def _on_error_frame(self, can_id: int, data: bytes, now: float) -> None:
        status = self._status
        status.note_error((can_id, data))
        status.error_frames += 1
        state, counters = judge(can_id, data)
        if counters:
            status.tx_errors, status.rx_errors = counters
        if state is not None:
            self._enter(state, now)

    def _enter(self, state: ControllerState, now: float) -> None:
        """The controller is in this state: where it cannot send, what was to be sent is stale."""
        is_outage = state in _OUTAGES and state is not self._status.state
        self._status.state = state
        self._foreign.own.stalled(now, is_stalled=state in _OUTAGES)
        if is_outage:
            self._status.outages += 1
            self._drop_waiting()
            self._foreign.own.silenced_all(now)
            try:
                self._bursts.end_all(now)
            except OSError as error:
                self._break_down(error, now)

    # sending

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        if self._outbox and self._can_send:
            self._send_waiting(now)
        if frame.can_id in self._foreign:
            self._foreign.own.sent(frame, now)
        if not self._can_send:
            self._status.frames_expired += 1
        elif self._outbox or not self._try_send(frame, now):
            # Where the bus broke while sending, nothing may wait for its return.
            kept = self._can_send and self._outbox.put(frame, now, deadline)
            self._status.frames_expired += not kept

    @property
    def _can_send(self) -> bool:
        return self._raw is not None and self._status.state is not ControllerState.BUS_OFF

    def _try_send(self, frame: Frame, now: float) -> bool:
        """False where there is no room now, or no bus."""
        if self._raw is None or not self._can_send:
            return False
        try:
            self._raw.send(bcm.frame_bytes(frame))
        except (BlockingIOError, InterruptedError):
            return False
        except OSError as error:
            if error.errno == errno.ENOBUFS:
                return False
            self._break_down(error, now)
            return False
        self._wire.sample(frame)
        self._wakeups.sent()
        return True

    def _send_waiting(self, now: float) -> None:
        self._status.frames_expired += self._outbox.send(now, self._try_send)

    def _drop_waiting(self) -> None:
        self._status.frames_expired += self._outbox.clear()

    def burst(self, burst: Burst, now: float, *, at_once: bool = False) -> None:
        frames, ending = burst.frames, burst.ending
        if burst.can_id in self._foreign:
            last = (ending.frame,) if ending and ending.frame else ()
            self._foreign.own.told((*frames, *last), now, burst.period_s, at_once=at_once)
        try:
            first = self._bursts.start(burst, now, at_once=at_once)
        except OSError as error:
            self._break_down(error, now)
            return
        if first is not None:
            self._send_of_burst(first, now)
        self._wire.sample(frames[0])

    def end_burst(self, can_id: int) -> None:
        self._foreign.own.silenced(can_id, self._last_drain)
        try:
            self._bursts.end(can_id, self._last_drain)
        except OSError as error:
            self._break_down(error, self._last_drain)

    def _send_bursts(self, now: float) -> None:
        """Send what the kernel does not repeat for us, and again what it has refused."""
        try:
            frames = self._bursts.on_time(now)
        except OSError as error:
            self._break_down(error, now)
            return
        self._status.bursts_refused = self._bursts.refusal
        for frame in frames:
            self._send_of_burst(frame, now)

    def _send_of_burst(self, frame: Frame, now: float) -> None:
        self.send(frame, now, now + _BEAT_LIMIT_S)
        if frame.can_id in self._accepted and self._can_send:
            self._own.append(frame._replace(time=now))

    # time

    def next_deadline(self) -> float | None:
        times = [self._watch.next_deadline()]
        if self._raw is not None:
            times += [self._outbox.retry_at, self._bursts.next_deadline(), self._foreign.next_deadline()]
        return min((time for time in times if time is not None), default=None)

    def on_time(self, now: float) -> None:
        if self._outbox:
            self._send_waiting(now)
        self._send_bursts(now)
        if (looking := self._watch.take()) is not None:
            self._take_look(looking, now)
        self._watch.on_time(now)

    def _take_look(self, looking: asyncio.Future[Link], now: float) -> None:
        is_open = self._raw is not None
        try:
            link = looking.result()
            if is_open:
                self._see(link, now)
            else:
                self._open(link)
        except OSError as error:
            if is_open:
                self._break_down(error, now)
            else:
                self._close_sockets()
                self._status.note_error(explain(error, self._channel))

    def _see(self, link: Link, now: float) -> None:
        """Count the frames since the last poll, and take over the controller's state."""
        frames, data_bytes = link.frames - self._passed[0], link.data_bytes - self._passed[1]
        self._passed = link.frames, link.data_bytes
        if frames >= 0 and data_bytes >= 0:  # else the interface has been made anew
            self._wire.add_many(frames, data_bytes)
        status = self._status
        status.bits = int(self._wire.total)
        if link.tx_errors is not None and link.rx_errors is not None:
            status.tx_errors, status.rx_errors = link.tx_errors, link.rx_errors
        if self._bursts.refusal:
            self._open_manager()
        # An error frame may be lost in a full socket buffer; the driver's own state is not.
        if link.state is not None and link.state <= ControllerState.BUS_OFF and link.state != status.state:
            self._enter(ControllerState(link.state), now)
