"""Turns of a core: each call from outside that may change its state, one at a time."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from enum import StrEnum
from typing import Any, Final


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


UNHEARD: Final = nullcontext()
"""A turn that nobody listens to, or that is part of another."""


class Turns:
    """Turns that nobody listens to."""

    def begin(self, turn: Turn, *arguments: object) -> AbstractContextManager[None]:
        """A turn of this kind, as a context: what is done in it, and what it was called with. One that begins
        within another is part of it."""
        return UNHEARD

    def heard(self, reply: Callable[[Any], None]) -> Callable[[Any], None]:
        """The reply to the request of the turn that has just begun: whoever listens hears what it says."""
        return reply
