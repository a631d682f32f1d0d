"""Tells systemd our state (sd_notify(3)): ready, status, watchdog, stopping. Without systemd, nothing."""

from __future__ import annotations

import os
import socket


class Notifier:
    """The socket that systemd gave us, if it did."""

    def __init__(self) -> None:
        address = os.environ.get("NOTIFY_SOCKET", "")
        self._socket: socket.socket | None = None
        if address and hasattr(socket, "AF_UNIX"):
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            self._socket.setblocking(False)
            # A leading @ stands for the NUL byte of the abstract name space.
            self._address = "\0" + address[1:] if address.startswith("@") else address
        microseconds = int(os.environ.get("WATCHDOG_USEC", "0") or 0)
        for_us = os.environ.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
        self._watchdog_period_s = microseconds / 1e6 / 3 if microseconds and for_us else 0.0
        self._next_sign = 0.0

    def ready(self, status: str) -> None:
        self._send(f"READY=1\nSTATUS={status}")

    def status(self, status: str) -> None:
        self._send(f"STATUS={status}")

    def stopping(self) -> None:
        self._send("STOPPING=1")

    def alive(self, now: float) -> None:
        """A sign for systemd's watchdog, three times per watchdog period. ``now`` is monotonic."""
        if self._watchdog_period_s and now >= self._next_sign:
            self._next_sign = now + self._watchdog_period_s
            self._send("WATCHDOG=1")

    def _send(self, message: str) -> None:
        if self._socket is None:
            return
        try:
            self._socket.sendto(message.encode("utf-8", "replace"), self._address)
        except OSError:
            # systemd that does not listen is no reason to stop driving.
            return
