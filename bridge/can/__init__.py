"""CAN buses: SocketCAN, python-can's interfaces, and one in memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from bridge.base.errors import Unavailable
from bridge.can.interface import Bus


def open_bus(name: str, interface: str, channel: str, bitrate: int, *, at_least: int = 0) -> Bus:
    """The bus behind ``interface``, not opened yet. ``virtual`` is made by whoever holds its wire. On
    SocketCAN one slower than ``at_least`` (bit/s), which is assumed as nobody said it, is not opened."""
    if interface == "socketcan":
        from bridge.can.socketcan import SocketCanBus

        return SocketCanBus(name, channel, bitrate, at_least=at_least)
    from bridge.can.pythoncan import PythonCanBus

    return PythonCanBus(name, interface, channel, bitrate)


def open_all(opening: Iterable[Callable[[], None]]) -> None:
    """Do all of ``opening``, each of which opens a bus. Raises one ``Unavailable`` that has a line for every
    bus that cannot be opened; the others are open then."""
    failures: list[str] = []
    for open_one in opening:
        try:
            open_one()
        except Unavailable as error:
            failures.append(str(error))
    if failures:
        raise Unavailable("\n".join(failures))
