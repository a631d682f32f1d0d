"""The only file that opens a CAN socket, and the kernel's other sides of one interface.

The constants are those of <linux/can.h> and <linux/can/raw.h>.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Collection
from typing import Final

from bridge.can.netlink import Link, look_at

_FILTER: Final = struct.Struct("=II")
_SOL_CAN_RAW: Final = 101
_CAN_RAW_FILTER: Final = 1
_CAN_RAW_ERR_FILTER: Final = 2
_CAN_ERR_MASK: Final = 0x1FFF_FFFF
_CAN_BCM: Final = 2
_MOST_FILTERS: Final = 512  # CAN_RAW_FILTER_MAX
_EXACT: Final = 0xC000_07FF  # identifier, no extended frames, no remote frames
_FUNCTION: Final = 0xC000_0780  # the same by function code, for more nodes than there are filters
_RECEIVE_BUFFER: Final = 1 << 20
_WATCH_BUFFER: Final = 1 << 18
# The kernel makes this its minimum, some six frames: what waits longer waits here, with its deadline.
_SEND_BUFFER: Final = 1


class CanSockets:
    """Opens the sockets of one interface. All methods raise OSError where the interface is not there."""

    def __init__(self, channel: str) -> None:
        self._channel = channel
        self._filters: bytes | None = None

    def link(self) -> Link:
        """The interface's own state. May wait for others (rtnl_lock): call it in a thread."""
        return look_at(self._channel)

    def raw(self) -> socket.socket:
        """A socket for single frames, with the filters that have been accepted so far."""
        raw = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        try:
            raw.setblocking(False)
            raw.setsockopt(_SOL_CAN_RAW, _CAN_RAW_ERR_FILTER, struct.pack("=I", _CAN_ERR_MASK))
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
            self._filter(raw)
            raw.bind((self._channel,))
        except OSError:
            raw.close()
            raise
        return raw

    def manager(self) -> socket.socket:
        """A socket of the broadcast manager."""
        manager = socket.socket(socket.AF_CAN, socket.SOCK_DGRAM, _CAN_BCM)
        try:
            manager.setblocking(False)
            manager.connect((self._channel,))
        except OSError:
            manager.close()
            raise
        return manager

    def watching(self, can_ids: Collection[int]) -> socket.socket:
        """A socket that only listens to these identifiers."""
        watching = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        try:
            watching.setblocking(False)
            watching.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _WATCH_BUFFER)
            self.let_in(can_ids, watching)
            watching.bind((self._channel,))
        except OSError:
            watching.close()
            raise
        return watching

    def accept(self, can_ids: list[int], raw: socket.socket | None) -> None:
        """Let only these identifiers in: on ``raw``, and on what is opened from now on."""
        self._filters = _filters(can_ids)
        if raw:
            self._filter(raw)

    def let_in(self, can_ids: Collection[int], watching: socket.socket) -> None:
        """Let only these identifiers in on this one."""
        watching.setsockopt(_SOL_CAN_RAW, _CAN_RAW_FILTER, _filters(can_ids))

    def _filter(self, raw: socket.socket) -> None:
        if self._filters is not None:
            raw.setsockopt(_SOL_CAN_RAW, _CAN_RAW_FILTER, self._filters)


def _filters(can_ids: Collection[int]) -> bytes:
    """Kernel filters for these identifiers, or for their function codes where that are too many."""
    wanted = {(can_id, _EXACT) for can_id in can_ids}
    if len(wanted) > _MOST_FILTERS:
        wanted = {(can_id & 0x780, _FUNCTION) for can_id in can_ids}
    return b"".join(_FILTER.pack(*pair) for pair in sorted(wanted))
