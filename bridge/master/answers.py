"""Repeated stops to nodes while an intruder goes on: as often as it speaks, within a share of the bus.
Sans-IO."""

from __future__ import annotations

from typing import Final

from bridge.can.wirebits import longest_bits
from bridge.node.node_core import NodeCore

SHARE: Final = 0.2
"""Share of the bus for these answers: somebody who provokes them must not fill it."""
_AT_ONCE_S: Final = 0.05
"""Time in seconds for which an unused allowance adds up."""
_SPARE_S: Final = 0.001
"""Margin in seconds, so that rounding asks for no round in which nothing may be sent yet."""
_WORD_BYTES: Final = 8
_NMT_BYTES: Final = 2


def answer_bits(identifiers: int) -> int:
    """Bits of the longest answer to one intruding frame: a stopped word on each of these identifiers, and an
    NMT command."""
    return identifiers * longest_bits(_WORD_BYTES) + longest_bits(_NMT_BYTES)


class Answers:
    """Nodes that are to be told again, each once, within the bits that may be used for that. ``bitrate`` in
    bit/s."""

    def __init__(self, bitrate: int) -> None:
        self._bits_per_s = SHARE * bitrate
        self._left = self._most = _AT_ONCE_S * self._bits_per_s
        self._at = float("-inf")
        self._waiting: dict[int, tuple[NodeCore, int]] = {}

    @property
    def are_asked(self) -> bool:
        """True while a node waits to be told."""
        return bool(self._waiting)

    def ask(self, node: NodeCore, identifiers: int) -> None:
        self._waiting[node.table.id] = node, answer_bits(identifiers)

    def take(self, now: float) -> list[NodeCore]:
        """Nodes that may be told now; the others stay."""
        if not self._waiting:
            return []
        if now > self._at:
            self._left = min(self._most, self._left + (now - self._at) * self._bits_per_s)
            self._at = now
        taken: list[NodeCore] = []
        while self._waiting and self._left >= 0:
            node, bits = self._waiting.pop(next(iter(self._waiting)))
            # One that is longer than what is left is owed: else the answer of a large node would never come.
            self._left -= bits
            taken.append(node)
        return taken

    def clear(self) -> None:
        self._waiting.clear()

    def next_deadline(self) -> float | None:
        if not self._waiting:
            return None
        return self._at + max(0.0, -self._left) / self._bits_per_s + _SPARE_S
