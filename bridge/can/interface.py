"""CAN bus as the master needs it, whatever hardware is behind it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from bridge.can.burstend import Burst
from bridge.can.errorframe import ControllerState as ControllerState
from bridge.can.errorframe import describe
from bridge.canopen.frame import Frame
from bridge.text import Said


@dataclass(slots=True)
class BusStatus:
    """Condition and counters of one bus; the counters only grow."""

    state: ControllerState = ControllerState.OK
    outages: int = 0
    """Number of times that everything to be sent has been dropped: bus-off, error-passive, down."""
    tx_errors: int = 0
    rx_errors: int = 0
    frames_lost: int = 0
    frames_received: int = 0
    frames_expired: int = 0
    bits: int = 0
    """All bits that have passed on the bus, everybody's, as far as the bus can know."""
    error_frames: int = 0
    bursts_refused: str = ""
    """Reason why the kernel takes no bursts at present, so that a timer of ours sends them; empty where it
    does."""
    _last_error: tuple[int, bytes] | Said = ""

    def note_error(self, error: tuple[int, bytes] | Said) -> None:
        """The latest trouble: identifier and data of an error frame, or a sentence."""
        self._last_error = error

    @property
    def last_error(self) -> Said:
        """The latest trouble, empty where there was none."""
        # Put into words only when somebody looks: a broken wire gives thousands of them a second.
        return describe(*self._last_error) if isinstance(self._last_error, tuple) else self._last_error


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

    def watch(self, can_ids: frozenset[int]) -> None:
        """These 11-bit identifiers are ours alone: give what others send on them by ``take_foreign``."""
        ...

    def take_foreign(self, now: float, *, at_once: bool = False) -> list[Frame]:
        """Frames of others on the watched identifiers, oldest first. A frame of our own is never among them;
        one of another's that is like ours may be missing, and one that has just come may be given by a later
        call, unless ``at_once``."""
        ...

    def drain(self, now: float) -> list[Frame]:
        """Everything that has arrived, oldest first, each with the time of its reception."""
        ...

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        """Send ``frame`` now, or as soon as there is room, but never after ``deadline``."""
        ...

    def burst(self, burst: Burst, now: float, *, at_once: bool = False) -> None:
        """Start or renew a burst. Where its identifier is accepted, its frames come back by ``drain`` with
        the time at which they were sent.

        Calling it again for the same identifier replaces the data and refills the count without moving
        the phase; ``at_once`` sends the frame immediately as well. A burst ends unless it is renewed: that is
        the dead-man's handle (``docs/explanation/dead-man-chain.md``).
        """
        ...

    def end_burst(self, can_id: int) -> None:
        """End the burst of this identifier."""
        ...

    def next_deadline(self) -> float | None:
        """Time at which ``on_time`` has to be called next, or None."""
        ...

    def on_time(self, now: float) -> None:
        """Do what is due: bursts that no kernel sends for us, frames that waited for room, reopening."""
        ...

    def close(self) -> None: ...
