"""Processes from an interpreter that has its imports behind it.

The lab starts hundreds of processes, and in a user-mode kernel the imports of each take longer than most of
what is tested. Here one interpreter imports everything, and forks for each of them (``warm_interpreter.py``):
from its first line on, each does what it would do anyway.
"""

from __future__ import annotations

import json
import os
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from tests.support import leaks, process
from tests.support.process import REPOSITORY, Child, start_cold

_MODULES: Final = ("bridge", "asyncua", "canopen", "pymodbus.client", "zenoh")


class WarmProcess:
    """Stand-in for ``subprocess.Popen``. ``ended`` is where its exit status is told."""

    def __init__(self, command: Sequence[str], pid: int, ended: int) -> None:
        self.pid = pid
        self.returncode: int | None = None
        self._command = command
        self._ended = ended

    def poll(self) -> int | None:
        if self.returncode is None and select.select([self._ended], [], [], 0)[0]:
            self._read()
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        if self.returncode is None:
            if not select.select([self._ended], [], [], timeout)[0]:
                raise subprocess.TimeoutExpired(self._command, timeout or 0.0)
            self._read()
        assert self.returncode is not None
        return self.returncode

    def kill(self) -> None:
        if self.poll() is None:
            os.kill(self.pid, signal.SIGKILL)

    def _read(self) -> None:
        self.returncode = int(os.read(self._ended, 16))
        os.close(self._ended)


class _Interpreter:
    def __init__(self, channel: socket.socket) -> None:
        self._channel = channel

    def start(
        self,
        command: Sequence[str],
        output: int,
        error: int,
        environment: Mapping[str, str],
        folder: Path,
        files: Sequence[int] = (),
    ) -> Child:
        if command[0] != sys.executable or command[1] == "-c":
            return start_cold(command, output, error, environment, folder, files)
        asked = {
            "arguments": list(command[1:]),
            "env": dict(environment),
            "cwd": str(folder),
            "files": list(files),
        }
        ended, tell = os.pipe()
        socket.send_fds(self._channel, [json.dumps(asked).encode()], [output, error, tell, *files])
        os.close(tell)
        return WarmProcess(command, int(self._channel.recv(16)), ended)


@contextmanager
def warm_interpreter() -> Iterator[None]:
    """Let one interpreter start every Python process of ``process`` meanwhile."""
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    script = str(REPOSITORY / "tests" / "support" / "warm_interpreter.py")
    command = [sys.executable, script, str(its.fileno()), *_MODULES]
    with ours, subprocess.Popen(command, pass_fds=[its.fileno()], cwd="/", process_group=0) as interpreter:
        its.close()
        assert ours.recv(16) == b"ready"
        leaks.STARTERS.add(interpreter.pid)
        with process.started_by(_Interpreter(ours).start):
            yield
        leaks.STARTERS.remove(interpreter.pid)
        ours.shutdown(socket.SHUT_RDWR)
        interpreter.wait(30.0)
