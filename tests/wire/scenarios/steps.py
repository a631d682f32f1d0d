"""Steps of a scenario, one JSON line each on the standard output of the client's own process."""

from __future__ import annotations

import json
import socket
from pathlib import Path


class Steps:
    """``letter`` is the client's own part of the plant: nodes a1 and a2 on can0, or b1 and b2 on can1.
    ``folder`` has the certificates, ``url`` is the server's, ``commands`` the port by which things break."""

    def __init__(self, letter: str, folder: str, url: str, commands: str) -> None:
        self.first, self.second = f"{letter}1", f"{letter}2"
        self.bus = f"can{ord(letter) - ord('a')}"
        self.folder, self.url = Path(folder), url
        self._commands = int(commands)
        self._names: set[str] = set()

    def step(self, name: str, got: object, expected: object) -> None:
        """Fails where the server has not answered exactly what is expected."""
        assert name not in self._names, f"two steps are called {name}"
        self._names.add(name)
        assert got == expected, f"{name}: {got!r} instead of {expected!r}"
        self.say(step=name)

    def say(self, **what: object) -> None:
        print(json.dumps(what), flush=True)

    def break_plant(self, *words: str) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            out.sendto(" ".join(words).encode(), ("127.0.0.1", self._commands))
