"""What the master needs from a CAN bus, whatever hardware is behind it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

from bridge.southbound.bus.frame import Frame


class ControllerState(IntEnum):
    """Fault confinement state of the CAN controller (ISO 11898-1), numbered as the Modbus register."""

    OK = 0
    WARNING = 1
    PASSIVE = 2
    BUS_OFF = 3
    DOWN = 4


@dataclass(slots=True)
class BusStatus:
    """Condition and counters of one bus; the counters only grow."""

    state: ControllerState = ControllerState.OK
    outages: int = 0
    """How often everything that was to be sent has been dropped: bus-off, error-passive, down."""
    tx_errors: int = 0
    rx_errors: int = 0
    frames_lost: int = 0
    frames_received: int = 0
    frames_sent: int = 0
    frames_expired: int = 0
    bits: int = 0


class Bus(Protocol):
    """One end of one CAN bus.

    Nothing here blocks. Times are seconds of the monotonic clock. No method raises for what the
    wire does: a bus that breaks shows it in ``status``.
    """

    @property
    def name(self) -> str: ...

    @property
    def status(self) -> BusStatus: ...

    def open(self, wake: Callable[[], None]) -> None:
        """Start receiving. ``wake`` is called in the event loop when ``drain`` has something to give.

        Raises ``Unavailable`` with the sentence that helps where the bus cannot be opened.
        """
        ...

    def accept(self, can_ids: list[int]) -> None:
        """Receive only these 11-bit identifiers (and error frames). Frees the process of its own echo."""
        ...

    def drain(self, now: float) -> list[Frame]:
        """Everything that has arrived, oldest first, each with the time of its reception."""
        ...

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        """Send ``frame`` now, or as soon as there is room, but never after ``deadline``."""
        ...

    def beat(self, frame: Frame, now: float, period_s: float, count: int, *, at_once: bool = False) -> None:
        """Send ``frame`` every ``period_s`` seconds, ``count`` more times.

        Calling it again for the same identifier replaces the data and refills the count without moving
        the phase; ``at_once`` sends the frame immediately as well. A burst that nobody renews ends by
        itself: that is the dead-man's handle (``docs/explanation/dead-man-chain.md``).
        """
        ...

    def silence(self, can_id: int) -> None:
        """End the burst of this identifier."""
        ...

    def next_deadline(self) -> float | None:
        """When ``on_time`` has to be called next, or None."""
        ...

    def on_time(self, now: float) -> None:
        """Do what is due: bursts that no kernel sends for us, frames that waited for room, reopening."""
        ...

    def close(self) -> None: ...
