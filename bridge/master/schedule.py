"""Schedule of the nodes of a bus: only those with something to do now cost anything, even of 127."""

from __future__ import annotations

import heapq
from collections.abc import Iterable
from typing import Generic, TypeVar

from bridge.node.neighbours import Neighbour

N = TypeVar("N", bound=Neighbour)


class Schedule(Generic[N]):
    """Deadlines of nodes. One that was put off (each heartbeat does that) is noticed when the old one comes;
    one that was brought forward has to be reported by ``plan``, or by ``touch`` and the next round."""

    def __init__(self, nodes: Iterable[N]) -> None:
        self._nodes = tuple(nodes)
        self._touched: dict[int, None] = dict.fromkeys(range(len(self._nodes)))
        self._places: dict[Neighbour, int] = {node: place for place, node in enumerate(self._nodes)}
        self._planned: list[float | None] = [None] * len(self._nodes)
        self._heap: list[tuple[float, int]] = []

    def touch(self, node: Neighbour) -> None:
        self._touched[self._places[node]] = None

    @property
    def is_touched(self) -> bool:
        return bool(self._touched)

    def take_touched(self) -> list[N]:
        """Touched nodes, each once, in the order in which they were touched."""
        if not self._touched:
            return []
        touched, self._touched = self._touched, {}
        return [self._nodes[place] for place in touched]

    def plan(self, node: Neighbour) -> None:
        """Plan this node by its present deadline."""
        place = self._places[node]
        at, planned = node.next_deadline(), self._planned[place]
        if at is not None and (planned is None or at < planned):
            self._planned[place] = at
            heapq.heappush(self._heap, (at, place))

    def take_due(self, now: float) -> list[N]:
        """Nodes whose deadline may have come; each is touched or planned again by the caller."""
        due: list[N] = []
        heap = self._heap
        while heap and heap[0][0] <= now:
            at, place = heapq.heappop(heap)
            # An entry is stale if the node has got an earlier one since.
            if self._planned[place] == at:
                self._planned[place] = None
                due.append(self._nodes[place])
        return due

    def __len__(self) -> int:
        """Number of entries that it holds, stale ones included."""
        return len(self._heap) + len(self._touched)

    def next_deadline(self) -> float | None:
        if self._touched:
            return float("-inf")
        return self._heap[0][0] if self._heap else None
