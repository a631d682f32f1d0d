"""CAN buses: SocketCAN, python-can's interfaces, and one in memory."""

from __future__ import annotations

from bridge.southbound.bus.interface import Bus


def open_bus(name: str, interface: str, channel: str, bitrate: int) -> Bus:
    """The bus behind ``interface``, not opened yet. ``virtual`` is made by whoever holds its wire."""
    if interface == "socketcan":
        from bridge.southbound.bus.socketcan import SocketCanBus

        return SocketCanBus(name, channel, bitrate)
    from bridge.southbound.bus.pythoncan import PythonCanBus

    return PythonCanBus(name, interface, channel, bitrate)
