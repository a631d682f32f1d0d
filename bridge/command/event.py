"""Things that happened and that people want to know: trips, lost nodes, refused writes."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Kind(StrEnum):
    WATCHDOG = "watchdog"
    EMERGENCY = "emergency"
    NODE_LOST = "node_lost"
    NODE_BACK = "node_back"
    REFUSED = "refused"
    OWNER = "owner"
    BUS = "bus"
    CONFIGURATION = "configuration"


@dataclass(frozen=True, slots=True)
class Event:
    """``source`` is a drive, a node or a bus by its name in the site; ``severity`` is that of OPC UA
    (1 … 1000, Part 5 §6.4.2); ``time`` is monotonic."""

    time: float
    kind: Kind
    source: str
    severity: int
    message: str
