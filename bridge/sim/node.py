"""The interface of simulated nodes to the shell."""

from __future__ import annotations

from typing import Protocol

from bridge.canopen.frame import Frame


class SimulatedNode(Protocol):
    """A sans-IO core: frames and time in, frames out. Times are seconds of one monotonic clock."""

    @property
    def node_id(self) -> int: ...

    @property
    def heard(self) -> frozenset[int]:
        """The identifiers that ``on_frame`` evaluates at present."""
        ...

    def start(self, now: float) -> None:
        """Power on."""
        ...

    def on_frame(self, frame: Frame, now: float) -> None: ...

    def on_time(self, now: float) -> None: ...

    def next_deadline(self) -> float | None:
        """When ``on_time`` has to be called next, or None."""
        ...

    def take_frames(self) -> list[Frame]:
        """What the node has to send, oldest first."""
        ...
