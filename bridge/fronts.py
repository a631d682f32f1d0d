"""Looks after the front processes: starts them, restarts those that end, stops them.

A front is heavy and may crash; it holds nothing up. It is a child of the bus process, with a lower
priority, and dies with it.
"""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import logging
import os
import signal
import sys
import time
from collections.abc import Sequence
from typing import Final

_log = logging.getLogger(__name__)

_FIRST_PAUSE_S: Final = 0.2
_LAST_PAUSE_S: Final = 10.0
_STABLE_S: Final = 30.0
_STOP_S: Final = 3.0
_NICE: Final = 5
_PR_SET_PDEATHSIG: Final = 1


class Front:
    """One front process: ``python -m bridge`` with ``arguments`` and our process id."""

    def __init__(self, role: str, arguments: Sequence[str]) -> None:
        self.role = role
        self.restarts = 0
        self._arguments = list(arguments)
        self._process: asyncio.subprocess.Process | None = None

    @property
    def pid(self) -> int | None:
        return self._process.pid if self._process else None

    async def run(self) -> None:
        """Keep the front running until cancelled; back-off where it does not stay up."""
        pause_s = _FIRST_PAUSE_S
        try:
            while True:
                started = time.monotonic()
                code = await self._run_once()
                if time.monotonic() - started > _STABLE_S:
                    pause_s = _FIRST_PAUSE_S
                _log.error(
                    "the %s front ended (%s); it is started again in %.1f s", self.role, _how(code), pause_s
                )
                await asyncio.sleep(pause_s)
                pause_s = min(pause_s * 2, _LAST_PAUSE_S)
                self.restarts += 1
        finally:
            await self._stop()

    async def _run_once(self) -> int:
        self._process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-m",
            "bridge",
            *self._arguments,
            "--parent",
            str(os.getpid()),
            stdin=asyncio.subprocess.DEVNULL,
            # The bus process alone talks to systemd's watchdog.
            env={k: v for k, v in os.environ.items() if k not in ("NOTIFY_SOCKET", "WATCHDOG_USEC")},
        )
        return await self._process.wait()

    async def _stop(self) -> None:
        process = self._process
        if process is None or process.returncode is not None:
            return
        with contextlib.suppress(ProcessLookupError):
            process.terminate()
        try:
            await asyncio.wait_for(process.wait(), _STOP_S)
        except TimeoutError:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()


def become_front(parent: int) -> None:
    """Called by a front about itself: less important than the bus process, and not to outlive it."""
    with contextlib.suppress(OSError):
        os.nice(_NICE)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
        if parent and os.getppid() != parent:  # it died before we asked
            raise SystemExit(0)


def _how(code: int) -> str:
    if code < 0:
        with contextlib.suppress(ValueError):
            return signal.Signals(-code).name
    return f"exit status {code}"
