"""Follow one value through the functions of the bridge, in all of its threads."""

from __future__ import annotations

import dataclasses
import struct
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from types import CodeType, FrameType, FunctionType
from typing import Any, Final, NamedTuple

import msgspec
import zenoh

_BRIDGE: Final = str(Path(__file__).resolve().parents[1] / "bridge") + "/"
_SIMULATED: Final = _BRIDGE + "sim/"
_DEEPEST: Final = 5


class Rest(NamedTuple):
    """Where the value waits for somebody, or leaves the bridge: a call of this function has it, made by the
    one that ``by`` names, if it does. With ``gives`` it leaves as what the call returns."""

    file: str
    function: str
    by: str = ""
    gives: bool = False


class Call:
    """One call of a function of the bridge: since when it has had the value, counted in events, when it has
    given it back, and who has given it to this one."""

    __slots__ = ("file", "function", "gave_at", "given_by", "has_at", "parent")

    def __init__(self, file: str, function: str, parent: Call | None) -> None:
        self.file, self.function, self.parent = file, function, parent
        self.has_at: int | None = None
        self.gave_at: int | None = None
        self.given_by: list[tuple[int, Call]] = []

    def had(self, at: int) -> bool:
        return self.has_at is not None and self.has_at <= at


class Trace:
    """Follows ``word`` through all threads that call ``on_event`` as their profile function."""

    def __init__(self, word: int) -> None:
        self._word = word
        self._signs = struct.pack("<H", word), struct.pack(">H", word), str(word).encode()
        self._count = 0
        self._files: dict[CodeType, str] = {}
        self._running: dict[FrameType, Call] = {}
        self._calls: list[Call] = []
        """Those that have had the word, in the order in which it came to them."""

    def on_event(self, frame: FrameType, event: str, arg: object) -> None:
        if event not in ("call", "return") or not self._file(frame):
            return
        call = self._call(frame)
        caller = self._running.get(frame.f_back) if frame.f_back else None
        if event == "call":
            given = (*frame.f_code.co_varnames[: _arguments(frame.f_code)], *frame.f_code.co_freevars)
            held = frame.f_locals
            if any(self._holds(held.get(name)) for name in given if name != "self"):
                self._have(caller, call)
            return
        del self._running[frame]
        # A function that is given back takes an outcome, whatever else it knows.
        if not callable(arg) and self._holds(arg):
            self._have(call, caller)
            call.gave_at = self._count
            if caller:
                caller.given_by.append((self._count, call))

    def end(self) -> None:
        """Let go of what is still running."""
        self._running.clear()

    def _file(self, frame: FrameType) -> str:
        """The file of the bridge, empty where it is another's."""
        code = frame.f_code
        if code not in self._files:
            path = code.co_filename
            is_ours = path.startswith(_BRIDGE) and not path.startswith(_SIMULATED)
            self._files[code] = path.removeprefix(_BRIDGE) if is_ours else ""
        return self._files[code]

    def _call(self, frame: FrameType) -> Call:
        if frame not in self._running:
            back = frame.f_back
            while back is not None and not self._file(back):
                back = back.f_back
            parent = self._call(back) if back else None
            self._running[frame] = Call(self._file(frame), frame.f_code.co_qualname, parent)
        return self._running[frame]

    def _have(self, *calls: Call | None) -> None:
        self._count += 1
        for call in calls:
            if call and call.has_at is None:
                call.has_at = self._count
                self._calls.append(call)

    def _holds(self, value: Any, depth: int = _DEEPEST) -> bool:
        if isinstance(value, bool | str | float) or value is None:
            return False
        if isinstance(value, int):
            return value == self._word
        if isinstance(value, bytes | bytearray | memoryview):
            return any(sign in bytes(value) for sign in self._signs)
        return depth > 0 and any(self._holds(part, depth - 1) for part in _parts(value))

    def steps(self, rests: Iterable[Rest]) -> dict[str, str]:
        """The files on a way, in the order in which the word came to them, each with its first function.

        Raises LookupError where the word has not come to one of ``rests``.
        """
        on_way: set[Call] = set()
        since = 0
        for rest in rests:
            call = next((call for call in self._calls if _is(call, rest) and not call.had(since)), None)
            at = None if call is None else call.gave_at if rest.gives else call.has_at
            if call is None or at is None:
                raise LookupError(f"the value was not seen in {rest}")
            since = at
            # Whom it is given to does not count any more.
            on_way |= _hands(call, at - rest.gives)
        steps: dict[str, str] = {}
        for call in self._calls:
            if call in on_way:
                steps.setdefault(call.file, call.function)
        return steps


def _arguments(code: CodeType) -> int:
    return code.co_argcount + code.co_kwonlyargcount


def _is(call: Call, rest: Rest) -> bool:
    made_by = call.parent.function if call.parent else ""
    return (call.file, call.function) == rest[:2] and made_by.startswith(rest.by)


def _hands(call: Call, at: int) -> set[Call]:
    """Whoever had the word on its way to this call, which has it ``at`` that time: those that have called it,
    and those that have given it to one of them."""
    found: set[Call] = set()
    waiting = [call]
    caller = call.parent
    while caller:
        waiting += [caller] if caller.had(at) else []
        caller = caller.parent
    while waiting:
        one = waiting.pop()
        if one not in found:
            found.add(one)
            waiting += [giver for given_at, giver in one.given_by if given_at <= at]
    return found


def _parts(value: Any) -> Iterable[Any]:
    match value:
        case dict():
            return tuple(value.values())
        case list() | tuple() | set() | frozenset():
            return tuple(value)
        case partial():
            return value.args
        case FunctionType():
            return _closed_over(value)
        case msgspec.Struct():
            return [getattr(value, name) for name in value.__struct_fields__]
        case _ if dataclasses.is_dataclass(value):
            return [getattr(value, field.name, None) for field in dataclasses.fields(value)]
        case _:
            return ()


def _closed_over(function: FunctionType) -> Iterator[Any]:
    for cell in function.__closure__ or ():
        with suppress(ValueError):  # a name that is set later
            yield cell.cell_contents


class Threads:
    """The profile function of this thread, of all that start from now on, and of zenoh's callbacks."""

    def __init__(self) -> None:
        self._trace: Trace | None = None

    def _on_event(self, frame: FrameType, event: str, arg: object) -> None:
        if self._trace:
            self._trace.on_event(frame, event, arg)

    @contextmanager
    def prepared(self) -> Iterator[None]:
        """Before the threads start."""
        callback = zenoh.handlers.Callback

        def profiled(handler: Callable[..., object]) -> Callable[..., None]:
            def handle(*given: object) -> None:
                sys.setprofile(self._on_event)
                try:
                    handler(*given)
                finally:
                    sys.setprofile(None)

            return handle

        threading.setprofile(self._on_event)
        zenoh.handlers.Callback = lambda handler, *rest, **more: callback(profiled(handler), *rest, **more)
        try:
            yield
        finally:
            zenoh.handlers.Callback = callback
            threading.setprofile(None)  # type: ignore[arg-type]

    @contextmanager
    def following(self, trace: Trace) -> Iterator[None]:
        self._trace = trace
        sys.setprofile(self._on_event)
        try:
            yield
        finally:
            sys.setprofile(None)
            self._trace = None
            trace.end()
