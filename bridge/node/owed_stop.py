"""The stop that the bridge owes a node for what it has enabled there. Sans-IO.

Many things silence the bridge towards a node: another bridge, a lost bus, a command, a boot-up. None of them
may come before the stop, so the debt is kept apart from the node's state, and whoever ends the sending asks
here.
"""

from __future__ import annotations

from bridge.command.commanded import Commanded, has_followed, is_enabling
from bridge.command.node import Node


class OwedStop:
    """Debt that begins with the first word that enables a drive or an output. It ends when that is known to
    follow its stop, when the node has restarted, or when stopped words and an NMT stop have gone out."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._enabled: set[Commanded] = set()

    def note(self) -> None:
        """Note the channels' output, which is about to be repeated on the bus."""
        for one in self._node.commanded:
            if is_enabling(one):
                self._enabled.add(one)
            elif one in self._enabled and has_followed(one):
                self._enabled.discard(one)

    @property
    def is_open(self) -> bool:
        """True if something may still run as the bridge has told it to."""
        return any(is_enabling(one) or not has_followed(one) for one in self._enabled)

    def settle(self) -> None:
        """Settle the debt: the node has had its stop, or has restarted."""
        self._enabled.clear()
