"""Dialogues with a node: generators that yield one step after the other and are sent its result.

The generator's author decides what a step is. ``SdoRead`` and ``SdoWrite`` are steps for an SDO channel. An
error is thrown into the generator at the step that it belongs to.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Generic, TypeVar

from bridge.canopen.sdo import Priority, Result, SdoChannel, SdoError


@dataclass(frozen=True, slots=True)
class SdoRead:
    """Read an object over one of the node's SDO channels, by number."""

    index: int
    sub: int = 0
    channel: int = 1


@dataclass(frozen=True, slots=True)
class SdoWrite:
    index: int
    sub: int
    data: bytes
    channel: int = 1


def ask(
    step: SdoRead | SdoWrite,
    sdo: SdoChannel,
    now: float,
    answered: Callable[[Result], None],
    priority: Priority = Priority.COMMAND,
) -> None:
    """Have ``sdo`` carry out ``step``; ``answered`` is called once, possibly before this returns."""
    if isinstance(step, SdoRead):
        sdo.read(step.index, step.sub, now, answered, priority=priority)
    else:
        sdo.write(step.index, step.sub, step.data, now, answered, priority=priority)


def attempt(index: int, sub: int = 0) -> Generator[SdoRead, bytes | None, Result]:
    """The result of reading an object, which may be an error."""
    try:
        return (yield SdoRead(index, sub)) or b""
    except SdoError as error:
        return error


def optional(index: int, sub: int = 0, channel: int = 1) -> Generator[SdoRead, bytes | None, bytes | None]:
    """An object that the node need not have: None if it aborts. A time-out is still an error."""
    try:
        return (yield SdoRead(index, sub, channel))
    except SdoError as error:
        if error.by_server:
            return None
        raise


S = TypeVar("S")
A = TypeVar("A")
R = TypeVar("R")
E = TypeVar("E", bound=Exception)


class Dialogue(Generic[S, A, R, E]):
    """Runs one generator. ``do`` carries out a step, and says whether its answer comes later, by ``go_on``.
    ``done`` gets the generator's return value, or the error, one of ``fails``, that has ended it."""

    def __init__(
        self,
        steps: Generator[S, A, R],
        do: Callable[[S, float], bool],
        done: Callable[[R | E, float], None],
        fails: tuple[type[E], ...],
    ) -> None:
        self._steps: Generator[S, A, R] | None = steps
        self._do = do
        self._done = done
        self._fails = fails

    def go_on(self, answer: A | Exception | None, now: float) -> None:
        """Begin (None), or go on with an answer, until an answer has to be waited for. After the end nothing
        happens."""
        while self._steps is not None:
            try:
                if answer is None:
                    step = next(self._steps)
                elif isinstance(answer, Exception):
                    step = self._steps.throw(answer)
                else:
                    step = self._steps.send(answer)
            except StopIteration as end:
                self._end(end.value, now)
                return
            except self._fails as error:
                self._end(error, now)
                return
            answer = None
            if self._do(step, now):
                return

    def close(self) -> None:
        """End it without a result."""
        if self._steps is not None:
            self._steps.close()
            self._steps = None

    def _end(self, result: R | E, now: float) -> None:
        self._steps = None
        self._done(result, now)
