"""Run lanes of make targets side by side: ``make test``.

    python -m tools.side_by_side MAKE "TARGET ..." "TARGET ..."

The targets of a lane run one after the other. The first lane measures times; its output is shown as it comes.
The second gets what the first leaves of the CPUs; its output comes after that of the first. When a lane
fails, or this process is told to end, all that runs is ended.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Final

_PATIENCE_S: Final = 30.0
"""Tests may take so long to end what they have started."""


def begin(
    make: str, targets: str, output: IO[bytes] | None = None, *, behind: bool = False
) -> subprocess.Popen[bytes]:
    """A lane is a session of its own: so we find all of it, and only we end it."""
    return subprocess.Popen(
        [make, "--no-print-directory", *targets.split()],
        stdin=subprocess.DEVNULL,
        stdout=output,
        stderr=output,
        start_new_session=True,
        preexec_fn=give_way if behind else None,
    )


def give_way() -> None:
    """Where the kernel divides the CPUs among sessions (sched(7), autogroup), ``nice`` counts within one of
    them alone. The lab's user-mode kernels are sessions of their own."""
    os.nice(19)
    with contextlib.suppress(OSError):
        Path("/proc/self/autogroup").write_text("19", encoding="ascii")


def end(lanes: Sequence[subprocess.Popen[bytes]]) -> None:
    """As Ctrl-C ends what still runs, and then whatever is left of its session."""
    running = {lane.pid: lane for lane in lanes if lane.poll() is None}
    for pid in running:
        os.killpg(pid, signal.SIGINT)
    try:
        for lane in running.values():
            with contextlib.suppress(subprocess.TimeoutExpired):
                lane.wait(_PATIENCE_S)
    finally:
        for pid in [int(path.name) for path in Path("/proc").glob("[0-9]*")] if running else []:
            with contextlib.suppress(ProcessLookupError):
                if os.getsid(pid) in running:
                    os.kill(pid, signal.SIGKILL)


def main() -> int:
    make, first, second = sys.argv[1:]
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    # In the background a shell has it ignored, by all that is started from there.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with tempfile.NamedTemporaryFile() as told, Path(told.name).open("rb") as kept:
        lanes = [begin(make, first), begin(make, second, told, behind=True)]
        try:
            while not any(status := [lane.poll() for lane in lanes]) and None in status:
                if status[0] == 0:
                    shutil.copyfileobj(kept, sys.stdout.buffer)
                    sys.stdout.flush()
                time.sleep(0.2)
        finally:
            end(lanes)
            shutil.copyfileobj(kept, sys.stdout.buffer)
            sys.stdout.flush()
    return int(any(status))


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        sys.exit(main())
    sys.exit(130)
