"""Front processes: started, watched, killed where they hang or grow too large, and stopped.

A front is heavy and may crash; it holds nothing up. It is a child of the bus process, with a lower
priority, and dies with it.
"""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import os
import resource
import signal
import socket
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from bridge.base.errors import BridgeError, OperationFailed
from bridge.text import Text, Words

SIGN_PERIOD_S: Final = 1.0
_SILENT_LOOKS: Final = 5
"""Looks without a sign of life after which a front counts as hung: at least as many seconds have passed
then."""
_REASON: Final = b"!"
"""Byte on the pipe of signs before the reason why the front ends."""
_LONGEST_REASON: Final = 1000
_LONGEST_SHOWN: Final = 300
_STOP_S: Final = 3.0
_END_SIGNAL: Final = signal.SIGUSR1
"""Tells a front that it is going to be ended."""
_NICE: Final = 5
_FIRST_TO_GO: Final = 500
"""``oom_score_adj`` (proc(5)) of fronts: where the machine or the unit has no memory left, the kernel kills a
front, and not the process that stops the drives."""
_MB: Final = 1024 * 1024
_BEYOND: Final = 2
"""Multiple of its limit beyond which a front is refused memory, for one that grows faster than it is looked
at."""
_PR_SET_PDEATHSIG: Final = 1


class Front:
    """One front process: ``python -m bridge`` with ``arguments`` and our process id.

    A ``watched`` one is given a pipe (``--signs``) on which it shows that its event loop runs, and says why
    it ends. ``listening`` gives the socket that it is to serve on (``--listening``), which stays ours, too.
    One that holds more than ``most_mb`` of memory is killed. One with a ``notice_s`` gives its clients so
    many seconds before it ends, and is told of the end by a signal as soon as it is known (``on_end``).
    """

    def __init__(
        self,
        role: str,
        arguments: Sequence[str],
        *,
        watched: bool = False,
        listening: Callable[[], socket.socket] | None = None,
        most_mb: int | None = None,
        notice_s: float | None = None,
    ) -> None:
        self.name = role
        self.title = Text.of("front.front", role=role)
        self._arguments = list(arguments)
        self._watched = watched
        self._listening = listening
        self._most_mb = most_mb
        self._notice_s = notice_s
        self._can_hear = False
        """It has shown that it lives, and with that catches the signal that would end it before."""
        self._process: asyncio.subprocess.Process | None = None

    @property
    def pid(self) -> int | None:
        return self._process.pid if self._process else None

    def announce_end(self) -> None:
        """Tell it that it is going to be ended, if it wants to know."""
        process = self._process
        if process is None or process.returncode is not None or not self._can_hear or self._notice_s is None:
            return
        with contextlib.suppress(ProcessLookupError):
            process.send_signal(_END_SIGNAL)

    async def run_once(self, serves: Callable[[], None]) -> Text:
        """Run it until it ends. Returns how, as the end of a sentence. ``serves`` is called at its first sign
        of life, or where it is not watched, once it has run for a second. When cancelled, the front is
        ended."""

        def lives() -> None:
            self._can_hear = self._watched
            serves()

        ear = None
        self._can_hear = False
        try:
            ear = _LifePipe(lives) if self._watched else None
            process = self._process = await self._spawn(ear)
            return await self._wait(process, ear, serves)
        except (BridgeError, OSError, RuntimeError) as error:
            # No port, no process or no thread to be had: the machine is at its limits, which may pass. A
            # child that nobody waits for loses its pipe, and ends by that.
            return Text.of("front.cannot_be_started", why=shortened(str(error)))
        finally:
            if ear:
                ear.close()
            await self._stop()

    async def _spawn(self, ear: _LifePipe | None) -> asyncio.subprocess.Process:
        arguments, files = [*self._arguments, "--parent", str(os.getpid())], list[int]()
        if ear:
            arguments += ["--signs", str(ear.mouth)]
            files.append(ear.mouth)
        if self._listening:
            files.append(self._listening().fileno())
            arguments += ["--listening", str(files[-1])]
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-m",
            "bridge",
            *arguments,
            stdin=asyncio.subprocess.DEVNULL,
            pass_fds=files,
            # What a terminal sends to everybody is for the bus process: its drives stop first.
            process_group=0,
            # The bus process alone talks to systemd's watchdog.
            env={k: v for k, v in os.environ.items() if k not in ("NOTIFY_SOCKET", "WATCHDOG_USEC")},
        )
        if ear:
            ear.let_go()
        return process

    async def _wait(
        self, process: asyncio.subprocess.Process, ear: _LifePipe | None, serves: Callable[[], None]
    ) -> Text:
        """Wait until it ends, or is killed because it hangs."""
        # One wait for all looks: of each that is given up, asyncio keeps a future until the process ends.
        ended = asyncio.create_task(process.wait())
        try:
            while ear is None or ear.silent_looks <= _SILENT_LOOKS:
                if (await asyncio.wait({ended}, timeout=SIGN_PERIOD_S))[0]:
                    return _how(ended.result(), ear.reason if ear else "")
                if self._most_mb is not None and (held_mb := _resident_mb(process.pid)) > self._most_mb:
                    await _kill(process, ended)
                    return Text.of("front.too_large", held_mb=held_mb, most_mb=self._most_mb)
                if ear:
                    ear.look()
                else:
                    serves()
            await _kill(process, ended)
        finally:
            ended.cancel()
        return Text.of("front.no_sign", silent_s=_SILENT_LOOKS * SIGN_PERIOD_S)

    async def _stop(self) -> None:
        process = self._process
        if process is None or process.returncode is not None:
            return
        with contextlib.suppress(ProcessLookupError):
            process.terminate()
        try:
            await asyncio.wait_for(process.wait(), _STOP_S + (self._notice_s or 0.0))
        except TimeoutError:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()


