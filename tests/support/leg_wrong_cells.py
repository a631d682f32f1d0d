"""Faults to be put into the cells of the leg's table, and the profiles in which each has to show."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, get_args

from bridge.command.leg.state import Stage
from bridge.command.leg.table import TABLE, Cell, Deed, Stimulus
from bridge.config import Reaction
from tests.support.leg_cells import NEVER
from tests.support.leg_words import POSITION

Place = tuple[Stage, Stimulus]

_WORDS: Final = {"owner writes a stop", "owner enables", "drive follows", "everything is due"}
_STARTS: Final = _WORDS | {"owner starts the drive"}
_SAYS: Final = {"drive repeats", "drive says: braking", "drive says: fault", "drive says: inhibited"}
_UNHEARD: Final = {"node lost", "node operational, not heard"}
_OTHERS: Final = {
    "owner resets the fault",
    "stranger stops the drive",
    "owner releases",
    "bridge gap",
    "node lost",
    "drive says: fault",
}
_BUS: Final = {"node lost", "node operational", "bus back"}
_EVERY_STATE: Final = {
    f"drive says: {says}" for says in ("ready", "enabled", "braking", "inhibited", "not ready", "fault")
}
_SETS: Final = {"owner writes a setpoint", "owner's control data are not valid", "owner's stop comes late"}
_IGNORED: Final = {"telegram_downtime_s": -0.1}
_SILENT: Final = {"then_silence_ms": 300}

PROFILES: Final[dict[str, dict[str, Any]]] = {
    **{
        f"words, {reaction}": {"names": _WORDS | _SETS | _OTHERS, "on_expiry": reaction}
        for reaction in get_args(Reaction)
    },
    **{
        f"bus, {reaction}": {
            "names": _WORDS | _BUS | {"bridge gap", "drive says: fault"},
            "on_expiry": reaction,
        }
        for reaction in get_args(Reaction)
    },
    **{
        f"starts, {reaction}": {"names": _STARTS | _SAYS | {"node lost"}, "on_expiry": reaction}
        for reaction in get_args(Reaction)
    },
    **{
        f"starts unheard, {reaction}": {
            "names": _STARTS | _UNHEARD | {"drive repeats", "drive says: braking"},
            "on_expiry": reaction,
        }
        for reaction in get_args(Reaction)
    },
    "starts, telegrams": {"names": _STARTS | _SETS | {"drive says: braking", "drive repeats"}},
    "starts, whatever it says": {
        "names": {"owner starts the drive", "drive repeats", "everything is due"}
        | {
            f"drive says: {says}"
            for says in ("ready", "enabled", "braking", "inhibited", "not ready", "fault")
        }
    },
    "starts unheard, whatever it says": {
        "names": {"owner starts the drive", "drive repeats", "everything is due"}
        | _UNHEARD
        | {
            f"drive says: {says}"
            for says in ("ready", "enabled", "braking", "inhibited", "not ready", "fault")
        }
    },
    "starts, others": {"names": _STARTS | _OTHERS | {"drive says: braking", "drive says: fault"}},
    "starts, bus": {"names": _STARTS | _BUS | {"drive says: braking", "bridge gap"}},
    "starts unheard, telegrams": {"names": _STARTS | _UNHEARD | _SETS},
    "starts unheard, others": {"names": _STARTS | _UNHEARD | _OTHERS},
    "starts unheard, bus": {"names": _STARTS | _UNHEARD | {"bus back", "drive says: braking"}},
    "stop, then silence": {
        "names": _WORDS
        | {"owner writes a setpoint", "owner releases", "stranger stops the drive", "bridge gap"},
        "on_expiry": "stop",
        **_SILENT,
    },
    "silence, telegrams": {"names": _WORDS | _SETS | {"stranger stops the drive"}, "on_expiry": "silence"},
    "quick stop, then silence": {
        "names": _WORDS | {"owner resets the fault", "stranger stops the drive", "drive says: fault"},
        "on_expiry": "quick_stop",
        **_SILENT,
    },
    "quick stop, then silence, bus": {
        "names": _WORDS | _BUS | {"stranger stops the drive"},
        "on_expiry": "quick_stop",
        **_SILENT,
    },
    "started, then silent": {
        "names": _STARTS | {"stranger stops the drive", "node lost", "node operational"},
        "on_expiry": "silence",
    },
    "words that do not reach the bus": {
        "names": _STARTS
        | {"words do not reach the bus", "words reach the bus", "drive says: braking", "drive says: fault"}
    },
    "words that do not reach the bus, unheard": {
        "names": _STARTS | _UNHEARD | {"words do not reach the bus", "words reach the bus"}
    },
    "errors ignored": {
        "names": _STARTS | {"node operational, not heard", "owner resets the fault", "drive says: braking"},
        **_IGNORED,
    },
    "errors ignored, positions": {
        "words": POSITION,
        "names": _STARTS | {"node operational", "drive takes the setpoint", "owner writes a setpoint"},
        **_IGNORED,
    },
    "positions": {
        "words": POSITION,
        "names": _STARTS | {"node lost", "node operational", "process data overdue", "process data back"},
    },
    "positions, hold": {
        "words": POSITION,
        "names": _WORDS | {"process data overdue", "process data back"},
        "on_expiry": "hold",
    },
}
"""Profiles by name, with as few events as the faults need to show."""

DOES_NOTHING: Final = "does nothing"
LEAVES_DEED_OUT: Final = "goes to the next stage and does nothing else"


def wrong_cells(place: Place) -> Iterator[tuple[str, Cell]]:
    """Faults for one cell; none for one that does nothing."""
    stage, _ = place
    after, deed = TABLE[place]
    if (after, deed) == (stage, Deed.NOTHING):
        return
    yield DOES_NOTHING, (stage, Deed.NOTHING)
    if after is not stage and deed is not Deed.NOTHING:
        yield LEAVES_DEED_OUT, (after, Deed.NOTHING)


def every_fault() -> dict[tuple[Place, str], Cell]:
    return {
        (place, kind): wrong for place in TABLE if place not in NEVER for kind, wrong in wrong_cells(place)
    }


_S, _E = Stage, Stimulus
_UNNOTICED: Final[tuple[tuple[str, tuple[tuple[Stimulus, str, tuple[Stage, ...]], ...]], ...]] = (
    (
        "the next look at a way that is closed does it again",
        (
            (_E.WAY_CLOSED, DOES_NOTHING, (_S.LET_GO,)),
            (
                _E.WAY_CLOSED,
                LEAVES_DEED_OUT,
                (
                    _S.INTERLOCKED,
                    _S.READY,
                    _S.ENABLED,
                    _S.SETTLING,
                    _S.ASKING,
                    _S.PREPARED,
                    _S.BLIND,
                    _S.BRAKING,
                    _S.LEAVING,
                    _S.LEADING,
                    _S.HELD,
                ),
            ),
        ),
    ),
    (
        "the stage says the word, and an acknowledge or the owner's next word takes the stop's place",
        (
            (
                _E.ANEW,
                DOES_NOTHING,
                (
                    _S.RAMPING,
                    _S.TRIPPED,
                    _S.SILENCED,
                    _S.BURST,
                    _S.LET_GO,
                ),
            ),
            (_E.ANEW, LEAVES_DEED_OUT, (_S.HELD,)),
            (
                _E.LEFT,
                DOES_NOTHING,
                (
                    _S.RAMPING,
                    _S.TRIPPED,
                    _S.SILENCED,
                    _S.BURST,
                    _S.LET_GO,
                ),
            ),
            (_E.LEFT, LEAVES_DEED_OUT, (_S.HELD,)),
        ),
    ),
    (
        "what is over stays over",
        (
            (_E.BURST_OVER, LEAVES_DEED_OUT, (_S.BURST,)),
            (
                _E.SILENCE_DUE,
                LEAVES_DEED_OUT,
                (
                    _S.RAMPING,
                    _S.TRIPPED,
                ),
            ),
        ),
    ),
    (
        "a start that does not get on is given up after 3 s: no rule says how fast one has to be",
        (
            (_E.BRAKING_OVERDUE, DOES_NOTHING, (_S.SETTLING,)),
            (
                _E.REPORT_OVERDUE,
                DOES_NOTHING,
                (
                    _S.ASKING,
                    _S.PREPARED,
                ),
            ),
            (_E.REPORT_OVERDUE, LEAVES_DEED_OUT, (_S.PREPARED,)),
            (
                _E.SAYS_AT_REST,
                DOES_NOTHING,
                (
                    _S.BRAKING,
                    _S.LEAVING,
                ),
            ),
            (
                _E.SAYS_AT_REST,
                LEAVES_DEED_OUT,
                (
                    _S.ASKING,
                    _S.PREPARED,
                    _S.BRAKING,
                    _S.LEAVING,
                ),
            ),
            (
                _E.SAYS_BRAKING,
                DOES_NOTHING,
                (
                    _S.SETTLING,
                    _S.BLIND,
                ),
            ),
            (
                _E.SAYS_BRAKING,
                LEAVES_DEED_OUT,
                (
                    _S.SETTLING,
                    _S.ASKING,
                    _S.PREPARED,
                    _S.BLIND,
                ),
            ),
            (
                _E.SAYS_ENABLED,
                DOES_NOTHING,
                (
                    _S.ASKING,
                    _S.PREPARED,
                    _S.BLIND,
                    _S.BRAKING,
                    _S.LEAVING,
                ),
            ),
            (
                _E.SAYS_ENABLED,
                LEAVES_DEED_OUT,
                (
                    _S.BRAKING,
                    _S.LEAVING,
                ),
            ),
            (
                _E.START,
                DOES_NOTHING,
                (
                    _S.ASKING,
                    _S.PREPARED,
                    _S.BLIND,
                    _S.BRAKING,
                    _S.LEAVING,
                    _S.LEADING,
                ),
            ),
            (
                _E.START,
                LEAVES_DEED_OUT,
                (
                    _S.ASKING,
                    _S.PREPARED,
                    _S.BLIND,
                    _S.BRAKING,
                    _S.LEAVING,
                ),
            ),
            (
                _E.START_BRAKING,
                DOES_NOTHING,
                (
                    _S.SETTLING,
                    _S.BRAKING,
                    _S.LEAVING,
                ),
            ),
            (
                _E.START_BRAKING,
                LEAVES_DEED_OUT,
                (
                    _S.READY,
                    _S.SETTLING,
                    _S.LEAVING,
                ),
            ),
            (
                _E.START_STOPPING,
                DOES_NOTHING,
                (
                    _S.SETTLING,
                    _S.ASKING,
                    _S.PREPARED,
                    _S.BRAKING,
                    _S.LEAVING,
                    _S.LEADING,
                ),
            ),
            (
                _E.START_STOPPING,
                LEAVES_DEED_OUT,
                (
                    _S.READY,
                    _S.ASKING,
                    _S.PREPARED,
                    _S.BRAKING,
                    _S.LEAVING,
                    _S.LEADING,
                ),
            ),
            (
                _E.START_UNHEARD,
                DOES_NOTHING,
                (
                    _S.ASKING,
                    _S.PREPARED,
                ),
            ),
            (_E.START_UNHEARD, LEAVES_DEED_OUT, (_S.READY,)),
        ),
    ),
)
UNNOTICED: Final[dict[tuple[Place, str], str]] = {
    ((stage, stimulus), kind): reason
    for reason, faults in _UNNOTICED
    for stimulus, kind, stages in faults
    for stage in stages
}
"""Faults that no rule of the exploration notices, with the reason. All others are found."""
