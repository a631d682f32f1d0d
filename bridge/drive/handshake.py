"""The new set-point handshake of a positioning drive (CiA 402 profile position: bit 4, status bit 12).

The bridge does it for who writes the position as a value: the bit rises with the new words, stays until the
drive says that it has taken them, falls, and may rise again when the drive has seen that.
"""

from __future__ import annotations

from collections.abc import Sequence

from bridge.mapping.model import Handshake as HandshakeModel


class Handshake:
    """One drive's. ``places`` are those of the value's words among the setpoints.

    An order with the words that the drive has taken already is none: a controller that writes cyclically
    moves nothing twice. What the drive has taken counts as long as it is enabled.
    """

    __slots__ = ("_acknowledged", "_mask", "_ordered", "_places", "_raised", "_taken", "value")

    def __init__(self, model: HandshakeModel, places: Sequence[int]) -> None:
        self.value = model.value
        self._mask = 1 << model.bit
        self._acknowledged = 1 << model.acknowledge_bit
        self._places = tuple(places)
        self._ordered = False
        self._raised = False
        self._taken: tuple[int, ...] | None = None

    @property
    def bits(self) -> int:
        """What goes into the control word beside the owner's bits."""
        return self._mask if self._raised else 0

    def order(self, setpoints: Sequence[int]) -> None:
        """The position was written."""
        if self._words(setpoints) != self._taken:
            self._ordered = True

    def reset(self) -> None:
        """The drive is stopped: what was ordered does not count any more."""
        self._ordered = self._raised = False
        self._taken = None

    def step(self, setpoints: Sequence[int], status_word: int, *, enabled: bool) -> None:
        """Go on with what the drive says. An order waits until the drive is enabled."""
        acknowledged = bool(status_word & self._acknowledged)
        if not enabled:
            if self._taken is not None:
                self.reset()
        elif self._raised:
            self._raised = not acknowledged
        elif self._ordered and not acknowledged:
            self._ordered, self._raised = False, True
            self._taken = self._words(setpoints)

    def _words(self, setpoints: Sequence[int]) -> tuple[int, ...]:
        return tuple(setpoints[place] for place in self._places)
