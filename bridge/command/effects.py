"""Effects of drives and outputs on their plant."""

from __future__ import annotations

from dataclasses import dataclass, field

from bridge.command.messages.event import EventQueue


@dataclass(slots=True)
class Effects:
    """Effects of drives and outputs, by name, until their plant applies them. Times are monotonic seconds."""

    events: EventQueue
    settled: dict[str, float] = field(default_factory=dict[str, float])
    """Drives and outputs of which more has changed than the status word, and when."""
    due: dict[str, None] = field(default_factory=dict[str, None])
    """Drives and outputs that may have an earlier deadline than they have given."""
    stop_due: float | None = None
    """Earliest due time of the stops of drives that have tripped; None where none has."""

    def tripped(self, due: float) -> None:
        """Note that the watchdog of a drive has tripped, which was due then."""
        self.stop_due = due if self.stop_due is None else min(due, self.stop_due)
