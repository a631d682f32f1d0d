"""View of the plant for a northbound server, the same in the bus process and in a front."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from bridge.command import Event, Identity, Rejection, Reply, Request
from bridge.image import Image


class View(Protocol):
    """Points to read and to follow, requests to make, events to hear; nothing of what is behind them.

    That may be a plant of this process, or a copy of one or of many that run elsewhere: the times of
    readings, events and outcomes are the view's own, and only ``epoch_ns`` says when they were. The time of a
    request is of the clock of the process that makes it. A view that passes it to a plant with another clock
    translates it, and makes it no later than it was: the way there counts as waiting.
    """

    @property
    def image(self) -> Image: ...

    def look(self, drive: str) -> None:
        """Bring the points of this drive, ``<node>/<drive>``, to this moment, as far as they are known here:
        before that, a deadline that has passed since the last round is not seen in them."""
        ...

    def hurry(self, *, is_wanted: bool) -> None:
        """Have changes come as soon as they are made, until it is not wanted any more: that has its price. A
        view that has them at once anyway does nothing."""
        ...

    def epoch_ns(self, time: float, /) -> int:
        """Wall clock, in ns since 1970 UTC, of a time that the view has given."""
        ...

    def submit(self, request: Request, reply: Reply) -> None:
        """Have ``request`` carried out; ``reply`` is called exactly once, before this returns or later."""
        ...

    def rejected(self, rejection: Rejection) -> None:
        """Report that the server has refused something by itself; the client has its answer."""
        ...

    def count(self, leaf: str, by: int = 1) -> None:
        """Count up a point of the bridge's own, such as ``opcua_refused_connections``."""
        ...

    def on_connection(self, identity: Identity, *, is_there: bool, has_others: bool = False) -> None:
        """Tell that the client's connection that ``identity`` names has begun or ended; ``has_others``: the
        same user has other ones. What is submitted afterwards finds it so."""
        ...

    def on_event(self, listener: Callable[[Event], None]) -> None: ...

    def forget(self, listener: Callable[[Event], None]) -> None:
        """Tell ``listener`` no more."""
        ...
