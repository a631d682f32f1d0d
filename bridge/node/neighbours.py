"""What a node and its network are to each other."""

from __future__ import annotations

from typing import Protocol

from bridge.canopen.duplicate import DuplicateSign
from bridge.config import NodeTable
from bridge.text import Text


class Neighbour(Protocol):
    """A node as the others of its bus see it."""

    @property
    def table(self) -> NodeTable: ...

    @property
    def is_ready(self) -> bool:
        """Operational, or booted and waiting to be started."""
        ...

    @property
    def is_operational(self) -> bool: ...

    @property
    def is_on_its_way(self) -> bool:
        """Being booted, or not asked yet."""
        ...

    @property
    def is_out_of_service(self) -> bool:
        """An operator has switched it off or stopped it: nobody waits for it."""
        ...

    def next_deadline(self) -> float | None: ...


class Neighbours(Protocol):
    """The network as one of its nodes needs it."""

    def touched(self, node: Neighbour) -> None:
        """Something happened to the node beyond a sign of life: look at its frames and deadlines."""
        ...

    def started_anew(self, node: Neighbour) -> None:
        """Its boot-up message has come: what was sent to it before is forgotten."""
        ...

    def may_start(self, node: Neighbour) -> bool: ...

    def stop_others(self, node: Neighbour, why: Text, now: float) -> None: ...

    def duplicate(self, node: Neighbour, sign: DuplicateSign, now: float) -> None: ...

    def is_taken(self, node: Neighbour, cob_id: int) -> bool:
        """Whether another node of the bus has something on this identifier."""
        ...

    def is_foreign(self, node: Neighbour, cob_id: int) -> bool:
        """Whether it is that of another node, or will be by the site's files."""
        ...
