"""Taking a node out of operation without leaving its drives running. Sans-IO.

A drive is stopped by its stopped word: NMT stop does not stop those of every family. So the NMT command goes
out when the words have been taken over, and a drive that can no longer tell whether it has stopped is
reported (``command/stop_check/step.py``).
"""

from __future__ import annotations

from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.command.drive_link import NodeState
from bridge.command.node import Node
from bridge.command.worst_case import takeover_ms
from bridge.node.boot import BootMemory
from bridge.node.owed_stop import OwedStop
from bridge.node.wire import NodeWire


class Leaving:
    """Exit of one node from operation."""

    def __init__(self, node: Node, wire: NodeWire, memory: BootMemory) -> None:
        self._node = node
        self._wire = wire
        self._memory = memory
        self._state = NodeState.ABSENT
        self.owed = OwedStop(node)

    @property
    def is_due(self) -> bool:
        """True while an NMT command waits for stopped words to be taken over."""
        return self._wire.put_off.command is not None

    @property
    def is_stopped_by_nmt(self) -> bool:
        """Whether NMT stop stops the node's drives: they do not run in the state Stopped."""
        return self._node.family.family.stopped_by == "stop_node"

    @property
    def takeover_s(self) -> float:
        """Longest time in seconds that stopped words take from the bus to the drives: 0 where they wait for
        no SYNC, or where the node no longer takes any."""
        return self._sync_s if self._takes_words() else 0.0

    def _takes_words(self) -> bool:
        """Whether the node may be in Operational, as far as is known."""
        is_operational = self._wire.error_control.state is NmtState.OPERATIONAL
        return self._state is not NodeState.STOPPED or is_operational

    @property
    def _sync_s(self) -> float:
        known = [takeover_ms(self._node.bus, kind) / 1000 for kind in self._memory.rpdo_types]
        return max((*known, *(one.takeover_s for one in self._node.commanded)), default=0.0)

    def has_told(self, now: float) -> bool:
        """Whether all that gets process data has had stopped words for long enough to take them over."""
        told = [one for one in self._node.commanded if self._wire.carries(one)]
        return all(one.stop_check.sent_for_s(now) >= self.takeover_s for one in told)

    def send(self, command: NmtCommand, now: float, *, at_once: bool = False) -> None:
        """Send an NMT command after which the node takes no words, once it has taken over the stopped ones.
        ``at_once``: it has had them for long."""
        wait_s = 0.0 if at_once else self.takeover_s
        if wait_s or self.is_due:
            self._wire.put_off.begin(command, now, wait_s)
        else:
            self._wire.send_nmt(command)

    def silence(self, now: float, *, only_heard: bool = False) -> None:
        """Cut off the drives, because we take the node out of operation: they are no longer heard and may
        still run. ``only_heard``: the node itself is silent, and nothing is known of a drive that is silent,
        too."""
        for drive in self._node.drives:
            if not only_heard or drive.channel.link.is_fresh(now):
                drive.on_cut_off(now)

    # what happens to the node

    def on_node(self, state: NodeState) -> None:
        """Take over the node's state."""
        self._state = state

    def on_state(self, state: NmtState, now: float) -> None:
        """Take a state that the node has reported."""
        if state is NmtState.OPERATIONAL:
            self._memory.is_at_rest = False
        if state is NmtState.STOPPED and self.is_stopped_by_nmt:
            self._memory.is_at_rest = True
            for drive in self._node.drives:
                drive.stop_check.on_node_stopped(now)

    def on_restart(self) -> None:
        """Drop pending commands and the owed stop: the node has restarted."""
        self.forget()
        self.owed.settle()
        for drive in self._node.drives:
            drive.stop_check.on_restart()

    def forget(self) -> None:
        self._wire.put_off.clear()

    def tell(self, command: NmtCommand, now: float, *, takes_words: bool = False) -> None:
        """Send stopped words on all COB-IDs of the node, then ``command``. ``takes_words``: the node is taken
        to be in Operational, whatever is known of it."""
        self._wire.send_stopped()
        if takes_words and self._sync_s:
            self._wire.put_off.begin(command, now, self._sync_s)
        else:
            self.send(command, now)
