"""Events of the judge of one drive's stops. Times are monotonic seconds."""

from __future__ import annotations

from typing import NamedTuple

from bridge.command.stop_check.state import Bounds, Says, Sent


class Sends(NamedTuple):
    """Another meaning of the word that is to be on the bus from now on."""

    sent: Sent


class HandedOver(NamedTuple):
    """The stop that was to be sent has been handed to the bus by ``now``."""

    now: float
    bounds: Bounds


class NodeOperational(NamedTuple):
    """The node is in operation, or is not."""

    is_there: bool


class CutOff(NamedTuple):
    """The bridge takes the node out of operation, and its stop is on the bus: most drives will not say any
    more whether they follow. Comes before the ``NodeOperational`` that says so."""

    now: float
    bounds: Bounds


class NodeStopped(NamedTuple):
    """The node has said that it is in a state in which its drives do not run."""

    now: float


class NodeRestarted(NamedTuple):
    """The node has started anew, and is not in operation."""


class TelegramGap(NamedTuple):
    """A telegram of the drive has come ``at`` that time, after a pause longer than its deadline. What it says
    comes after this."""

    at: float


class StatusChange(NamedTuple):
    """The drive's status word has another meaning now, by a telegram received ``at``."""

    says: Says
    at: float


class TelegramHeard(NamedTuple):
    """Any telegram, after the ``StatusChange`` where it brings one. ``speed`` is in any unit, None where it
    tells none."""

    at: float
    speed: float | None


class TimePassed(NamedTuple):
    """It is ``now``, and the bus has been drained. ``heard_at`` is when the drive's last telegram was
    received; ``pause_s`` is the longest regular pause between two, None where it sends changes alone: silence
    means that nothing has changed."""

    now: float
    heard_at: float | None
    pause_s: float | None


Event = (
    Sends
    | HandedOver
    | NodeOperational
    | CutOff
    | NodeStopped
    | NodeRestarted
    | TelegramGap
    | StatusChange
    | TelegramHeard
    | TimePassed
)
