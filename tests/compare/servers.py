"""The three servers, each in a process of its own."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Final

from tests.compare.space import as_json
from tests.support.process import REPOSITORY

OURS, OPEN62541, NODE_OPCUA = "ours", "open62541", "node-opcua"
NAMES: Final = (OURS, OPEN62541, NODE_OPCUA)
NODE_FOLDER: Final = REPOSITORY / "tests" / "wire" / "node"

_MOST_AGE_S: Final = 8 * 60.0
"""o6 ends its process after ten minutes."""
_START_S: Final = 60.0
_END_S: Final = 2.0
_TRIES: Final = 3
_PORT_TAKEN: Final = "EADDRINUSE"


def missing() -> str | None:
    """What has to be installed first, None where all is there."""
    if shutil.which("node") is None or not (NODE_FOLDER / "node_modules" / "node-opcua-server").is_dir():
        return f"node-opcua's server is not there: `make clients`, or `npm install` in {NODE_FOLDER}"
    return None


class Servers:
    """``ports`` by the servers' names. To be left with ``close``."""

    def __init__(self) -> None:
        self._home = tempfile.TemporaryDirectory(prefix="drivebridge-compare-")
        self._processes: dict[str, subprocess.Popen[str]] = {}
        self._began = 0.0
        self.ports: dict[str, int] = {}
        try:
            for name in NAMES:
                self._start(name)
            for name in NAMES:
                self._await(name)
        except BaseException:
            self.close()
            raise

    def refresh(self) -> None:
        """Start anew what has ended, and open62541 before it ends itself. To be called between two cases."""
        for name, process in list(self._processes.items()):
            is_old = name == OPEN62541 and time.monotonic() - self._began > _MOST_AGE_S
            if is_old or process.poll() is not None:
                process.kill()
                process.wait()
                self._start(name)
                self._await(name)

    def await_end(self, name: str) -> None:
        """It has closed a connection: if that was the end of its process, it is over a moment later."""
        with suppress(subprocess.TimeoutExpired):
            self._processes[name].wait(_END_S)

    def _start(self, name: str) -> None:
        python = [sys.executable, "-m"]
        if name == OURS:
            command, said = [*python, "tests.compare.our_server"], ""
        elif name == OPEN62541:
            command, said = [*python, "tests.compare.open62541_server", str(_free_port())], ""
            self._began = time.monotonic()
        else:
            command, said = ["node", str(NODE_FOLDER / "server.mjs"), str(_free_port())], as_json()
        environment = os.environ | {"HOME": self._home.name, "PYTHONPATH": str(REPOSITORY)}
        process = subprocess.Popen(
            command,
            cwd=REPOSITORY,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=(Path(self._home.name) / f"{name}.log").open("w"),
            text=True,
        )
        assert process.stdin
        process.stdin.write(said)
        process.stdin.close()
        self._processes[name] = process

    def _await(self, name: str) -> None:
        for _ in range(_TRIES):
            if self._is_up(name):
                return
            log = (Path(self._home.name) / f"{name}.log").read_text()
            if _PORT_TAKEN not in log:
                break
            # Between the choice of a port and its use somebody else may take it.
            self._processes[name].wait()
            self._start(name)
        raise RuntimeError(f"{name} does not start: {log[-2000:]}")

    def _is_up(self, name: str) -> bool:
        out = self._processes[name].stdout
        assert out
        until = time.monotonic() + _START_S
        while time.monotonic() < until:
            line = out.readline()
            if line.startswith("port "):
                self.ports[name] = int(line.split()[1])
                return True
            if not line:
                return False
        return False

    def close(self) -> None:
        for process in self._processes.values():
            process.kill()
            process.wait()
            if process.stdout:
                process.stdout.close()
        with suppress(OSError):
            self._home.cleanup()


def _free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])
