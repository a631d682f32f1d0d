"""What a northbound server sees of the plant, in the bus process and in a front alike."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from bridge.command import Event, Outcome, Rejection, Request
from bridge.image import Image


class View(Protocol):
    """The image to read, requests to make, events to hear; nothing of what is behind them."""

    @property
    def image(self) -> Image: ...

    def epoch_ns(self, time: float) -> int:
        """Wall clock, in ns since 1970 UTC, of a ``Reading.time``."""
        ...

    async def request(self, request: Request) -> Outcome: ...

    def rejected(self, rejection: Rejection) -> None:
        """Report that the server has refused something by itself; the client has its answer."""
        ...

    def count(self, leaf: str) -> None:
        """Count up a point of the bridge's own, such as ``opcua_refused_connections``."""
        ...

    def on_event(self, listener: Callable[[Event], None]) -> None: ...
