"""SocketCAN: the only file that opens a CAN socket.

Receives on a raw socket in batches, each frame with its kernel time stamp; lets the broadcast manager
send what is repeated, in bursts that end unless they are renewed. The constants are those of
<linux/can.h>, <linux/can/raw.h>, <linux/can/error.h> and <linux/can/bcm.h>.
"""

from __future__ import annotations

import asyncio
import errno
import json
import socket
import struct
import subprocess
import time
from collections import deque
from collections.abc import Callable
from typing import Final

from bridge.errors import Unavailable
from bridge.southbound.bus.frame import ERROR, REMOTE, Frame
from bridge.southbound.bus.interface import BusStatus, ControllerState
from bridge.southbound.bus.softbeat import SoftBeat

_FRAME: Final = struct.Struct("=IB3x8s")
_FILTER: Final = struct.Struct("=II")
# The head of a BCM message: aligned as the C compiler aligns it, frames begin on eight bytes.
_BCM_HEAD: Final = struct.Struct("@IIIllllII0q")

_SOL_CAN_RAW: Final = 101
_CAN_RAW_FILTER: Final = 1
_CAN_RAW_ERR_FILTER: Final = 2
_CAN_ERR_MASK: Final = 0x1FFF_FFFF
_CAN_BCM: Final = 2
_SO_TIMESTAMPNS: Final = 35
_SO_RXQ_OVFL: Final = 40
_TIMESPEC: Final = struct.Struct("@qq")
_DROPS: Final = struct.Struct("@I")
_ANCILLARY: Final = 128
_RECEIVE_BUFFER: Final = 1 << 20

_TX_SETUP: Final = 1
_TX_DELETE: Final = 2
_SETTIMER: Final = 1
_STARTTIMER: Final = 2
_TX_ANNOUNCE: Final = 8

_ERR_CONTROLLER: Final = 0x0004
_ERR_BUS_OFF: Final = 0x0040
_ERR_RESTARTED: Final = 0x0100
_ERR_COUNTERS: Final = 0x0200
_CRTL_WARNING: Final = 0x04 | 0x08
_CRTL_PASSIVE: Final = 0x10 | 0x20
_CRTL_ACTIVE: Final = 0x40

_EXACT: Final = 0xC000_07FF  # identifier, no extended frames, no remote frames
_MOST_PER_ROUND: Final = 2000
_MOST_WAITING: Final = 64
_REOPEN_S: Final = (0.2, 5.0)
_SHORTEST_BURST: Final = 4
_SLOW_LIMIT_S: Final = 0.05


