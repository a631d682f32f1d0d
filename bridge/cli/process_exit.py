"""The last moment of a process. Nothing heavy is imported here."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from typing import Final, NoReturn

_FAILED: Final = 1
_INTERRUPTED: Final = 130
"""128 and the number of SIGINT, as shells have it."""


def leave_after(work: Callable[[], None]) -> NoReturn:
    """Run ``work`` and end the process, with its exit status. Ctrl-C ends it without a traceback."""
    try:
        work()
    except SystemExit as ending:
        _leave(ending.code)
    except KeyboardInterrupt:
        _leave(_INTERRUPTED)
    except Exception as error:  # noqa: BLE001 - it is told as the interpreter would
        sys.excepthook(type(error), error, error.__traceback__)
        _leave(_FAILED)
    _leave(0)


def _leave(code: str | int | None) -> NoReturn:
    """Ends without finalising the interpreter if a thread is stuck inside a library: when that thread wakes
    up in a finalised interpreter, the library can only abort the process."""
    if isinstance(code, str):
        print(code, file=sys.stderr)
        code = _FAILED
    if any(thread.daemon for thread in threading.enumerate()):
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(code or 0)
    raise SystemExit(code)
