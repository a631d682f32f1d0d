"""Reactions to a controller that has fallen silent: the values of ``on_expiry``, and what each of them means.

Code that applies, prints or checks one reads its row here. A reaction that consists of other stops is one
more row, and its name in each language (``bridge.text``).
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Final, Literal, NamedTuple

Reaction = Literal["disable_voltage", "quick_stop", "stop", "silence", "hold"]


class StopKind(StrEnum):
    """Stop for which every family has a control word."""

    STOP = "stop"
    QUICK_STOP = "quick stop"
    DISABLE_VOLTAGE = "disable voltage"


class ReactionRule(NamedTuple):
    """One reaction: ``stop`` is sent until the acknowledge, after ``ramp`` where there is one: that ends when
    the drive is at rest, or after its time."""

    stop: StopKind = StopKind.STOP
    ramp: StopKind | None = None
    is_silent: bool = False
    """Nothing is sent, as long as the drive stops by that; ``stop`` is what breaks the silence."""
    holds: bool = False
    """The last words are sent on, and no stop at all."""

    @property
    def first(self) -> StopKind:
        """Stop that the drive gets at the trip."""
        return self.ramp or self.stop

    @property
    def sends_stop(self) -> bool:
        """Whether a word of the bridge stops the drive, and not its own supervision."""
        return not self.is_silent and not self.holds


REACTIONS: Final[Mapping[Reaction, ReactionRule]] = {
    "disable_voltage": ReactionRule(StopKind.DISABLE_VOLTAGE),
    "quick_stop": ReactionRule(StopKind.DISABLE_VOLTAGE, ramp=StopKind.QUICK_STOP),
    "stop": ReactionRule(StopKind.STOP),
    "silence": ReactionRule(is_silent=True),
    "hold": ReactionRule(holds=True),
}
