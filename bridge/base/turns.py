"""Turns of a core: each call from outside that may change its state, one at a time."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from typing import ParamSpec, TypeVar

_Args = ParamSpec("_Args")
_Result = TypeVar("_Result")


class Turn(StrEnum):
    """Kind of a turn."""

    TAKE_IN = "take_in"
    PUMP = "pump"
    HALT = "halt"
    STOP_NODES = "stop_nodes"
    SUBMIT = "submit"
    REJECTED = "rejected"
    COUNT = "count"
    CONNECTION = "connection"
    REPORT = "report"
    LOOK = "look"


class Turns:
    """Turns that nobody listens to. One that is run within another is part of it."""

    def run(
        self, turn: Turn, act: Callable[_Args, _Result], /, *args: _Args.args, **options: _Args.kwargs
    ) -> _Result:
        """Do ``act``, which is a turn of this kind."""
        return act(*args, **options)
