"""A CAN bus for figures where the kernel has no SocketCAN: a pair of Unix sockets.

It carries ``struct can_frame`` with the kernel's time stamps, so the code that receives is the one that
receives from SocketCAN, ours as well as python-can's; what CAN's own part of the kernel needs is missing
for both. It filters nothing and repeats nothing: bursts are sent by the process.
"""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Collection, Iterator

import can
from can.interfaces.socketcan import SocketcanBus

from bridge.can.cansockets import CanSockets
from bridge.can.netlink import Link
from bridge.can.socketcan import SocketCanBus

_SO_TIMESTAMPNS = 35


@contextlib.contextmanager
def wire() -> Iterator[tuple[socket.socket, socket.socket]]:
    """Both ends of a bus."""
    near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    with near, far:
        yield near, far


def named(end: socket.socket) -> str:
    """The end as a peer takes it as its argument."""
    return f"fd:{end.fileno()}"


class PairSockets(CanSockets):
    """One end in place of an interface."""

    def __init__(self, end: socket.socket) -> None:
        super().__init__("pair")
        self._end = end

    def raw(self) -> socket.socket:
        raw = self._end.dup()
        raw.setblocking(False)
        return raw

    def manager(self) -> socket.socket:
        """Nobody is behind it: the bus then sends the bursts itself."""
        manager, kernel = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        kernel.close()
        return manager

    def accept(self, can_ids: list[int], raw: socket.socket | None) -> None:
        """Everything is let in."""

    def watching(self, can_ids: Collection[int]) -> socket.socket:
        """Nothing comes here."""
        watching, nobody = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        nobody.close()
        watching.setblocking(False)
        return watching

    def let_in(self, can_ids: Collection[int], watching: socket.socket) -> None: ...

    def link(self) -> Link:
        return Link(is_up=True)


class PairBus(SocketCanBus):
    """Our SocketCAN bus on one end."""

    def __init__(self, end: socket.socket) -> None:
        super().__init__("can0", "pair", sockets=PairSockets(end))


class PairCan(SocketcanBus):
    """python-can's SocketCAN bus on one end."""

    def __init__(self, end: socket.socket) -> None:
        self.socket = end.dup()
        self.socket.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        self.channel = "pair"
        self.channel_info = "a pair of sockets"
        self._bcm_sockets = {}
        can.BusABC.__init__(self, channel="pair")

    def _apply_filters(self, filters: can.typechecking.CanFilters | None) -> None:
        self._is_filtered = True  # as where the kernel filters
