"""What is done to the machine: gateway between the buses, cut networks, frozen threads, clock, full disk.

Everything happens in the network (and mount) namespace of the proof. Needs root there, can-gw, and for the
clock a kernel of one's own (``tests/lab/vcan-run -k uml``).
"""

from __future__ import annotations

import ctypes
import fcntl
import os
import signal
import socket
import struct
import subprocess
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from tests.proof.drives import BRIDGE_SIDE, DRIVE_SIDE

_FRAME: Final = struct.Struct("=IB3x8s")
_DOWNLOAD: Final = struct.Struct("<BHBI")
_FOUR_BYTES, _TAKEN = 0x23, 0x60
"""Expedited SDO download, and its answer (CiA 301 §7.2.4.3.3)."""
_ANSWER_S: Final = 1.0
_BROADCAST: Final = struct.Struct("@3I4l2I0q")
"""struct bcm_msg_head of <linux/can/bcm.h>."""
_ERROR: Final = 0x2000_0000
_BUS_OFF: Final = _ERROR | 0x040
_RESTARTED: Final = _ERROR | 0x100
_GET_FLAGS, _SET_FLAGS = 0x8913, 0x8914
_IFF_UP: Final = 0x1
_IFREQ: Final = struct.Struct("16sH14x")
_SEIZE, _INTERRUPT, _DETACH = 0x4206, 0x4207, 17
_SYSCALL, _PEEK_USER = 24, 3
_TRACE_SYSCALLS: Final = 1
"""PTRACE_O_TRACESYSGOOD: stops at a system call have bit 7 in their signal."""
_AT_SYSCALL: Final = signal.SIGTRAP | 0x80
_NUMBER_AT: Final = 8 * 15
"""orig_rax of struct user_regs_struct."""
_SETITIMER: Final = 38
_WALL: Final = 0x4000_0000

_EVERYTHING: Final = struct.pack("=II", 0, 0)
_BUT_NMT: Final = struct.pack("=II", 0x2000_0000, 0x7FF)
"""So that an NMT command that is sent on the drives' side looks to the bridge like a drive's own reset."""
_NETLINK: Final = struct.Struct("=IHHII")
_NEW, _DELETE = 24, 25
_ACKNOWLEDGED: Final = 0x5
"""NLM_F_REQUEST | NLM_F_ACK."""
_CAN_TO_CAN: Final = struct.pack("=BBH", socket.AF_CAN, 1, 1)
"""struct rtcanmsg of <linux/can/gw.h>, with CGW_FLAGS_CAN_ECHO."""
_SOURCE, _DESTINATION, _FILTER = 9, 10, 11


def call(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise OSError(f"{' '.join(command)}: {done.stderr.strip() or done.returncode}")


def is_user_mode() -> bool:
    """A kernel of our own, whose clock is nobody else's."""
    return "User Mode Linux" in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")


class Gateway:
    """The wire between bridge and drives: jobs of the kernel's gateway (can-gw). They are given to it without
    a process of their own, which would take so long that a silence of some milliseconds loses every node."""

    def open(self) -> None:
        self.close()
        _gateway_job(_NEW, BRIDGE_SIDE, DRIVE_SIDE, _EVERYTHING)
        self.restore()

    def close(self) -> None:
        _gateway_job(_DELETE, "", "", b"")

    def silence_drives(self) -> None:
        _gateway_job(_DELETE, DRIVE_SIDE, BRIDGE_SIDE, _BUT_NMT)

    def restore(self) -> None:
        _gateway_job(_NEW, DRIVE_SIDE, BRIDGE_SIDE, _BUT_NMT)

    def pass_only(self, can_id: int) -> None:
        """Of what the drives' side sends."""
        self.silence_drives()
        _gateway_job(_NEW, DRIVE_SIDE, BRIDGE_SIDE, struct.pack("=II", can_id, 0x7FF))


def _gateway_job(what: int, source: str, destination: str, can_filter: bytes) -> None:
    """Raises ``OSError``. Without a source all jobs are meant."""
    ends = [(_SOURCE, source), (_DESTINATION, destination)]
    attributes = [
        (kind, struct.pack("=I", socket.if_nametoindex(name) if name else 0)) for kind, name in ends
    ]
    if can_filter:
        attributes.append((_FILTER, can_filter))
    body = _CAN_TO_CAN + b"".join(struct.pack("=HH", 4 + len(data), kind) + data for kind, data in attributes)
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, socket.NETLINK_ROUTE) as link:
        link.send(_NETLINK.pack(_NETLINK.size + len(body), what, _ACKNOWLEDGED, 1, 0) + body)
        (number,) = struct.unpack_from("=i", link.recv(4096), _NETLINK.size)
    if number:
        raise OSError(-number, f"can-gw: {os.strerror(-number)}")


def send(channel: str, can_id: int, data: bytes) -> float:
    """Send a frame; gives the time before it."""
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as raw:
        raw.bind((channel,))
        now = time.monotonic()
        raw.send(_FRAME.pack(can_id, len(data), data.ljust(8, b"\0")))
    return now


