"""The new set-point handshake of a positioning drive (CiA 402 profile position: bit 4, status bit 12).

The bridge does it for clients that write the position as a value: the bit rises with the new words, stays
until the drive reports that it has taken them, falls, and may rise again when the drive has seen that. A
drive that does not report within a second has not taken them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from bridge.mapping.model import Handshake as HandshakeModel

_LIMIT_S: Final = 1.0
"""How long the drive may take to report that it has a position; the profile names no time."""
_LOW_S: Final = 0.1
"""How long the bit stays down after that: longer than any cycle we send with, so that an edge is seen."""


class Handshake:
    """One drive's. ``places`` are those of the value's words among the setpoints.

    An order with words that the drive has already taken does nothing: a controller that writes cyclically
    must not start a movement twice. What the drive has taken counts as long as it is enabled. Times are
    monotonic seconds.
    """

    __slots__ = (
        "_acknowledged",
        "_deadline",
        "_mask",
        "_ordered",
        "_places",
        "_raised",
        "_rises_at",
        "_taken",
        "_untaken",
        "_was_enabled",
        "value",
    )

    def __init__(self, model: HandshakeModel, places: Sequence[int]) -> None:
        self.value = model.value
        self._mask = 1 << model.bit
        self._acknowledged = 1 << model.acknowledge_bit
        self._places = tuple(places)
        self._ordered = False
        self._raised = False
        self._was_enabled = False
        self._untaken = False
        self._taken: tuple[int, ...] | None = None
        self._deadline: float | None = None
        """While the bit is up: when it is given up that the drive takes the position."""
        self._rises_at: float | None = None
        """After that: when the bit may rise again."""

    @property
    def bits(self) -> int:
        """What goes into the control word beside the owner's bits."""
        return self._mask if self._raised else 0

    def order(self, setpoints: Sequence[int]) -> None:
        """The position was written. Where the drive has it already, or is getting it, one that was written
        in between does not count any more."""
        self._ordered = self._words(setpoints) != self._taken

    def reset(self) -> None:
        """The drive is stopped: pending orders are dropped."""
        self._ordered = self._raised = False
        self._taken = self._deadline = None

    def step(self, setpoints: Sequence[int], status_word: int, now: float, *, enabled: bool) -> None:
        """Go on with what the drive says. An order waits until the drive is enabled."""
        acknowledged = bool(status_word & self._acknowledged)
        if self._rises_at is not None and now >= self._rises_at:
            self._rises_at = None
        if not enabled:
            if self._was_enabled:
                self.reset()
        elif self._raised:
            self._await(acknowledged, now)
        elif self._ordered and not acknowledged and self._rises_at is None:
            self._ordered, self._raised = False, True
            self._taken = self._words(setpoints)
            self._deadline = now + _LIMIT_S
        self._was_enabled = enabled

    def _await(self, acknowledged: bool, now: float) -> None:
        """The bit is up: lower it when the drive has taken the position, or does not take it."""
        if acknowledged:
            self._raised, self._deadline = False, None
        elif self._deadline is not None and now >= self._deadline:
            self._raised, self._deadline, self._taken = False, None, None
            self._untaken = True
            self._rises_at = now + _LOW_S

    def take_untaken(self) -> bool:
        """Whether the drive has not taken a position in time; asked and forgotten."""
        untaken, self._untaken = self._untaken, False
        return untaken

    def next_deadlines(self) -> tuple[float | None, float | None]:
        return self._deadline, self._rises_at

    def _words(self, setpoints: Sequence[int]) -> tuple[int, ...]:
        return tuple(setpoints[place] for place in self._places)
