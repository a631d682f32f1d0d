"""Run something until it ends, or until somebody wants it to."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Coroutine
from typing import Any, cast

from bridge.cli import logs


def until_stopped(work: Coroutine[Any, Any, None]) -> None:
    """Run ``work`` until it ends or SIGINT or SIGTERM arrives. Its one error is raised bare."""

    async def supervised() -> None:
        task = asyncio.ensure_future(work)
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(logs.LoopFaults())
        stopped = False

        def stop() -> None:
            nonlocal stopped
            stopped = True
            task.cancel()

        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, stop)
        try:
            await task
        except asyncio.CancelledError:
            if not stopped:
                raise

    try:
        asyncio.run(supervised())
    except BaseExceptionGroup as group:
        raise _first(cast("BaseException", group)) from None


def _first(error: BaseException) -> BaseException:
    """The first error of nested groups: what a user is told."""
    while isinstance(error, BaseExceptionGroup):
        error = cast("BaseExceptionGroup[BaseException]", error).exceptions[0]
    return error