def download(channel: str, node_id: int, index: int, value: int) -> None:
    """Set a 32-bit object without subindices by SDO. Raises ``OSError`` where the node does not take it."""
    request = _DOWNLOAD.pack(_FOUR_BYTES, index, 0, value)
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as raw:
        answers = struct.pack("=II", 0x580 + node_id, 0x7FF)
        raw.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, answers)
        raw.settimeout(_ANSWER_S)
        raw.bind((channel,))
        raw.send(_FRAME.pack(0x600 + node_id, len(request), request))
        answer = bytes(8)
        while answer[1:4] != request[1:4]:  # what comes before that answers somebody else
            _, _, answer = _FRAME.unpack(raw.recv(_FRAME.size))
    if answer[0] != _TAKEN:
        raise OSError(f"node {node_id} does not take {index:04X}h = {value:X}h: {answer.hex(' ')}")


def repeat(channel: str, can_id: int, data: bytes, period_s: float) -> socket.socket:
    """The kernel sends a frame again and again, however busy the machine is, until the socket is closed."""
    beat = socket.socket(socket.AF_CAN, socket.SOCK_DGRAM, socket.CAN_BCM)
    beat.connect((channel,))
    flags = socket.CAN_BCM_SETTIMER | socket.CAN_BCM_STARTTIMER
    head = _BROADCAST.pack(socket.CAN_BCM_TX_SETUP, flags, 0, 0, 0, 0, int(period_s * 1e6), can_id, 1)
    beat.send(head + _FRAME.pack(can_id, len(data), data.ljust(8, b"\0")))
    return beat


def reset_nodes(node_id: int = 0) -> float:
    """NMT reset node, to all or to one: as if it were switched off and on. The bridge does not see it
    (``_BUT_NMT``). Gives the time before it."""
    return send(DRIVE_SIDE, 0x000, bytes((0x81, node_id)))


def bus_off() -> float:
    """The bridge's controller says bus-off, as a driver would."""
    return send(BRIDGE_SIDE, _BUS_OFF, bytes(8))


def bus_restarted() -> None:
    send(BRIDGE_SIDE, _RESTARTED, bytes(8))


def set_link(channel: str, *, up: bool) -> float:
    """``ip link set CHANNEL up`` or ``down``; gives the time from which it is."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        name = channel.encode()
        (_, flags) = _IFREQ.unpack(fcntl.ioctl(control, _GET_FLAGS, _IFREQ.pack(name, 0)))
        flags = flags | _IFF_UP if up else flags & ~_IFF_UP
        fcntl.ioctl(control, _SET_FLAGS, _IFREQ.pack(name, flags))
    return time.monotonic()


def cut_networks(addresses: Sequence[str]) -> None:
    """Packets from and to these addresses of loopback are dropped; connections stay open."""
    for address in addresses:
        call("ip", "route", "add", "blackhole", f"{address}/32", "table", "local")


def restore_networks(addresses: Sequence[str]) -> None:
    for address in addresses:
        with suppress(OSError):
            call("ip", "route", "del", "blackhole", f"{address}/32", "table", "local")


def step_clock(seconds: float) -> None:
    time.clock_settime(time.CLOCK_REALTIME, time.time() + seconds)


def _ptrace(request: int, thread: int, address: int = 0, data: int = 0) -> int:
    trace = ctypes.CDLL(None, use_errno=True).ptrace
    trace.restype = ctypes.c_long
    trace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
    ctypes.set_errno(0)
    result = int(trace(request, thread, address, data))
    if result < 0 and ctypes.get_errno():
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return result


def block_thread(thread: int, seconds: float) -> float:
    """Stop one thread of a child of ours, no other of its process. Gives the time from which it stands."""
    _ptrace(_SEIZE, thread)
    _ptrace(_INTERRUPT, thread)
    os.waitpid(thread, _WALL)
    now = time.monotonic()
    time.sleep(max(0.0, now + seconds - time.monotonic()))
    _ptrace(_DETACH, thread)
    return now


def block_at_timer(thread: int, seconds: float) -> float:
    """As ``block_thread``, just when it has set its interval timer: the bridge does that before it hands
    words to the kernel. Gives the time of that."""
    _ptrace(_SEIZE, thread, 0, _TRACE_SYSCALLS)
    _ptrace(_INTERRUPT, thread)
    seen = 0
    while seen < 2:  # the beginning of the call, and its end
        _, status = os.waitpid(thread, _WALL)
        number = os.WSTOPSIG(status)
        if number == _AT_SYSCALL:
            is_it = _ptrace(_PEEK_USER, thread, _NUMBER_AT) == _SETITIMER
            seen = seen + 1 if is_it else 0
        passed_on = 0 if number in (_AT_SYSCALL, signal.SIGTRAP) else number
        if seen < 2:
            _ptrace(_SYSCALL, thread, 0, passed_on)
    now = time.monotonic()
    time.sleep(seconds)
    _ptrace(_DETACH, thread)
    return now


class TinyDisk:
    """A file system of few megabytes that can be filled up."""

    def __init__(self, folder: Path, megabytes: int = 16) -> None:
        self.folder = folder
        self._ballast = folder / "ballast"
        folder.mkdir()
        call("mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", str(folder))

    def fill(self) -> None:
        with self._ballast.open("wb", buffering=0) as file, suppress(OSError):
            while file.write(bytes(1 << 16)):
                pass

    def empty(self) -> None:
        self._ballast.unlink(missing_ok=True)

    def close(self) -> None:
        call("umount", "-l", str(self.folder))
