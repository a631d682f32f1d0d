"""A client of the ASCII gateway: one command at a time."""

from __future__ import annotations

import socket
import threading
from pathlib import Path
from typing import Final

_ERROR: Final = "ERROR:"
_LONGEST_S: Final = 70.0
"""Longer than the gateway keeps a command waiting."""


class GatewayError(Exception):
    """The gateway has answered with an error. ``code`` is an SDO abort code, or below 1000h its own; ``why``
    says what was asked for and what is in the way."""

    def __init__(self, code: int, why: str = "") -> None:
        said = f"{code:08X}h" if code >= 0x1000 else f"error {code}"
        super().__init__(f"{why} ({said})" if why else said)
        self.code = code
        self.why = why


class GatewayClient:
    """Raises OSError where the bridge is not there, is gone, or has clients enough."""

    def __init__(self, path: Path) -> None:
        self._lock = threading.Lock()
        self._sequence = 0
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(_LONGEST_S)
        try:
            self._socket.connect(str(path))
        except OSError:
            self._socket.close()
            raise
        self._answers = self._socket.makefile("rb")
        try:
            self.ask("info version")
        except OSError:
            self.close()
            raise

    def ask(self, command: str) -> str:
        """The answer to ``command``. Raises ``GatewayError``, and OSError."""
        with self._lock:
            self._sequence += 1
            begin = f"[{self._sequence}] "
            self._socket.sendall(f"{begin}{command}\r\n".encode())
            while True:
                line = self._answers.readline().decode("utf-8", "replace")
                if not line.endswith("\n"):
                    raise ConnectionError("the bridge has closed the connection")
                if line.startswith(begin):
                    break
        answer = line.removeprefix(begin).strip()
        if answer.startswith(_ERROR):
            code, _, why = answer.removeprefix(_ERROR).partition("#")
            raise GatewayError(int(code, 0), why.strip())
        return answer

    def close(self) -> None:
        self._answers.close()
        self._socket.close()
