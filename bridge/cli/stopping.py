"""Run something until it ends, or until a signal ends it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any, cast

from bridge.cli import logs
from bridge.cli.ending_signals import ending_signals


@dataclass(slots=True)
class Shutdown:
    """``first`` is done in the loop's turn after the signal, before anything else is ended."""

    first: Callable[[], None] = lambda: None


def until_stopped(work: Coroutine[Any, Any, None], ending: Shutdown | None = None) -> None:
    """Run ``work`` until it ends or one of the signals that end us comes; then ``work`` is cancelled, once.
    Its one error is raised bare."""
    was_held = ending_signals.is_held
    if not was_held:
        ending_signals.hold()
    try:
        asyncio.run(_supervised(work, ending or Shutdown()))
    except BaseExceptionGroup as group:
        raise _first(cast("BaseException", group)) from None
    finally:
        ending_signals.tell(None)
        if not was_held:
            ending_signals.release()


async def _supervised(work: Coroutine[Any, Any, None], ending: Shutdown) -> None:
    loop = asyncio.get_running_loop()
    loop.set_exception_handler(logs.log_fault)
    logs.write_counts(loop)
    stopped = False

    def stop() -> None:
        nonlocal stopped
        stopped = True
        try:
            ending.first()
        finally:
            task.cancel()

    def on_signal() -> None:
        loop.call_soon_threadsafe(stop)

    ending_signals.tell(on_signal)
    if ending_signals.has_come:
        # Before there was anything to stop.
        work.close()
        return
    task = asyncio.ensure_future(work)
    try:
        await task
    except asyncio.CancelledError:
        if not stopped:
            raise


def _first(error: BaseException) -> BaseException:
    """The first error of nested groups: the one shown to the user."""
    while isinstance(error, BaseExceptionGroup):
        error = cast("BaseExceptionGroup[BaseException]", error).exceptions[0]
    return error
