"""NMT commands and SDO writes that cannot be the bridge's, by what the bridge promises not to do. Sans-IO.

The bus does not say who sent a frame. But the bridge stops a node's drives before it sends the node anything
by NMT and makes its outputs safe (docs/explanation/dead-man-chain.md), starts a node once, knows no nodes but
the site's, asks one question of an SDO server at a time, and leaves what a node hears and watches, and what
its outputs are by, alone while the node is told to run."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Final

START, STOP, PRE_OPERATIONAL, RESET, RESET_COMMUNICATION = 0x01, 0x02, 0x80, 0x81, 0x82
"""NMT commands (CiA 301 §7.2.8.3.1)."""
_COMMANDS: Final = {
    START: "start",
    STOP: "stop",
    PRE_OPERATIONAL: "pre-operational",
    RESET: "reset",
    RESET_COMMUNICATION: "reset of communication",
}
TAKES_OUT: Final = (STOP, PRE_OPERATIONAL, RESET, RESET_COMMUNICATION)
"""NMT commands after which a node sends no TPDOs and takes no RPDOs."""
_STARTS_S: Final = 2.0
_MOST_STARTS: Final = 3
_HEARD: Final = (
    range(0x1005, 0x1008),
    range(0x1014, 0x1018),
    range(0x1200, 0x1C00),
    range(0x1F80, 0x1F81),
    range(0x6040, 0x6041),
)
"""Objects for communication and control of a node: SYNC, the identifier of emergencies, guarding and
heartbeats, SDO and PDO parameters, NMT startup, the control word (CiA 301 §7.5, CiA 402)."""
_WAITED_S: Final = 0.05
"""Longest time in seconds for which a question may have waited for the bus: its time-out runs meanwhile."""
_DOWNLOAD, _UPLOAD, _ABORT = 0x20, 0x40, 0x80
"""Command specifiers in the three highest bits (CiA 301 §7.2.4.3)."""


class Services:
    """Judge of the services on one bus. ``nodes`` has the SDO time-out of each node of the site in s;
    ``told_to_run`` gives what of a node is told to run at a time, in words, or nothing; ``written`` has the
    objects that move outputs of a node or make them safe."""

    def __init__(
        self,
        nodes: Mapping[int, float],
        told_to_run: Callable[[int, float], str],
        written: Mapping[int, frozenset[int]],
    ) -> None:
        self._nodes = nodes
        self._told_to_run = told_to_run
        self._written = written
        self._starts: dict[int, deque[float]] = {node: deque() for node in nodes}
        self._asked: dict[int, float] = {}
        """Time of the question without an answer yet, by node."""
        self._stopped: set[int] = set()
        """Nodes that were told to stop last: they answer no questions (CiA 301 §7.3.2.2.4)."""

    @property
    def identifiers(self) -> set[int]:
        return (
            {0x000, *(base + node for node in self._nodes for base in (0x580, 0x600))}
            if self._nodes
            else set()
        )

    def on_frame(self, can_id: int, data: bytes, at: float) -> str:
        """Take a frame. Returns a sentence where it is a foreign sender's, else ""."""
        if can_id == 0x000:
            return self._on_nmt(data, at)
        node = can_id & 0x7F
        if can_id < 0x600:
            self._asked.pop(node, None)
            return ""
        return self._on_request(node, data, at)

    def _on_nmt(self, data: bytes, at: float) -> str:
        if len(data) < 2 or data[0] not in _COMMANDS:
            return "NMT command that there is not: somebody else sends it"
        what, node = _COMMANDS[data[0]], data[1]
        if node and node not in self._nodes:
            return f"NMT {what} of node {node}, which the site does not have: somebody else sends it"
        for one in (node,) if node else tuple(self._nodes):
            self._on_told(one, data[0])
            if told := self._told_to_run(one, at):
                return f"NMT {what} of node {one} while {told}: somebody else sends it"
            if data[0] == START and self._starts_too_often(one, at):
                return f"NMT start of node {one} again and again: somebody else sends it"
        return ""

    def _on_told(self, node: int, command: int) -> None:
        if command == STOP:
            self._stopped.add(node)
        else:
            self._stopped.discard(node)
        if command in (STOP, RESET, RESET_COMMUNICATION):
            self.on_restart(node)

    def on_restart(self, node: int) -> None:
        """Take a node that answers nothing any more of what it was asked before."""
        self._asked.pop(node, None)

    def _starts_too_often(self, node: int, at: float) -> bool:
        starts = self._starts[node]
        starts.append(at)
        while starts[0] < at - _STARTS_S:
            starts.popleft()
        if len(starts) <= _MOST_STARTS:
            return False
        starts.clear()
        return True

    def _on_request(self, node: int, data: bytes, at: float) -> str:
        if len(data) < 4:
            return ""
        kind, index = data[0] & 0xE0, int.from_bytes(data[1:3], "little")
        if kind == _ABORT:
            self._asked.pop(node, None)
        if kind not in (_DOWNLOAD, _UPLOAD):
            return ""
        asked_at = self._asked.get(node)
        if node not in self._stopped:
            self._asked[node] = at
        if asked_at is not None and at - asked_at < self._nodes[node] - _WAITED_S:
            return f"two SDO requests to node {node} at once: somebody else sends one of them"
        is_heard = index in self._written.get(node, ()) or any(index in part for part in _HEARD)
        if kind == _DOWNLOAD and is_heard and (told := self._told_to_run(node, at)):
            return f"SDO write of {index:04X}h to node {node} while {told}: somebody else sends it"
        return ""
