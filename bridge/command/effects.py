"""Effects of drives and outputs on the plant that they are of."""

from __future__ import annotations

from dataclasses import dataclass, field

from bridge.command.messages.event import EventQueue


@dataclass(slots=True)
class Effects:
    """Effects of drives and outputs, collected until their plant applies them. Times are monotonic seconds,
    and names those of the commanded ones."""

    events: EventQueue
    settled: dict[str, float] = field(default_factory=dict[str, float])
    """Those of which more has changed than the status word, and when."""
    due: dict[str, None] = field(default_factory=dict[str, None])
    """Those that may have an earlier deadline than they have given."""
    stop_due: float | None = None
    """Time at which the first stop was due of the drives that have tripped; None where none has."""

    def tripped(self, due: float) -> None:
        """The watchdog of a drive has tripped, which was due then."""
        self.stop_due = due if self.stop_due is None else min(due, self.stop_due)
