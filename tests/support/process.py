"""drivebridge as its user runs it: as processes, told to be ready by sd_notify, ended with the test."""

from __future__ import annotations

import contextlib
import fcntl
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Protocol

START_LIMIT_S = 60.0
REPOSITORY = Path(__file__).resolve().parents[2]


def free_port() -> int:
    """A port of loopback that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Child(Protocol):
    """Part of ``subprocess.Popen`` that is used."""

    @property
    def pid(self) -> int: ...
    @property
    def returncode(self) -> int | None: ...
    def poll(self) -> int | None: ...
    def wait(self, timeout: float | None = None) -> int: ...
    def kill(self) -> None: ...


class Start(Protocol):
    def __call__(
        self,
        command: Sequence[str],
        output: int,
        error: int,
        environment: Mapping[str, str],
        folder: Path,
        files: Sequence[int] = (),
    ) -> Child: ...


def start_cold(
    command: Sequence[str],
    output: int,
    error: int,
    environment: Mapping[str, str],
    folder: Path,
    files: Sequence[int] = (),
) -> Child:
    return subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=output,
        stderr=error,
        env=environment,
        cwd=folder,
        pass_fds=files,
        # Leads a process group, as what a terminal starts does.
        process_group=0,
    )


_start: Start = start_cold


@contextmanager
def started_by(start: Start) -> Iterator[None]:
    """Replace the function that starts processes meanwhile."""
    global _start
    before, _start = _start, start
    try:
        yield
    finally:
        _start = before


class Process:
    """A running command; its output is in ``log``."""

    def __init__(
        self, command: Sequence[str], log: Path, notify: socket.socket | None, files: Sequence[int] = ()
    ) -> None:
        self.log = log
        self._notify = notify
        environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
        environment.pop("NOTIFY_SOCKET", None)
        if notify:
            environment["NOTIFY_SOCKET"] = notify.getsockname()
        with log.open("wb") as output:
            to = output.fileno()
            # A folder that is not the repository: nothing may be found by accident.
            self.popen = _start(command, to, to, environment, log.parent, files)

    @property
    def pid(self) -> int:
        return self.popen.pid

    def prefer(self) -> None:
        """Let it run before all others, as the systemd unit does, where that is allowed."""
        with contextlib.suppress(OSError):
            os.sched_setscheduler(self.pid, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(10))

    def output(self) -> str:
        return self.log.read_text(encoding="utf-8", errors="replace")

    def wait_ready(self, limit_s: float = START_LIMIT_S) -> None:
        """Until the process says READY=1."""
        assert self._notify is not None
        self._notify.settimeout(0.2)
        end = time.monotonic() + limit_s
        while time.monotonic() < end:
            assert self.popen.poll() is None, f"ended with {self.popen.returncode}:\n{self.output()}"
            with contextlib.suppress(TimeoutError):
                if b"READY=1" in self._notify.recv(4096):
                    return
        raise AssertionError(f"not ready within {limit_s} s:\n{self.output()}")

    def wait_output(self, text: str, limit_s: float = START_LIMIT_S) -> None:
        end = time.monotonic() + limit_s
        while text not in self.output():
            assert self.popen.poll() is None, f"ended with {self.popen.returncode}:\n{self.output()}"
            assert time.monotonic() < end, f"no {text!r} within {limit_s} s:\n{self.output()}"
            time.sleep(0.05)

    def signal(self, number: int) -> None:
        os.kill(self.pid, number)

    def stop(self) -> None:
        if self.popen.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                self.signal(signal.SIGCONT)
                self.signal(signal.SIGTERM)
            try:
                self.popen.wait(15)
            except subprocess.TimeoutExpired:
                self.popen.kill()
                self.popen.wait()


@contextmanager
def running(
    folder: Path, name: str, *command: str, notify: bool = False, files: Sequence[int] = ()
) -> Iterator[Process]:
    """Run ``command`` with its output in ``folder``; with ``notify``, ``wait_ready`` can be used. It gets
    the open ``files`` under the same numbers."""
    with contextlib.ExitStack() as stack:
        listener = None
        if notify:
            listener = stack.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM))
            listener.bind(f"\0drivebridge-test-{os.getpid()}-{name}-{time.monotonic_ns()}")
            # getsockname gives the abstract name as bytes; systemd writes it with an @.
        named = _Named(listener) if listener else None
        process = Process(list(command), folder / f"{name}.log", named, files)
        stack.callback(process.stop)
        yield process


class _Named:
    """A listening socket whose name is written as systemd writes it."""

    def __init__(self, listener: socket.socket) -> None:
        self._listener = listener
        self.settimeout = listener.settimeout
        self.recv = listener.recv

    def getsockname(self) -> str:
        return "@" + self._listener.getsockname()[1:].decode()


def drivebridge(
    folder: Path, name: str, *arguments: str, notify: bool = False
) -> AbstractContextManager[Process]:
    """``drivebridge ARGUMENTS``, as this Python has it installed."""
    return running(folder, name, sys.executable, "-m", "bridge", *arguments, notify=notify)


@contextmanager
def only_demo() -> Iterator[None]:
    """The demo's ports are fixed: of all tests that start it, in whichever process, one at a time."""
    with (Path(tempfile.gettempdir()) / "drivebridge-tests-demo.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def peer(
    folder: Path, name: str, *arguments: str, files: Sequence[int] = ()
) -> AbstractContextManager[Process]:
    """A script of ``tests/peers``: a client of the bridge in a process of its own."""
    script = REPOSITORY / "tests" / "peers" / f"{name}.py"
    return running(folder, name, sys.executable, str(script), *arguments, files=files)


def called(*arguments: str, limit_s: float = 100.0) -> subprocess.CompletedProcess[str]:
    """``python ARGUMENTS``, when it has ended."""
    command = [sys.executable, *arguments]
    with tempfile.TemporaryFile() as output, tempfile.TemporaryFile() as error:
        child = _start(command, output.fileno(), error.fileno(), os.environ, Path("/"))
        try:
            status = child.wait(limit_s)
        finally:
            child.kill()
            child.wait()
        told: list[str] = []
        for file in (output, error):
            file.seek(0)
            told.append(file.read().decode())
    return subprocess.CompletedProcess(command, status, *told)


def drivebridge_called(*arguments: str) -> subprocess.CompletedProcess[str]:
    """``drivebridge ARGUMENTS``, when it has ended."""
    return called("-m", "bridge", *arguments)


def peer_called(name: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A script of ``tests/peers``, when it has ended."""
    return called(str(REPOSITORY / "tests" / "peers" / f"{name}.py"), *arguments)


def catches(pid: int, number: signal.Signals) -> bool:
    """The process has a handler for the signal (SigCgt, proc_pid_status(5))."""
    [mask] = [line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if "SigCgt" in line]
    return bool(int(mask.split()[1], 16) >> (number - 1) & 1)


def until(condition: object, limit_s: float, what: str, pause_s: float = 0.02) -> None:
    """Wait until ``condition()`` is true; fails with ``what`` after ``limit_s``."""
    assert callable(condition)
    end = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < end, f"not within {limit_s} s: {what}"
        time.sleep(pause_s)
