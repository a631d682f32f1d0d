"""Timing common to drives and the outputs of other nodes: how long their words take."""

from __future__ import annotations

from typing import Final

from bridge.command.worst_case import Wire, sync_wait_ms, takeover_ms
from bridge.config import BusTable

_ASYNCHRONOUS: Final = 255


class Commanded:
    """Times are in seconds unless the name says otherwise."""

    def __init__(self, bus: BusTable) -> None:
        self.bus = bus
        self.rpdo_type = _ASYNCHRONOUS
        """Transmission type of the RPDO with the control word; known after boot-up."""
        self.wire = Wire()
        """What is predicted of its bus."""
        self.burst_s = bus.deadman_ms / 1000 + bus.rpdo_period_s
        """How far ahead the bus may have been told what to send."""

    @property
    def rpdo_period_ms(self) -> int:
        """How long a new word may be on its way: until its frame, and until SYNC takes that over."""
        return round(1000 * self.bus.rpdo_period_s) + sync_wait_ms(self.bus, self.rpdo_type)

    @property
    def takeover_s(self) -> float:
        """How long a stopped word may wait for SYNC: while its node is in Operational."""
        return takeover_ms(self.bus, self.rpdo_type) / 1000
