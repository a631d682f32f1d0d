"""The time of an explored state, without clocks: each instant is now, or some time later.

The leg compares times with the present and adds to it, and does nothing else with them. So of an instant
that lies ahead it matters only with which others it coincides: any of them may be the next. That lets in
orders that no clock makes, and leaves none out that one could.
"""

from __future__ import annotations

from typing import Final

from bridge.command.leg.state import LegState
from tests.support.leg_seen import Seen, Times

NOW: Final = 1000.0
_LATER: Final = 1e6
"""The first instant that lies ahead; the next is one second after it, and so on."""

State = tuple[LegState, Seen]
Instants = tuple[float | None, ...]
_NEVER: Final = (None,) * 4
_ORACLES: Final = len(Times._fields)


def _instants(leg: LegState, seen: Seen) -> Instants:
    _, _, lease_until, absent_until, stopped_until, quiet_until, alive_until = leg.owner
    _, heard_at, deadline, _ = leg.timer
    start = leg.start
    started = _NEVER if start is None else (start.until, start.settles_at, start.believed_at, start.leaves_at)
    order = leg.order
    return (
        lease_until,
        absent_until,
        stopped_until,
        heard_at,
        deadline,
        leg.trip.ramps_until,
        leg.trip.silent_from,
        leg.trip.burst_until,
        order.deadline,
        order.rises_at,
        leg.pulse_until,
        *started,
        quiet_until,
        alive_until,
        *seen.times,
    )


def _with(leg: LegState, seen: Seen, instants: Instants) -> State:
    owner, timer, start, order = leg.owner, leg.timer, leg.start, leg.order
    lease_until, absent_until, stopped_until, heard_at, deadline = instants[:5]
    if start is not None:
        start = start._replace(
            until=instants[11] or NOW,
            settles_at=instants[12],
            believed_at=instants[13],
            leaves_at=instants[14],
        )
    leg = leg._replace(
        owner=type(owner)(
            owner.identity, owner.lease_s, lease_until, absent_until, stopped_until, *instants[15:17]
        ),
        timer=type(timer)(timer.timeout_ms, heard_at, deadline, timer.is_overdue),
        trip=type(leg.trip)(instants[5], instants[6], instants[7], leg.trip.burst),
        order=order._replace(deadline=instants[8], rises_at=instants[9]),
        pulse_until=instants[10],
        start=start,
    )
    return leg, seen._replace(times=Times(*instants[17:]))


_timeless: dict[Instants, Instants] = {}


def timeless(leg: LegState, seen: Seen) -> State:
    """The same state as any other in which the same instants coincide."""
    instants = _instants(leg, seen)
    found = _timeless.get(instants)
    if found is None:
        places: dict[float, float] = {}
        for instant in instants:
            if instant is not None and instant > NOW:
                places.setdefault(instant, _LATER + len(places))
        found = tuple(None if it is None else places.get(it, NOW) for it in instants)
        _timeless[instants] = found
    return (leg, seen) if found == instants else _with(leg, seen, found)


def ahead(state: State) -> list[float]:
    """The instants that lie ahead of a timeless state."""
    return sorted({instant for instant in _instants(*state) if instant is not None and instant > NOW})


def come(state: State, due: list[float]) -> State:
    """These are now. The one order that would not only be odd but impossible is left out: with its life sign
    an owner's time is up at the latest."""
    instants = _instants(*state)
    if state[0].owner.alive_until in due:
        due = [*due, *(it for it in (state[0].timer.deadline, state[1].times.deadline) if it is not None)]
    return _with(*state, tuple(NOW if instant in due else instant for instant in instants))
