"""A process of a simulated machine: one thread, whose turns come one after the other, and which may stand
still or end at any look at its clock."""

from __future__ import annotations

import asyncio
import contextvars
import inspect
import traceback
from collections import deque
from collections.abc import Callable, Coroutine
from contextlib import suppress
from functools import partial
from math import inf
from typing import Any, Final, Protocol, TypeVar, cast

from bridge.master.standstill import SignalAlarm
from tests.plant.world import Act, World

_Result = TypeVar("_Result")

LOOK_S: Final = 0.000_04
"""Time that passes from one look at the clock to the next: a turn takes as long as it has looks."""


class DeadError(SystemExit):
    """The process is gone: nothing in it may catch this, and a task of asyncio lets it through."""


class Watcher(Protocol):
    """Who is told what becomes of a process."""

    def on_still(self, now: float) -> None: ...

    def on_going_on(self, since: float, now: float) -> None: ...

    def on_end(self, now: float) -> None: ...


class Alarm(SignalAlarm):
    """The process's interval timer: its signal comes before anything else when the process goes on."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._due = inf
        self.told: Callable[[bool], None] = lambda breaks_in: None
        """Called before it rings, with whether it breaks in."""

    def set(self, seconds: float) -> None:
        self.rang = False
        self._due = self._world.now + seconds if seconds else inf

    def deliver(self) -> None:
        """Ring where that is due. Raises ``StoodStill`` where that is asked for."""
        if self._world.now >= self._due:
            self._due = inf
            self.told(self.breaks_in)
            self.ring()


class Process:
    """While it stands still its turns wait, and come in their order when it goes on, as those of an event
    loop do."""

    def __init__(self, world: World, watcher: Watcher, faults: list[str]) -> None:
        """``faults`` gets what fails in its turns."""
        self._world = world
        self._watcher = watcher
        self._faults = faults
        self._waiting: deque[Act] = deque()
        self._is_busy = self._is_still = False
        self.is_dead = False
        self._pause_s = 0.0
        """Length of the pause that begins at the next look at the clock; ``inf`` ends the process there."""
        self._skips = 0
        self.look_s = LOOK_S
        self.alarm = Alarm(world)
        self.loop = ProcessLoop(self, world, faults)
        self.still_since = inf
        """When it began to stand still; infinite while it does not."""

    def clock(self) -> float:
        seen = self._world.now
        if not self._is_busy:
            return seen
        # Not within a turn of another process, which would stand still with this one, and nobody be told.
        is_alone = self._world.turns == 1 or self._pause_s == inf
        if self._pause_s and not self._skips and is_alone:
            pause_s, self._pause_s = self._pause_s, 0.0
            self._stand_still(pause_s)
            self.alarm.deliver()
        else:
            self._skips = max(0, self._skips - 1)
            self._world.run_until(seen + self.look_s)
            if self.is_dead:
                raise DeadError
        return seen

    def post(self, act: Act) -> None:
        """Have ``act`` done in a turn: now, or when those before it are over."""
        if self.is_dead:
            return
        self._waiting.append(act)
        if not (self._is_busy or self._is_still):
            self._work()

    def _work(self) -> None:
        self._is_busy = True
        self._world.turns += 1
        before = asyncio._get_running_loop()
        try:
            while self._waiting and not self.is_dead:
                act = self._waiting.popleft()
                asyncio._set_running_loop(self.loop)
                self._do(act)
        except DeadError:
            self._end()
        finally:
            asyncio._set_running_loop(before)
            self._world.turns -= 1
            self._is_busy = False

    def _do(self, act: Act) -> None:
        """As an event loop does: what fails is noted, and the next turn comes."""
        try:
            act()
        except Exception as error:  # noqa: BLE001 - it is a finding
            self._faults.append("".join(traceback.format_exception(error)))

    # what is done to it

    def hang(self, seconds: float, *, in_turn: bool, skips: int = 0) -> None:
        """Stop it for so long: now, between two turns, or in a turn, at its next look at the clock but
        ``skips``."""
        if self.is_dead:
            return
        if in_turn or self._is_busy:
            self._pause_s, self._skips = seconds, skips
        elif not self._is_still:
            self._is_still = True
            self._begin_pause()
            self._world.after(seconds, self._go_on)

    def kill(self, *, in_turn: bool) -> None:
        if in_turn:
            self._pause_s = inf
        else:
            self._end()

    def _go_on(self) -> None:
        if not self.is_dead:
            self._is_still = False
            self._end_pause()
            self.alarm.deliver()
            self._work()

    def _begin_pause(self) -> None:
        self.still_since = self._world.now
        self._watcher.on_still(self._world.now)

    def _end_pause(self) -> None:
        since, self.still_since = self.still_since, inf
        if not self.is_dead:
            self._watcher.on_going_on(since, self._world.now)

    def _stand_still(self, seconds: float) -> None:
        """In the middle of a turn."""
        if seconds == inf:
            raise DeadError
        running = asyncio._get_running_loop()
        asyncio._set_running_loop(None)
        self._begin_pause()
        self._world.run_until(self._world.now + seconds)
        self._end_pause()
        asyncio._set_running_loop(running)
        if self.is_dead:
            raise DeadError

    def _end(self) -> None:
        if self.is_dead:
            return
        self.is_dead = True
        self._waiting.clear()
        self.loop.end()
        self._watcher.on_end(self._world.now)


class _Handle(asyncio.TimerHandle):
    """A turn that is to come."""

    def __init__(
        self,
        when: float,
        call: Callable[..., object],
        args: tuple[Any, ...],
        loop: ProcessLoop,
        context: contextvars.Context | None,
    ) -> None:
        self._act = partial((context or contextvars.copy_context()).run, call, *args)
        super().__init__(when, call, args, loop)

    def run(self) -> None:
        """Not by ``_run``, which keeps what it raises to itself: the end of the process, too."""
        if not self.cancelled():
            self._act()


class ProcessLoop(asyncio.AbstractEventLoop):
    """As much of an event loop as the bridge's servers ask for, on the clock of the plant."""

    def __init__(self, process: Process, world: World, faults: list[str]) -> None:
        """``faults`` gets what was raised where only an event loop hears of it."""
        self._process = process
        self._world = world
        self._faults = faults
        self._tasks: list[asyncio.Task[Any]] = []

    def time(self) -> float:
        return self._world.now

    def get_debug(self) -> bool:
        return False

    def is_running(self) -> bool:
        return True

    def is_closed(self) -> bool:
        return False

    def call_soon(  # type: ignore[override]
        self, callback: Callable[..., object], *args: Any, context: contextvars.Context | None = None
    ) -> asyncio.TimerHandle:
        return self.call_at(self._world.now, callback, *args, context=context)

    def call_later(  # type: ignore[override]
        self,
        delay: float,
        callback: Callable[..., object],
        *args: Any,
        context: contextvars.Context | None = None,
    ) -> asyncio.TimerHandle:
        return self.call_at(self._world.now + delay, callback, *args, context=context)

    def call_at(  # type: ignore[override]
        self,
        when: float,
        callback: Callable[..., object],
        *args: Any,
        context: contextvars.Context | None = None,
    ) -> asyncio.TimerHandle:
        handle = _Handle(when, callback, args, self, context)
        self._world.at(when, lambda: self._process.post(handle.run))
        return handle

    def create_task(  # type: ignore[override]
        self, coro: Coroutine[Any, Any, _Result], **options: Any
    ) -> asyncio.Task[_Result]:
        task = asyncio.Task(coro, loop=self, **options)
        self._tasks = [*(one for one in self._tasks if not one.done()), task]
        return task

    def end(self) -> None:
        """Nothing of its tasks is left."""
        tasks, self._tasks = self._tasks, []
        for task in tasks:
            coro = cast("Coroutine[Any, Any, Any]", task.get_coro())
            if inspect.getcoroutinestate(coro) == inspect.CORO_CREATED:
                coro.close()
            # A group of tasks waits for its tasks first, and then no more.
            with suppress(BaseException):
                while inspect.getcoroutinestate(coro) == inspect.CORO_SUSPENDED:
                    coro.throw(DeadError)

    def create_future(self) -> asyncio.Future[Any]:
        return asyncio.Future(loop=self)

    def _timer_handle_cancelled(self, handle: asyncio.TimerHandle) -> None:
        """A turn that was cancelled does nothing."""

    def call_exception_handler(self, context: dict[str, Any]) -> None:
        # With a process its tasks end, wherever they are.
        if not self._process.is_dead:
            self._faults.append(f"{context.get('message')}: {context.get('exception')!r}")
