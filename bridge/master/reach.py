"""Whether words reach the bus, and the reason if not: what an answer may call forwarded. Sans-IO."""

from __future__ import annotations

from collections.abc import Sequence

from bridge.canopen import nmt
from bridge.command import Commanded
from bridge.master.farewell import Farewell
from bridge.master.mastership import BusMastership
from bridge.node.node_core import BUS_IS_DOWN, NodeCore
from bridge.text import Said, Text


class Reach:
    """Tells each drive, and the outputs of each node, whether its words are repeated on the bus, as
    ``Repeated`` does it (``line.py``)."""

    def __init__(self, nodes: Sequence[NodeCore], mastership: BusMastership, farewell: Farewell) -> None:
        self._nodes = nodes
        self._mastership = mastership
        self._farewell = farewell
        self._is_up = True
        self._of_bus: tuple[bool, bool, tuple[NodeCore, ...]] | None = None

    def on_bus(self, now: float, *, is_up: bool | None = None) -> None:
        """Tell all nodes if the bus, or this bridge's part on it, has changed. ``is_up``: whether the bus
        takes frames."""
        self._is_up = self._is_up if is_up is None else is_up
        of_bus = self._is_up, self._mastership.acts(), self._farewell.awaiting
        if of_bus != self._of_bus:
            self._of_bus = of_bus
            self.tell(self._nodes, now)

    def tell(self, nodes: Sequence[NodeCore], now: float) -> None:
        for node in nodes:
            why = self._why_not(node)
            for one in node.node.commanded:
                one.channel.on_sending(why or _why_left_out(node, one), now)

    def _why_not(self, node: NodeCore) -> Said:
        """Reason why no words go to this node; empty where they do."""
        if not self._is_up:
            return BUS_IS_DOWN
        if not self._mastership.acts() and node not in self._farewell.awaiting:
            return self._mastership.why_not
        if node.sends_process_data:
            return ""
        if node.is_held and node.told is not None:
            command, state = nmt.command_name(node.told), Text.word("node_state", node.state.value)
            return Text.of("unsent.told", state=state, command=command)
        return _no_words(node)


def _why_left_out(node: NodeCore, one: Commanded) -> Said:
    """Reason why nothing is sent to ``one`` though its node gets words; empty where it is."""
    return "" if node.wire.carries(one) else _unbooted(node) or node.wire.why_left_out(one)


def _unbooted(node: NodeCore) -> Said:
    return "" if node.is_operational else _no_words(node)


def _no_words(node: NodeCore) -> Text:
    return Text.of("unsent.no_words", state=Text.word("node_state", node.state.value))
