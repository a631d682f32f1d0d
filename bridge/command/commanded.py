"""Drives and outputs as their owners command them, and the times that their words take."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Protocol

from bridge.command.channel import Channel
from bridge.command.stop_check.state import LastStop, StopVerdict
from bridge.command.worst_case import Wire, sync_wait_ms, takeover_ms
from bridge.config import BusTable
from bridge.config.model import CommandedTable
from bridge.text import Said, Text

_ASYNCHRONOUS: Final = 255


class StopCheck(Protocol):
    """Outcome of the last stop of a drive or of outputs, as far as it is known."""

    @property
    def follows(self) -> bool:
        """No stop has been ignored since the last one that was followed."""
        ...

    @property
    def last_stop(self) -> LastStop: ...

    @property
    def is_judged(self) -> bool:
        """A stop is on the bus, and the node is in operation."""
        ...

    @property
    def awaits_sending(self) -> bool:
        """A stop is to be sent, and has not been handed to the bus yet."""
        ...

    def sent_for_s(self, now: float) -> float:
        """Time for which the stop has been on the bus; 0 if there is none, or that is not known."""
        ...


class Commanded(Protocol):
    """A drive, or the outputs of a node without drives: a channel with an owner, a stop that is judged,
    points in the image. Times are monotonic seconds."""

    @property
    def name(self) -> str: ...

    @property
    def node_name(self) -> str: ...

    @property
    def table(self) -> CommandedTable: ...

    @property
    def channel(self) -> Channel: ...

    @property
    def stop_check(self) -> StopCheck: ...

    @property
    def burst_s(self) -> float:
        """Time in seconds for which the bus may have been told in advance what to send."""
        ...

    @property
    def takeover_s(self) -> float:
        """Longest time in seconds that a stopped word waits for SYNC."""
        ...

    @property
    def is_heard(self) -> bool:
        """It reports by itself what it does, and is heard."""
        ...

    @property
    def unproven(self) -> Said | None:
        """Reason why nothing more will be known of its last stop; None while that may be."""
        ...

    @property
    def says(self) -> Text:
        """Words for what it does now, beside a stop."""
        ...

    def why_ignored(self, verdict: StopVerdict, took_s: float) -> Text:
        """Words for a stop that it has ignored, after ``took_s``."""
        ...

    def on_wire(self, wire: Wire, now: float) -> None:
        """Take over the predicted delays of its bus."""
        ...

    def on_own_supervision_changed(self, why: Text, now: float) -> None:
        """Forget its own reaction to a silent bridge: an object that decides it was written."""
        ...

    def on_handed_over(self, now: float) -> None:
        """Begin the bound of its stop: the output of the channel has been handed to the bus."""
        ...

    def on_time(self, now: float) -> Sequence[StopVerdict]:
        """Do all that is due by ``now``. Returns the verdicts on stops that have ended."""
        ...

    def next_deadline(self, now: float) -> float | None:
        """Time of the next ``on_time``; None for never."""
        ...

    def refresh(self, now: float) -> None:
        """Bring all points up to date, after something has changed."""
        ...

    def look(self, now: float) -> None:
        """Bring to ``now`` what changes by itself."""
        ...


def has_followed(one: Commanded) -> bool:
    """The last stop is known to be followed."""
    return one.stop_check.last_stop is LastStop.FOLLOWED


def is_enabling(one: Commanded) -> bool:
    """The words that are sent enable it."""
    output = one.channel.output
    return not output.silent and one.channel.words.enables(output.words[0])


class WordTiming:
    """Times that the words of a drive or of outputs take, in seconds unless the name says otherwise."""

    def __init__(self, bus: BusTable) -> None:
        self.bus = bus
        self.rpdo_type = _ASYNCHRONOUS
        """Transmission type of the RPDO with the control word; known after boot-up."""
        self.wire = Wire()
        """Predicted delays of its RPDOs on the bus."""
        self.burst_s = bus.deadman_ms / 1000 + bus.rpdo_period_s
        """Longest time for which the bus may have been told in advance what to send."""

    @property
    def rpdo_period_ms(self) -> int:
        """Longest time in ms that a new word is on its way: until its frame, and until SYNC takes it over."""
        return round(1000 * self.bus.rpdo_period_s) + sync_wait_ms(self.bus, self.rpdo_type)

    @property
    def takeover_s(self) -> float:
        """Longest time that a stopped word waits for SYNC, while its node is in Operational."""
        return takeover_ms(self.bus, self.rpdo_type) / 1000
