"""Requests of all connections, a few at a time: between two slices the event loop looks at its sockets, so
that a client that asks seldom is seen, and served, before a crowd has had its way."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol

from bridge.northbound.turns import Turns

SLICE: Final = 4
"""Requests between two looks at the sockets while clients of several addresses are connected: 0.1 ms."""
LONE_SLICE: Final = 16
"""The same with clients of one address alone, who wait for nobody else's."""


class Served(Protocol):
    """A connection."""

    def serve(self, most: int) -> int:
        """Handle up to ``most`` requests and send what answers are due; how many were handled."""
        ...


class Rounds:
    """``call_soon`` has something called when the sockets have been looked at."""

    def __init__(self, call_soon: Callable[[Callable[[], None]], object]) -> None:
        self._call_soon = call_soon
        self._turns = Turns[Served]()
        self._left = self._slice = LONE_SLICE
        self._is_serving = self._is_called = False

    def enter(self, one: Served, source: str) -> None:
        """A new connection, of the address ``source``."""
        self._turns.enter(one, source)

    def leave(self, one: Served) -> None:
        """End serving ``one``. May be called again."""
        self._turns.leave(one)

    def wish(self, one: Served) -> None:
        """Serve ``one``, which has requests or answers, at once where nobody waits, else in its turn."""
        self._turns.wish(one)
        if not self._is_serving:
            self._serve()

    def serve_now(self, one: Served, most: int) -> None:
        """Out of turn, for a connection that ends. To be called by the event loop."""
        self._is_serving = True
        try:
            one.serve(most)
        finally:
            self._is_serving = False

    def _serve(self) -> None:
        self._is_serving = True
        try:
            while self._left > 0 and (one := self._turns.take()) is not None:
                most = self._left
                self._left -= 1  # a turn without a request costs time as well
                self._left -= max(0, one.serve(most) - 1)
        finally:
            self._is_serving = False
            if self._left < self._slice and not self._is_called:
                self._is_called = True
                self._call_soon(self._go_on)

    def _go_on(self) -> None:
        """The sockets have been looked at."""
        self._is_called = False
        self._left = self._slice = SLICE if self._turns.addresses > 1 else LONE_SLICE
        self._serve()
