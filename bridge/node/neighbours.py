"""Interfaces by which a node and its network see each other."""

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
        """True if it is operational, or booted and waiting to be started."""
        ...

    @property
    def is_operational(self) -> bool: ...

    @property
    def is_on_its_way(self) -> bool:
        """True while it is booted, or before it has been looked for."""
        ...

    @property
    def is_out_of_service(self) -> bool:
        """True if an operator has switched it off or stopped it: nobody waits for it."""
        ...

    def next_deadline(self) -> float | None: ...


class Neighbours(Protocol):
    """The network as one of its nodes needs it."""

    def touched(self, node: Neighbour) -> None:
        """Look at the node's frames and deadlines: more than a sign of life has happened to it."""
        ...

    def started_anew(self, node: Neighbour) -> None:
        """Take the node's boot-up message: what was sent to it before is forgotten."""
        ...

    def may_start(self, node: Neighbour) -> bool: ...

    def stop_others(self, node: Neighbour, why: Text, now: float) -> None: ...

    def duplicate(self, node: Neighbour, sign: DuplicateSign, now: float) -> None: ...
