"""Whose words reach the bus, and why others do not: what an answer may call forwarded. Sans-IO."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from bridge.canopen import nmt
from bridge.command import Drive
from bridge.command.outputs import Outputs
from bridge.master.farewell import Farewell
from bridge.master.mastership import BusMastership
from bridge.node.node import NodeCore

_BUS_IS_DOWN: Final = "the bus is down"


class Reach:
    """Tells each drive, and the outputs of each node, whether what it puts out is repeated on the bus; as
    ``Repeated`` does (``line.py``)."""

    def __init__(self, nodes: Sequence[NodeCore], mastership: BusMastership, farewell: Farewell) -> None:
        self._nodes = nodes
        self._mastership = mastership
        self._farewell = farewell
        self._is_up = True
        self._of_bus: tuple[bool, bool, tuple[NodeCore, ...]] | None = None

    def on_bus(self, now: float, *, is_up: bool | None = None) -> None:
        """The state of the bus, or this bridge's part on it, may be another. ``is_up``: it takes frames."""
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

    def _why_not(self, node: NodeCore) -> str:
        """Why no words go to this node; empty where they do."""
        if not self._is_up:
            return _BUS_IS_DOWN
        if not self._mastership.acts() and node not in self._farewell.awaiting:
            return self._mastership.why_not
        if node.sends_process_data:
            return ""
        sent = "no words are sent to it"
        if node.is_held and node.told is not None:
            sent = f"NMT {nmt.command_name(node.told)} was sent to it, and no words are"
        return f"the drive's node is {node.state.value}; {sent}"


def _why_left_out(node: NodeCore, one: Drive | Outputs) -> str:
    """Why nothing is sent to this one though its node gets words; empty where it is."""
    if isinstance(one, Outputs):
        return "" if node.wire.outputs else _unbooted(node) or "no RPDO of the node carries its outputs"
    return "" if one.name in node.wire.drives else _unbooted(node) or node.wire.why_left_out(one)


def _unbooted(node: NodeCore) -> str:
    return "" if node.is_operational else f"the drive's node is {node.state.value}; no words are sent to it"
