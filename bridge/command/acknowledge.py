"""When a controller acknowledges: edges in its own telegrams, whatever the bridge sent in between
(``docs/explanation/dead-man-chain.md``). Pure."""

from __future__ import annotations

from bridge.command.request import Identity


class AcknowledgeEdges:
    """The acknowledge bit and the acknowledge register as one drive's owner has written them.

    ``is_set`` is the bit of the owner's last control word, None where it has written none since it owns the
    drive: its first word is no edge, whatever it holds.
    """

    __slots__ = ("_pressed_by", "is_set")

    def __init__(self) -> None:
        self.is_set: bool | None = None
        self._pressed_by: Identity | None = None
        """Whose last telegram had 1 in the acknowledge register; kept after the owner has gone."""

    def on_bit(self, *, is_set: bool) -> bool:
        """A control word of the owner; True for an edge."""
        is_edge = is_set and self.is_set is False
        self.is_set = is_set
        return is_edge

    def on_register(self, identity: Identity, *, is_set: bool) -> bool:
        """A telegram that says what the register holds; True where that is a 1 after none."""
        was_set = identity.is_same(self._pressed_by)
        if is_set:
            self._pressed_by = identity
        elif was_set:
            self._pressed_by = None
        return is_set and not was_set

    def on_leave(self) -> None:
        """The owner goes."""
        self.is_set = None
