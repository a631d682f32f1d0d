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

from bridge.errors import BridgeError, OperationFailed

_log = logging.getLogger(__name__)

SIGN_PERIOD_S: Final = 1.0
_SILENT_LOOKS: Final = 5
_USERS_FAULT: Final = (2, 3)
"""Exit codes of what the user has to mend: a file, a port (``bridge.errors``)."""
_FIRST_PAUSE_S: Final = 0.2
_LAST_PAUSE_S: Final = 10.0
_LOG_PAUSE_S: Final = 60.0
_STABLE_S: Final = 30.0
_STOP_S: Final = 3.0
_NICE: Final = 5
_PR_SET_PDEATHSIG: Final = 1


class FrontRefused(BridgeError):
    """A front has never come up, and trying again does not help. It has told why itself."""

    def __init__(self, exit_code: int) -> None:
        super().__init__("")
        self.exit_code = exit_code


class Front:
    """One front process: ``python -m bridge`` with ``arguments`` and our process id.

    A ``watched`` one is given a pipe (``--signs``) on which it shows that its event loop runs.
    """

    def __init__(self, role: str, arguments: Sequence[str], *, watched: bool = False) -> None:
        self.role = role
        self.restarts = 0
        self._arguments = list(arguments)
        self._watched = watched
        self._has_lived = False
        self._logged_at = float("-inf")
        self._process: asyncio.subprocess.Process | None = None

    @property
    def pid(self) -> int | None:
        return self._process.pid if self._process else None

    async def run(self) -> None:
        """Keep the front running until cancelled; back-off where it does not stay up.

        Raises ``FrontRefused`` where the first one ends with a fault of the site file or a port, before
        it has given a sign of life: the user has to mend that.
        """
        pause_s = _FIRST_PAUSE_S
        try:
            while True:
                started = time.monotonic()
                how = await self._run_once()
                if time.monotonic() - started > _STABLE_S:
                    pause_s = _FIRST_PAUSE_S
                self._tell(how, pause_s)
                await asyncio.sleep(pause_s)
                pause_s = min(pause_s * 2, _LAST_PAUSE_S)
                self.restarts += 1
        finally:
            await self._stop()

    def _tell(self, how: str, pause_s: float) -> None:
        """At most once a minute: one that never comes up must not fill a disk."""
        now = time.monotonic()
        if now - self._logged_at >= _LOG_PAUSE_S:
            self._logged_at = now
            _log.error("the %s front %s; it is started again in %.1f s", self.role, how, pause_s)

    async def _run_once(self) -> str:
        """Run it until it ends; how that was, as the end of a sentence."""
        try:
            ear = _Ear() if self._watched else None
        except OSError as error:
            return f"cannot be started: {error}"
        try:
            try:
                process = self._process = await self._spawn(ear)
            except (OSError, RuntimeError) as error:
                # No process or no thread to be had: the machine is at its limits, which may pass. A
                # child that nobody waits for loses its pipe, and ends by that.
                return f"cannot be started: {error}"
            how = await self._wait(process, ear)
        finally:
            if ear:
                self._has_lived |= ear.has_heard
                ear.close()
        if process.returncode in _USERS_FAULT and not self.restarts and not self._has_lived:
            raise FrontRefused(process.returncode)
        return how

    async def _spawn(self, ear: _Ear | None) -> asyncio.subprocess.Process:
        arguments = [*self._arguments, "--parent", str(os.getpid())]
        if ear:
            arguments += ["--signs", str(ear.mouth)]
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-m",
            "bridge",
            *arguments,
            stdin=asyncio.subprocess.DEVNULL,
            pass_fds=(ear.mouth,) if ear else (),
            # What a terminal sends to everybody is for the bus process: its drives stop first.
            process_group=0,
            # The bus process alone talks to systemd's watchdog.
            env={k: v for k, v in os.environ.items() if k not in ("NOTIFY_SOCKET", "WATCHDOG_USEC")},
        )
        if ear:
            ear.let_go()
        return process

    async def _wait(self, process: asyncio.subprocess.Process, ear: _Ear | None) -> str:
        """Until it ends, or is killed because it hangs."""
        while ear is None or ear.silent_looks < _SILENT_LOOKS:
            try:
                return f"ended ({_how(await asyncio.wait_for(process.wait(), SIGN_PERIOD_S))})"
            except TimeoutError:
                if ear:
                    ear.look()
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.wait()
        return f"gave no sign of life for {_SILENT_LOOKS * SIGN_PERIOD_S:g} s and was killed"

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


class _Ear:
    """Our end of the pipe on which one front gives its signs of life.

    Silence is counted in looks and not in time: where this process itself was stopped for a while, the
    front's signs wait in the pipe, or it was stopped too.
    """

    def __init__(self) -> None:
        self.silent_looks = 0
        self.has_heard = False
        self._loop = asyncio.get_running_loop()
        self._end, self.mouth = os.pipe()
        self._mouth_is_ours = True
        os.set_blocking(self._end, False)
        self._loop.add_reader(self._end, self._hear)

    def look(self) -> None:
        """One that is still starting may take its time."""
        self.silent_looks += self.has_heard

    def let_go(self) -> None:
        """The front has its end now."""
        if self._mouth_is_ours:
            self._mouth_is_ours = False
            os.close(self.mouth)

    def close(self) -> None:
        self.let_go()
        self._loop.remove_reader(self._end)
        os.close(self._end)

    def _hear(self) -> None:
        try:
            heard = os.read(self._end, 4096)
        except BlockingIOError:
            return
        if heard:
            self.has_heard = True
            self.silent_looks = 0
        else:
            self._loop.remove_reader(self._end)


async def give_signs(pipe: int) -> None:
    """A front's signs of life, from its event loop, until cancelled.

    Raises ``OperationFailed`` where nobody listens any more.
    """
    os.set_blocking(pipe, False)
    while True:
        try:
            os.write(pipe, b".")
        except BlockingIOError:
            pass  # there are enough to read
        except BrokenPipeError:
            raise OperationFailed("the bus process has given this front up") from None
        await asyncio.sleep(SIGN_PERIOD_S)


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