class _LifePipe:
    """Our end of the pipe on which one front gives its signs of life.

    Silence is counted in looks and not in time: where this process itself was stopped for a while, the
    front's signs wait in the pipe, or it was stopped too.
    """

    def __init__(self, serves: Callable[[], None]) -> None:
        self.silent_looks = 0
        self.reason = ""
        self._has_heard = False
        self._serves = serves
        self._loop = asyncio.get_running_loop()
        self._end, self.mouth = os.pipe()
        self._mouth_is_ours = True
        os.set_blocking(self._end, False)
        self._loop.add_reader(self._end, self._hear)

    def look(self) -> None:
        """Count a look without a sign of life; one that is still starting may take its time."""
        self.silent_looks += self._has_heard

    def let_go(self) -> None:
        """Close our copy of the front's end; the front has it now."""
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
        signs, bang, reason = heard.partition(_REASON)
        if bang:
            self.reason = reason.decode("utf-8", "replace")
        if signs:
            self.silent_looks = 0
            if not self._has_heard:
                self._has_heard = True
                self._serves()
        if not heard:
            self._loop.remove_reader(self._end)


async def give_signs(pipe: int) -> None:
    """Called by a front: give signs of life from its event loop, until cancelled. Raises ``OperationFailed``
    where nobody listens any more."""
    os.set_blocking(pipe, False)
    while True:
        try:
            os.write(pipe, b".")
        except BlockingIOError:
            pass  # there are enough to read
        except BrokenPipeError:
            raise OperationFailed("the bus process has given this front up") from None
        await asyncio.sleep(SIGN_PERIOD_S)


def on_end(act: Callable[[], None]) -> None:
    """Called by a front before its first sign of life: have ``act`` done when its end is announced."""
    asyncio.get_running_loop().add_signal_handler(_END_SIGNAL, act)


def give_reason(pipe: int, reason: str) -> None:
    """Called by a front: give the reason why it ends."""
    with contextlib.suppress(OSError):
        os.write(pipe, _REASON + " ".join(reason.split()).encode("utf-8", "replace")[:_LONGEST_REASON])


def become_front(parent: int, *, is_prompt: bool = False) -> None:
    """Called by a front: end with the bus process, and lower its own priority below that one's unless it
    ``is_prompt``."""
    if not is_prompt:
        with contextlib.suppress(OSError):
            os.nice(_NICE)
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(str(_FIRST_TO_GO), encoding="ascii")
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
        if parent and os.getppid() != parent:  # it died before we asked
            raise SystemExit(0)


def limit_memory(most_mb: int) -> None:
    """Called by a front: limit its own memory to far beyond ``most_mb``; a front that is refused memory
    ends."""
    with contextlib.suppress(OSError, ValueError):
        most = _BEYOND * most_mb * _MB
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))


async def _kill(process: asyncio.subprocess.Process, ended: asyncio.Task[int]) -> None:
    with contextlib.suppress(ProcessLookupError):
        process.kill()
    await ended


def _resident_mb(pid: int) -> int:
    """Memory that the process holds, in MB; 0 where that cannot be read, because it has just ended."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    except (OSError, ValueError, IndexError):
        return 0
    return pages * resource.getpagesize() // _MB


def shortened(reason: str) -> str:
    """An error's words, on one line that a status line has room for."""
    return " ".join(reason.split())[:_LONGEST_SHOWN]


def _how(code: int, reason: str) -> Text:
    how: Words = Text.of("front.exit_status", code=code)
    if code < 0:
        with contextlib.suppress(ValueError):
            how = signal.Signals(-code).name
    if reason:
        return Text.of("front.ended_because", how=how, why=shortened(reason))
    return Text.of("front.ended_by_itself", how=how)
