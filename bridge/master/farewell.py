"""Last frames on a bus that is left to another bridge: the stops that this one owes. Sans-IO.

They do no harm: the other bridge sees its nodes stop, and its drives have to be enabled anew.
"""

from __future__ import annotations

from collections.abc import Sequence

from bridge.canopen.nmt import NmtCommand
from bridge.node.node_core import NodeCore


class Farewell:
    """Stops owed to the ``nodes`` of one bus."""

    def __init__(self, nodes: Sequence[NodeCore]) -> None:
        self._nodes = nodes
        self.told: list[NodeCore] = []
        """Nodes that get a stop, until that has gone out."""
        self._is_sent = False

    @property
    def is_on(self) -> bool:
        """True while there is something left to send."""
        return bool(self.told)

    @property
    def awaiting(self) -> tuple[NodeCore, ...]:
        """Nodes whose stopped words are repeated, because they take them over with SYNC."""
        return tuple(node for node in self.told if node.leaving.is_due) if self.told else ()

    def begin(self, now: float) -> None:
        """Send a stop to every node that is owed one."""
        self.told = [node for node in self._nodes if node.leaving.owed.is_open]
        self._is_sent = False
        for node in self.told:
            node.leaving.tell(NmtCommand.STOP, now)
            node.was_told(NmtCommand.STOP)

    def bus_is_gone(self) -> None:
        """Drop what was to be sent: it is owed again when the bus is back."""
        self.told.clear()

    def on_time(self, now: float) -> None:
        for node in self.told:
            node.wire.send_put_off(now)

    def on_sending(self, *, has_frames: bool) -> None:
        """Note that frames are taken to be sent. What was taken before has gone out, unless the bus has gone
        since."""
        if self._is_sent and not (has_frames or self.awaiting):
            for node in self.told:
                node.leaving.owed.settle()
            self.told.clear()
        self._is_sent = not self.awaiting

    def next_deadline(self) -> float | None:
        times = (node.wire.put_off.next_deadline() for node in self.told)
        return min((time for time in times if time is not None), default=None)
