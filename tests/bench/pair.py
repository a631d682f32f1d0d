"""A CAN bus for figures where the kernel has no SocketCAN: a pair of Unix sockets.

It carries ``struct can_frame`` with the kernel's time stamps, so the code that receives is the one that
receives from SocketCAN, ours as well as python-can's; what CAN's own part of the kernel needs is missing
for both. It filters nothing. Bursts are repeated by whoever is at the other end of ``wire``'s managers, as
the kernel's broadcast manager would; where nobody is, the process sends them itself.
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


@contextlib.contextmanager
def managers() -> Iterator[tuple[socket.socket, socket.socket]]:
    """A bridge's socket of the broadcast manager, and the one of who plays that."""
    near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with near, far:
        yield near, far


def named(end: socket.socket) -> str:
    """The end as a peer takes it as its argument."""
    return f"fd:{end.fileno()}"


class PairSockets(CanSockets):
    """One end in place of an interface."""

    def __init__(self, end: socket.socket, manager: socket.socket | None = None) -> None:
        super().__init__("pair")
        self._end = end
        self._manager = manager

    def raw(self) -> socket.socket:
        raw = self._end.dup()
        raw.setblocking(False)
        return raw

    def manager(self) -> socket.socket:
        """Without one, nobody is behind it: the bus then sends the bursts itself."""
        if self._manager:
            manager = self._manager.dup()
            manager.setblocking(False)
            return manager
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

    def __init__(self, end: socket.socket, manager: socket.socket | None = None) -> None:
        super().__init__("can0", "pair", sockets=PairSockets(end, manager))


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
