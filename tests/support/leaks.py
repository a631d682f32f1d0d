"""Leftovers that fail a test: tasks, threads, child processes and sockets.

Two fixtures that every test has, one of them for its module: what the module's own fixtures hold is there
before each of its tests, and has to be gone after the last.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import threading
import time
from asyncio import runners
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pytest

PATIENCE_S: Final = 3.0
"""Time in seconds within which that ends which was told to."""
_WORKERS: Final = ("thread asyncio_", "thread password_")
"""Threads that a loop or a server starts when it first needs them, and ends with itself: that of a module may
have them after one of its tests."""
_LOOP_OF_MODULE: Final = "_module_scoped_runner"
"""Fixture of pytest-asyncio."""

STARTERS: Final[set[int]] = set()
"""Processes that start others for the tests: these count, too."""


@dataclass(frozen=True, slots=True)
class Held:
    """Resources that this process holds now. Sockets are told apart by their inode, and have their file
    descriptor."""

    threads: frozenset[threading.Thread]
    children: frozenset[int]
    sockets: dict[str, int]

    @classmethod
    def now(cls) -> Held:
        # A dummy stands for a thread of a library that was seen in Python once, and stays when it has ended.
        alive = {one for one in threading.enumerate() if not isinstance(one, threading._DummyThread)}
        return cls(frozenset(alive), frozenset(_children()), _sockets())

    def since(self, before: Held) -> list[str]:
        """Resources that are new since ``before``, in words."""
        threads = [f"thread {one.name}" for one in self.threads - before.threads]
        children = [f"process {_command(pid)}" for pid in self.children - before.children]
        opened = self.sockets.keys() - before.sockets.keys()
        return threads + children + [_named(self.sockets[inode]) for inode in opened]


def _children() -> Iterator[int]:
    try:
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:  # it has none, as most tests
        return
    parents = {str(pid) for pid in (os.getpid(), *STARTERS)}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has just ended
            _, parent = path.read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()[:2]
            if parent in parents:
                yield int(path.parent.name)


def _command(pid: int) -> str:
    with contextlib.suppress(OSError):
        command = Path(f"/proc/{pid}/cmdline").read_text(encoding="utf-8", errors="replace")
        return f"{pid}: {' '.join(command.split(chr(0)))[-200:] or 'has ended, and nobody has waited for it'}"
    return str(pid)


def _sockets() -> dict[str, int]:
    found: dict[str, int] = {}
    for number in os.listdir("/proc/self/fd"):  # noqa: PTH208 - each test does it twice
        with contextlib.suppress(OSError):
            link = os.readlink(f"/proc/self/fd/{number}")  # noqa: PTH115
            if link.startswith("socket:"):
                found[link] = int(number)
    return found


def _named(number: int) -> str:
    try:
        with socket.socket(fileno=os.dup(number)) as copy:
            return f"socket {number}: {copy.family.name} {copy.getsockname()}"
    except OSError as error:
        return f"socket {number}: {error}"


# tasks

_unended: list[str] = []
"""Tasks that were there when their loop came to its end, which cancels them."""
_cancel_all_tasks = runners._cancel_all_tasks  # pyright: ignore[reportPrivateUsage]


def _note_and_cancel(loop: asyncio.AbstractEventLoop) -> None:
    end = time.monotonic() + PATIENCE_S
    while (left := _pending(loop)) and time.monotonic() < end:
        loop.run_until_complete(asyncio.sleep(0.01))
    _unended.extend(f"task {task.get_name()}: {task.get_coro()}" for task in left)
    _cancel_all_tasks(loop)


def _pending(loop: asyncio.AbstractEventLoop) -> list[asyncio.Task[Any]]:
    return [task for task in asyncio.all_tasks(loop) if not task.cancelling()]


runners._cancel_all_tasks = _note_and_cancel  # pyright: ignore[reportPrivateUsage]


# the fixtures


def _check(before: Held, besides: tuple[str, ...] = (), loop: asyncio.Runner | None = None) -> None:
    end = time.monotonic() + PATIENCE_S
    while left := [one for one in Held.now().since(before) if not one.startswith(besides)]:
        if time.monotonic() > end:
            break
        if loop:
            loop.run(asyncio.sleep(0.01))
        else:
            time.sleep(0.01)
    left += _unended
    _unended.clear()
    if left:
        pytest.fail("it leaves behind: " + "; ".join(left), pytrace=False)


@pytest.fixture(autouse=True)
def leaves_nothing(request: pytest.FixtureRequest) -> Iterator[None]:
    # The loop of a module goes on to its next test, and only there would a connection be closed.
    loop = request.getfixturevalue(_LOOP_OF_MODULE) if _LOOP_OF_MODULE in request.fixturenames else None
    before = Held.now()
    yield
    _check(before, _WORKERS, loop)


@pytest.fixture(autouse=True, scope="module")
def module_leaves_nothing() -> Iterator[None]:
    before = Held.now()
    yield
    _check(before)
