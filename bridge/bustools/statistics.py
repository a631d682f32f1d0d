"""Counts of each identifier on a bus, and its share of the bus's time. Sans-IO."""

from __future__ import annotations

from dataclasses import dataclass

from bridge.can.wirebits import exact_bits
from bridge.canopen.frame import Frame


@dataclass(slots=True)
class Count:
    """One identifier. Gaps are seconds between two frames; 0.0 until there are two."""

    can_id: int
    label: str
    frames: int = 0
    bits: int = 0
    first: float = 0.0
    last: float = 0.0
    shortest_s: float = 0.0
    longest_s: float = 0.0

    @property
    def mean_s(self) -> float:
        return (self.last - self.first) / (self.frames - 1) if self.frames > 1 else 0.0


class Statistics:
    """Counts by identifier. Remote frames are counted apart from the data that they ask for."""

    def __init__(self, bitrate: int) -> None:
        self._bitrate = bitrate
        self._counts: dict[int, Count] = {}

    def on_frame(self, frame: Frame, label: str) -> None:
        count = self._counts.get(frame.can_id)
        if count is None:
            count = self._counts[frame.can_id] = Count(frame.can_id, label, first=frame.time)
        else:
            gap_s = frame.time - count.last
            count.shortest_s = gap_s if count.frames == 1 else min(count.shortest_s, gap_s)
            count.longest_s = max(count.longest_s, gap_s)
        count.frames += 1
        count.bits += exact_bits(frame)
        count.last = frame.time

    def counts(self) -> list[Count]:
        """Counts by identifier, lowest first: the order in which they win the bus."""
        return [self._counts[can_id] for can_id in sorted(self._counts, key=lambda i: (i & 0x7FF, i))]

    def load_percent(self, count: Count, seconds: float) -> float:
        """Load in percent that this identifier caused in ``seconds``."""
        return 100 * count.bits / (self._bitrate * seconds) if seconds > 0 else 0.0
