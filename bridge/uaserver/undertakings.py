"""Requests of one connection that take long, and are answered while others are: a bounded number of tasks."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any, Final

from bridge.uaserver.library import ServiceError, StatusCodes

_MOST: Final = 32


class Undertakings:
    """``handles`` are those of the requests that can be cancelled, by their tasks."""

    def __init__(self) -> None:
        self._tasks: set[asyncio.Task[Any]] = set()
        self.handles: dict[asyncio.Task[Any], int] = {}

    async def room(self) -> None:
        """Wait until there can be one more."""
        if len(self._tasks) >= _MOST:
            await asyncio.wait(self._tasks, return_when=asyncio.FIRST_COMPLETED)

    def begin(self, work: Coroutine[Any, Any, Any], handle: int | None = None) -> None:
        """``handle`` is that of a request that changes nothing, and can be cancelled."""
        task = asyncio.create_task(work)
        self._tasks.add(task)
        if handle is not None:
            self.handles[task] = handle
        task.add_done_callback(self._done)

    def _done(self, task: asyncio.Task[Any]) -> None:
        self._tasks.discard(task)
        self.handles.pop(task, None)

    def cancel(self, handle: int) -> int:
        """Cancel the requests that their client calls so; how many there were."""
        found = [task for task, one in self.handles.items() if one == handle]
        for task in found:
            del self.handles[task]
            task.cancel()
        return len(found)

    def cancel_all(self) -> None:
        for task in list(self._tasks):
            task.cancel()


async def finish(
    work: Coroutine[Any, Any, None], is_open: Callable[[], bool], refuse: Callable[[int], None]
) -> None:
    """The rest of a request, which answers it; ``refuse`` does where that fails, or where it is cancelled and
    its connection is still there."""
    try:
        await work
    except ServiceError as error:
        if is_open():
            refuse(int(error.code))
    except asyncio.CancelledError:
        if is_open():
            refuse(StatusCodes.BadRequestCancelledByClient)
        raise