class SocketCanBus:
    """One SocketCAN interface."""

    def __init__(self, name: str, channel: str, bitrate: int | None = None) -> None:
        """``bitrate`` (bit/s) is compared with the interface's own, where it says one."""
        self._name = name
        self._bitrate = bitrate
        self._channel = channel
        self._status = BusStatus()
        self._raw: socket.socket | None = None
        self._bcm: socket.socket | None = None
        self._wake: Callable[[], None] = lambda: None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._filters: bytes | None = None
        self._jobs: dict[int, tuple[float, float]] = {}  # can id: period, until when it surely runs
        self._slow = SoftBeat()
        self._waiting: deque[tuple[Frame, float]] = deque()
        self._drops = 0
        self._last_drain = 0.0
        self._reopen_at: float | None = None
        self._reopen_s = _REOPEN_S[0]

    @property
    def name(self) -> str:
        return self._name

    @property
    def status(self) -> BusStatus:
        return self._status

    # opening and closing

    def open(self, wake: Callable[[], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._wake = wake
        try:
            self._open()
        except OSError as error:
            self._close_sockets()
            raise Unavailable(f"bus {self._name}: {_explain(error, self._channel)}") from error
        actual = interface_bitrate(self._channel)
        if self._bitrate and actual and actual != self._bitrate:
            self._close_sockets()
            raise Unavailable(
                f"bus {self._name}: {self._channel} runs at {actual} bit/s, the site file says "
                f"{self._bitrate}: change one of them"
            )

    def _open(self) -> None:
        raw = self._raw = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        raw.setblocking(False)
        raw.setsockopt(_SOL_CAN_RAW, _CAN_RAW_ERR_FILTER, struct.pack("=I", _CAN_ERR_MASK))
        raw.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        raw.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)
        self._drops = 0
        if self._filters is not None:
            raw.setsockopt(_SOL_CAN_RAW, _CAN_RAW_FILTER, self._filters)
        raw.bind((self._channel,))
        bcm = self._bcm = socket.socket(socket.AF_CAN, socket.SOCK_DGRAM, _CAN_BCM)
        bcm.setblocking(False)
        bcm.connect((self._channel,))
        # A socket binds to an interface that is down without complaint; sending tells.
        if not _is_up(self._channel):
            raise OSError(errno.ENETDOWN, "the interface is down")
        self._last_drain = time.monotonic()
        self._status.state = ControllerState.OK
        if self._loop:
            self._loop.add_reader(raw.fileno(), self._wake)

    def accept(self, can_ids: list[int]) -> None:
        self._filters = b"".join(_FILTER.pack(can_id, _EXACT) for can_id in can_ids)
        if self._raw:
            self._raw.setsockopt(_SOL_CAN_RAW, _CAN_RAW_FILTER, self._filters)

    def close(self) -> None:
        self._reopen_at = None
        self._close_sockets()

    def _close_sockets(self) -> None:
        # Closing the socket of the broadcast manager removes its jobs.
        self._jobs.clear()
        self._slow.clear()
        self._waiting.clear()
        if self._raw:
            if self._loop and self._raw.fileno() >= 0:
                self._loop.remove_reader(self._raw.fileno())
            self._raw.close()
            self._raw = None
        if self._bcm:
            self._bcm.close()
            self._bcm = None

    def _break_down(self, now: float) -> None:
        """The interface is gone or down. Its bursts go first: they would outlive a short outage."""
        self._close_sockets()
        self._status.outages += 1
        self._status.state = ControllerState.DOWN
        self._reopen_at = now + self._reopen_s
        self._reopen_s = min(self._reopen_s * 2, _REOPEN_S[1])

    # receiving

    def drain(self, now: float) -> list[Frame]:
        raw = self._raw
        if raw is None:
            return []
        frames: list[Frame] = []
        wall_offset = now - time.time()
        earliest = self._last_drain
        for _ in range(_MOST_PER_ROUND):
            try:
                data, ancillary, _, _ = raw.recvmsg(_FRAME.size, _ANCILLARY)
            except BlockingIOError:
                break
            except OSError:
                self._break_down(now)
                break
            # The stamp is wall clock; its age at the drain is not, and cannot be longer than the last
            # drain is ago. So a stepped clock moves no deadline.
            stamp = now
            for level, kind, value in ancillary:
                if level != socket.SOL_SOCKET:
                    continue
                if kind == _SO_TIMESTAMPNS:
                    seconds, nanoseconds = _TIMESPEC.unpack(value)
                    stamp = min(now, max(earliest, seconds + nanoseconds * 1e-9 + wall_offset))
                elif kind == _SO_RXQ_OVFL:
                    self._count_drops(_DROPS.unpack(value)[0])
            can_id, length, payload = _FRAME.unpack(data)
            if can_id & ERROR:
                self._on_error_frame(can_id, payload, now)
            else:
                frames.append(Frame(can_id, payload[:length], stamp))
        self._last_drain = now
        self._status.frames_received += len(frames)
        if self._waiting:
            self._send_waiting(now)
        return frames

    def _count_drops(self, drops: int) -> None:
        """The kernel counts from the socket's opening, modulo 2³²."""
        if drops != self._drops:
            self._status.frames_lost += (drops - self._drops) & 0xFFFF_FFFF
            self._drops = drops

    def _on_error_frame(self, can_id: int, payload: bytes, now: float) -> None:
        """The controller or the bus has a fault (<linux/can/error.h>)."""
        status = self._status
        if can_id & _ERR_COUNTERS:
            status.tx_errors, status.rx_errors = payload[6], payload[7]
        if can_id & _ERR_BUS_OFF:
            status.state = ControllerState.BUS_OFF
            self._stop_all(now)
        elif can_id & _ERR_RESTARTED:
            status.state = ControllerState.OK
        elif can_id & _ERR_CONTROLLER:
            if payload[1] & _CRTL_PASSIVE:
                if status.state is not ControllerState.PASSIVE:
                    self._stop_all(now)
                status.state = ControllerState.PASSIVE
            elif payload[1] & _CRTL_WARNING:
                status.state = ControllerState.WARNING
            elif payload[1] & _CRTL_ACTIVE:
                status.state = ControllerState.OK

    # sending

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        if self._waiting or not self._try_send(frame, now):
            if self._raw is None or len(self._waiting) >= _MOST_WAITING:
                self._status.frames_expired += 1
            else:
                self._waiting.append((frame, deadline))

    def _try_send(self, frame: Frame, now: float) -> bool:
        """False where there is no room now."""
        if self._raw is None:
            return False
        try:
            self._raw.send(_frame_bytes(frame))
        except (BlockingIOError, InterruptedError):
            return False
        except OSError as error:
            if error.errno == errno.ENOBUFS:
                return False
            self._break_down(now)
            return False
        self._status.frames_sent += 1
        return True

    def _send_waiting(self, now: float) -> None:
        while self._waiting:
            frame, deadline = self._waiting[0]
            if now > deadline:
                self._status.frames_expired += 1
            elif not self._try_send(frame, now):
                return
            if self._waiting:
                self._waiting.popleft()

    def beat(self, frame: Frame, now: float, period_s: float, count: int, *, at_once: bool = False) -> None:
        if count < _SHORTEST_BURST:
            # The kernel counts the first frame of a burst, so one of a frame or two ends before it can be
            # renewed. What is that slow needs no kernel: a round sends it.
            if self._slow.beat(frame, now, period_s, count, at_once=at_once):
                self.send(frame, now, now + period_s)
            return
        job = self._jobs.get(frame.can_id)
        # Refilling keeps the phase of a burst that runs and cannot wake one that has ended. Its last frame
        # comes up to a period before its count of periods is over.
        runs = job is not None and job[0] == period_s and now < job[1]
        flags = _SETTIMER | (0 if runs else _STARTTIMER) | (_TX_ANNOUNCE if at_once else 0)
        self._jobs[frame.can_id] = (period_s, now + (count - 2) * period_s)
        microseconds = round(period_s * 1e6)
        head = _BCM_HEAD.pack(
            _TX_SETUP,
            flags,
            count,
            microseconds // 1_000_000,
            microseconds % 1_000_000,
            0,
            0,
            frame.can_id,
            1,
        )
        self._tell_bcm(head + _frame_bytes(frame), now)

    def silence(self, can_id: int) -> None:
        self._slow.silence(can_id)
        if self._jobs.pop(can_id, None) is not None:
            self._tell_bcm(_BCM_HEAD.pack(_TX_DELETE, 0, 0, 0, 0, 0, 0, can_id, 0), self._last_drain)

    def _stop_all(self, now: float) -> None:
        """Nothing that was to be sent is sent later."""
        self._status.outages += 1
        self._waiting.clear()
        self._slow.clear()
        for can_id in list(self._jobs):
            self.silence(can_id)

    def _tell_bcm(self, message: bytes, now: float) -> None:
        if self._bcm is None:
            return
        try:
            self._bcm.send(message)
        except OSError as error:
            if error.errno in (errno.ENETDOWN, errno.ENODEV, errno.ENXIO):
                self._break_down(now)
            else:
                self._jobs.clear()
                self._status.frames_expired += 1

    # time

    def next_deadline(self) -> float | None:
        times = [deadline for _, deadline in self._waiting]
        slow = self._slow.next_deadline()
        if slow is not None:
            times.append(slow)
        if self._reopen_at is not None:
            times.append(self._reopen_at)
        return min(times) if times else None

    def on_time(self, now: float) -> None:
        self._send_waiting(now)
        for frame in self._slow.due(now):
            self.send(frame, now, now + _SLOW_LIMIT_S)
        if self._reopen_at is None or now < self._reopen_at:
            return
        try:
            self._open()
        except OSError:
            self._break_down(now)
        else:
            self._reopen_at = None
            self._reopen_s = _REOPEN_S[0]


def _frame_bytes(frame: Frame) -> bytes:
    """``struct can_frame``. A remote frame asks for one byte: the answer to node guarding."""
    length = 1 if frame.can_id & REMOTE else len(frame.data)
    return _FRAME.pack(frame.can_id, length, frame.data.ljust(8, b"\0"))


def _is_up(channel: str) -> bool:
    """Whether the interface has its IFF_UP flag (SIOCGIFFLAGS)."""
    import fcntl

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as query:
        request = struct.pack("16sH14x", channel.encode(), 0)
        flags = struct.unpack("16sH14x", fcntl.ioctl(query, 0x8913, request))[1]
    return bool(flags & 1)


def interface_bitrate(channel: str) -> int | None:
    """The interface's bit rate in bit/s; None where it has none (vcan) or iproute2 is not there."""
    command = ["ip", "-json", "-details", "link", "show", "dev", channel]
    try:
        done = subprocess.run(command, capture_output=True, timeout=2, check=True)
        [link] = json.loads(done.stdout)
        return int(link["linkinfo"]["info_data"]["bittiming"]["bitrate"])
    except (OSError, subprocess.SubprocessError, ValueError, LookupError, TypeError):
        return None


def _explain(error: OSError, channel: str) -> str:
    """What helps against ``error``."""
    match error.errno:
        case errno.ENODEV | errno.ENXIO:
            return f"there is no interface {channel}; see `ip link`, and deploy/ for networkd files"
        case errno.ENETDOWN:
            return f"interface {channel} is down: ip link set {channel} up type can bitrate …"
        case errno.EAFNOSUPPORT | errno.EPROTONOSUPPORT:
            return "this kernel has no SocketCAN (modprobe can can-raw can-bcm)"
        case errno.EPERM | errno.EACCES:
            return f"no permission to open {channel}"
        case _:
            return f"{channel} cannot be opened: {error.strerror or error}"
