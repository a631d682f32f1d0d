"""The cells of the leg's table that cannot occur, each with the reason.

The exploration fails where one of them occurs, and where another does not.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from bridge.command.leg.state import ANY_TRIP, STARTING, UNHEARD, Stage
from bridge.command.leg.table import Stimulus

_S, _E = Stage, Stimulus
_IDLE: Final = frozenset(Stage) - STARTING
_REACTING: Final = frozenset((_S.RAMPING, _S.TRIPPED, _S.SILENCED, _S.BURST))
_LED: Final = frozenset((_S.SETTLING, _S.BRAKING, _S.LEAVING, _S.LEADING))
_EXPIRED: Final = (_E.EXPIRED_STOP, _E.EXPIRED_RAMP, _E.EXPIRED_SILENCE, _E.EXPIRED_HOLD)
_STARTS: Final = (_E.START_REFUSED, _E.START_ENABLED, _E.START_STOPPING, _E.START_UNHEARD, _E.START_BRAKING)

_REASONS: Final[tuple[tuple[str, Iterable[Stimulus], Iterable[Stage]], ...]] = (
    ("a watchdog that has tripped does not trip again", _EXPIRED, ANY_TRIP),
    (
        "any start is refused while the way is closed or until a trip is acknowledged",
        _STARTS,
        {_S.CLOSED, *ANY_TRIP},
    ),
    ("a drive in fault is not started, and a fault ends a start", [_E.ACKNOWLEDGE_FAULT], STARTING),
    (
        "a drive that is enabled ends its start, and is else stopped or was told nothing yet",
        [_E.START_ENABLED],
        {*Stage} - {_S.ENABLED, _S.CLOSED, *ANY_TRIP},
    ),
    (
        "only an output block goes on by an acknowledge alone, and only from its interlock",
        [_E.RESUME],
        Stage,
    ),
    ("an enabling word is on the bus, so no stop is on its way", [_E.START_STOPPING], [_S.ENABLED, _S.BLIND]),
    ("the drive has been heard, and a node that is back ends the start", [_E.START_UNHEARD], _LED),
    ("what was held is let go as soon as its node is gone", [_E.NODE_BACK], [_S.HELD]),
    ("until it has reported nobody knows of its quick stop", [_E.START_BRAKING], UNHEARD),
    ("only a start has an end that can be overdue", [_E.START_OVERDUE], _IDLE),
    ("a report is waited for in two stages only", [_E.REPORT_OVERDUE], {*Stage} - {_S.ASKING, _S.PREPARED}),
    (
        "a quick stop is waited for only until the drive is led on",
        [_E.BRAKING_OVERDUE],
        {*_IDLE, _S.PREPARED, _S.BLIND, _S.LEADING, _S.LEAVING},
    ),
    ("without a start nobody waits for it", [_E.SAYS_ENABLED, _E.SAYS_BRAKING], _IDLE),
    (
        "only a reaction or a start asks whether the drive stands",
        [_E.SAYS_AT_REST, _E.SAYS_FAULT],
        _IDLE - _REACTING,
    ),
    (
        "a ramp has a limit only as the reaction, and only until the drive rests",
        [_E.RAMP_OVERDUE],
        {*Stage} - {_S.RAMPING, _S.SILENCED, _S.BURST},
    ),
    (
        "nothing but silence is broken, and the same stop does not break it while it is sent",
        [_E.STOP_AGAIN],
        {*Stage} - {_S.SILENCED},
    ),
    ("only a burst has an end", [_E.BURST_OVER], {*Stage} - {_S.BURST}),
    ("silence follows a reaction that stops, once", [_E.SILENCE_DUE], {*Stage} - {_S.RAMPING, _S.TRIPPED}),
)

NEVER: Final = {
    (stage, stimulus): reason
    for reason, stimuli, stages in _REASONS
    for stimulus in stimuli
    for stage in stages
}
