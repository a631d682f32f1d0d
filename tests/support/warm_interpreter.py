"""An interpreter that has its imports behind it, and becomes whatever is asked for: see ``warm.py``.

warm_interpreter.py SOCKET MODULE …

SOCKET is a file descriptor. Each message has what is to be run, and file descriptors: standard output and
error, the one that the exit status is told to, and those that the process is to have.
"""

from __future__ import annotations

import contextlib
import fcntl
import gc
import io
import json
import os
import pkgutil
import runpy
import select
import signal
import socket
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Any, Final

_MOST_FILES: Final = 16
_ABOVE: Final = 512
"""No process that is tested has so many files before it has begun."""


def load(names: Sequence[str]) -> None:
    """Import these modules, and all that packages of ours have."""
    for name in names:
        module = import_module(name)
        if name != "bridge":
            continue
        for found in pkgutil.walk_packages(module.__path__, f"{name}."):
            if not found.name.endswith("__main__"):
                import_module(found.name)
    gc.collect()
    # What nobody looks at is not copied.
    gc.freeze()


def serve(channel: socket.socket) -> tuple[dict[str, Any], list[int]]:
    """Fork for each message. Comes back in the new process; in this one at the end, which has no message."""
    running: dict[int, tuple[int, int]] = {}
    poll = select.poll()
    poll.register(channel, select.POLLIN)
    while True:
        for ready, _ in poll.poll():
            if ready in running:
                poll.unregister(ready)
                os.close(ready)
                _tell_end(*running.pop(ready))
                continue
            message, files, _, _ = socket.recv_fds(channel, 1 << 20, _MOST_FILES)
            if not message:
                sys.exit(0)
            pid = os.fork()
            if not pid:
                return json.loads(message), files
            ended = os.pidfd_open(pid)
            running[ended] = pid, files.pop(2)
            poll.register(ended, select.POLLIN)
            for number in files:
                os.close(number)
            channel.send(str(pid).encode())


def _tell_end(pid: int, tell: int) -> None:
    _, status = os.waitpid(pid, 0)
    with contextlib.suppress(BrokenPipeError):  # nobody asks any more
        os.write(tell, str(os.waitstatus_to_exitcode(status)).encode())
    os.close(tell)


def become(asked: dict[str, Any], files: list[int]) -> None:
    """Become a process that ``python`` has just started with these arguments."""
    os.setpgid(0, 0)
    output, error, _, *others = files
    _have(dict(zip((1, 2, *asked["files"]), (output, error, *others), strict=True)))
    os.chdir(asked["cwd"])
    os.environ.clear()
    os.environ.update(asked["env"])
    sys.stdout = io.TextIOWrapper(io.FileIO(1, "w", closefd=False), write_through=True)
    sys.stderr = io.TextIOWrapper(
        io.FileIO(2, "w", closefd=False), errors="backslashreplace", write_through=True
    )
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.argv = asked["arguments"]
    if sys.argv[0] == "-m":
        del sys.argv[0]
        sys.path[0] = asked["cwd"]
        runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
    else:
        sys.path[0] = os.path.dirname(sys.argv[0])  # noqa: PTH120
        runpy.run_path(sys.argv[0], run_name="__main__")


def _have(wanted: dict[int, int]) -> None:
    """These files under these numbers, standard input empty, and no others."""
    aside = {number: fcntl.fcntl(file, fcntl.F_DUPFD, _ABOVE) for number, file in wanted.items()}
    os.closerange(3, _ABOVE)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    for number, file in aside.items():
        os.dup2(file, number)
    os.closerange(_ABOVE, _ABOVE + len(aside))


if __name__ == "__main__":
    load(sys.argv[2:])
    with socket.socket(fileno=int(sys.argv[1])) as asking:
        asking.send(b"ready")
        task = serve(asking)
        asking.detach()
    become(*task)
