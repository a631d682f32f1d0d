"""The effect of writing an object: what it does to what the node moves, and so who writes it and when."""

from __future__ import annotations

from enum import Enum, auto
from typing import Final


class Effect(Enum):
    """Effects in the order in which they are looked for: the first that an object has counts."""

    COMMANDS = "command"
    """Moves, switches or enables something: process data, which the owner alone commands."""
    BUS = "bus"
    """The communication that the bridge supervises: the site file's."""
    SHAPES = "shapes"
    """Polarity, offset or scaling of an output: an output changes with it at once, and its safe value
    becomes another one."""
    SUPERVISES = "communication"
    """Decides who commands the node, or what the node does when the bridge falls silent."""
    MAKES_SAFE = "safe"
    """Decides how something stops, or what it becomes when it is made safe."""
    MAY_MOVE = "may_move"
    """Unknown: an RPDO can carry it, or it is not described at all."""
    OPERATES = "while_enabled"
    """Changes a movement that goes on, and begins none."""
    SETTING = ""

    @property
    def level(self) -> str:
        """``Parameter.protected`` as clients see it; ``command`` for what is never written."""
        return Effect.COMMANDS.value if self in _NEVER else self.value


_NEVER: Final = frozenset((Effect.COMMANDS, Effect.BUS, Effect.SHAPES))
_ENGINEERS: Final = frozenset((Effect.SUPERVISES, Effect.MAKES_SAFE, Effect.MAY_MOVE))
_AT_REST: Final = _ENGINEERS | {Effect.OPERATES}


class WriteVerdict(Enum):
    """The answer to who writes an object: ``NOT_AN_ENGINEER`` and ``NOT_AT_REST`` say what is missing."""

    WRITTEN = auto()
    NEVER = auto()
    NOT_AN_ENGINEER = auto()
    NOT_AT_REST = auto()


def judge(effect: Effect, *, is_engineer: bool, is_moving: bool) -> WriteVerdict:
    """Whether an object with this effect is written as a parameter: the table of
    ``docs/reference/parameters.md``."""
    if effect in _NEVER:
        return WriteVerdict.NEVER
    if effect in _ENGINEERS and not is_engineer:
        return WriteVerdict.NOT_AN_ENGINEER
    if effect in _AT_REST and is_moving:
        return WriteVerdict.NOT_AT_REST
    return WriteVerdict.WRITTEN
