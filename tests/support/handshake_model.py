"""What CiA 402's profile position says of the new set-point handshake, and ``mappings/cia402`` of how the
bridge does it for the owner, written down a second time.

Nothing here is taken from ``bridge.drive``: the exploration compares the two after every event.
"""

from __future__ import annotations

from dataclasses import dataclass

LIMIT_S = 1.0
"""The drive's time to say that it has taken a position."""
PAUSE_S = 0.1
"""After a position that it has not taken."""


@dataclass(slots=True)
class HandshakeModel:
    """``is_up`` is the bit "new set-point". Positions are whatever the owner writes."""

    ordered: object = None
    """Still to be handed over."""
    handed_over: object = None
    """The drive has it, or gets it now: the same again is no new one."""
    is_up: bool = False
    was_commanded: bool = False
    up_until: float | None = None
    down_until: float | None = None

    def order(self, position: object) -> None:
        self.ordered = position if position != self.handed_over else None

    def forget(self) -> None:
        """A fault, a stop, or a word of the owner that does not enable."""
        self.ordered = self.handed_over = self.up_until = None
        self.is_up = False

    def go_on(self, now: float, *, commanded: bool, taken: bool) -> None:
        """``commanded``: the drive says that it is enabled, and is not being stopped. ``taken``: its bit
        "set-point acknowledge" is set."""
        if self.down_until is not None and now >= self.down_until:
            self.down_until = None
        if self.was_commanded and not commanded:
            self.forget()
        self.was_commanded = commanded
        if self.is_up and taken:
            self.is_up, self.up_until = False, None
        elif self.is_up and self.up_until is not None and now >= self.up_until:
            self.is_up, self.up_until, self.handed_over = False, None, None
            self.down_until = now + PAUSE_S
        elif commanded and not (self.is_up or taken or self.down_until) and self.ordered is not None:
            self.is_up, self.up_until = True, now + LIMIT_S
            self.ordered, self.handed_over = None, self.ordered
