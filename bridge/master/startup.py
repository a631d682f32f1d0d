"""Start gate of a bus: mandatory nodes and start order (CiA 302-2, NMT start-up). Pure."""

from __future__ import annotations

from collections.abc import Sequence

from bridge.config.field_types import MandatoryMissing
from bridge.node.neighbours import Neighbour


class StartGate:
    """Gate of one bus: ``judge`` judges all its nodes at once, and ``may_start`` answers by that."""

    def __init__(self, policy: MandatoryMissing, nodes: Sequence[Neighbour]) -> None:
        self._policy = policy
        self._nodes = nodes
        self._mandatory = [node for node in nodes if node.table.mandatory and node.table.enabled]
        self._awaited: list[Neighbour] = []
        self._order = 0
        self.missing: list[str] = []
        """Names of the nodes for which the others wait."""

    def stopped_by(self, node: Neighbour) -> None:
        """Make all nodes wait until this one is ready again: they were stopped because it was lost."""
        if node not in self._awaited:
            self._awaited.append(node)

    def judge(self) -> None:
        self._awaited = [node for node in self._awaited if not (node.is_ready or node.is_out_of_service)]
        required = [] if self._policy == "go_on" else self._mandatory
        absent = [
            node for node in (*required, *self._awaited) if not (node.is_ready or node.is_out_of_service)
        ]
        self.missing = sorted({node.table.name for node in absent})
        coming = [node for node in self._nodes if not node.is_operational and node.is_on_its_way]
        self._order = min((node.table.start_order for node in coming), default=0)

    def may_start(self, node: Neighbour) -> bool:
        """Whether no mandatory node is missing and no node with a lower start order is still booting."""
        return not self.missing and node.table.start_order <= self._order

    @property
    def is_open(self) -> bool:
        return not self.missing
