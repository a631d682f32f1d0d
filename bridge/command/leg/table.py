"""The leg as a table: what each event makes of each stage, and what is done about it.

The next stage and the deed come from this table and from nowhere else (``bridge.command.leg.deeds``);
``docs/reference/decision-tables.md`` has it printed. What an event is, and what has to hold for it, is
decided where it comes in. Which word a drive gets then is a table of its own
(``bridge.command.leg.word_table``).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import StrEnum
from typing import Final

from bridge.command.leg.state import ANY_TRIP, AWAITS_REPORT, STARTING, Stage

_S = Stage


class Stimulus(StrEnum):
    __hash__ = str.__hash__  # as that of Stage

    # the owner
    STOP_WORD = "owner's control word that does not enable"
    ENABLING_WORD = "owner's control word that enables"
    SETPOINTS = "owner's telegram without a control word"
    INVALID = "telegram that is not valid"
    LATE_STOP = "owner's control word that stops, but is too old for a telegram"
    ACKNOWLEDGE = "acknowledge"
    ACKNOWLEDGE_FAULT = "acknowledge of a fault of the drive"
    RESUME = "acknowledge that stands for a word that does not enable"
    LEFT = "owner releases, loses its lease or is replaced; the bridge hung"
    # anybody
    STOP = "stop by a command"
    STOP_AGAIN = "stop by a command that was sent in this silence already"
    # a start
    START_REFUSED = "start of a drive with a fault, or that gets no words"
    START = "start"
    START_ENABLED = "start of a drive that is enabled"
    START_STOPPING = "start while a stop is on its way"
    START_UNHEARD = "start of a drive that has not reported yet"
    START_BRAKING = "start of a drive in its quick stop"
    # time
    EXPIRED_STOP = "timer expires: stop"
    EXPIRED_RAMP = "timer expires: ramp, then stop"
    EXPIRED_SILENCE = "timer expires: silence"
    EXPIRED_HOLD = "timer expires: hold"
    REPORT_OVERDUE = "1 s without a report"
    BRAKING_OVERDUE = "1 s in the quick stop"
    START_OVERDUE = "3 s since the start began"
    RAMP_OVERDUE = "10 s since the trip"
    SILENCE_DUE = "then_silence_ms since the trip"
    BURST_OVER = "0.1 s since the silence was broken"
    # the drive
    SAYS_ENABLED = "drive says: operation enabled"
    SAYS_BRAKING = "drive says: quick stop active"
    SAYS_AT_REST = "drive says: not enabled"
    SAYS_FAULT = "drive says: fault"
    # the way to it
    WAY_CLOSED = "node gone, process data overdue, or needed position not known"
    WAY_OPEN = "drive can be reached again"
    NODE_BACK = "node operational again"
    ANEW = "bus back, or node told to stop"


class Deed(StrEnum):
    __hash__ = str.__hash__

    NOTHING = "–"
    # what the owner and others ask
    FORWARD = "forward"
    TAKE = "take, do not forward"
    REFUSE = "refuse"
    STOP_AS_ASKED = "stop as asked"
    KEEP_SILENT = "go on sending nothing"
    CLEAR = "clear the fault"
    CLEAR_STOP = "clear the fault, stop"
    # what the bridge does by itself
    STOP = "stop"
    BLOCK = "a stop in place of the owner's word"
    REACT = "reaction, fault"
    HOLD = "fault, go on sending"
    END_RAMP = "the ramp is over"
    SILENCE = "send nothing"
    # a start
    WAIT = "hold the stop, wait"
    AWAIT_REST = "wait for the end of the quick stop"
    READY = "send READY"
    BEGIN = "send READY, or the next word"
    GO_ON = "send the next word"
    ENABLE = "send the enabling word"
    LEAVE = "send disable voltage"
    DONE = "the start is done"
    GIVE_UP = "stop, the start has failed"


Cell = tuple[Stage, Deed]
_Row = Mapping[Iterable[Stage], tuple[Stage | None, Deed]]
"""None: the stage stays."""

_OPEN: Final = (_S.READY, _S.ENABLED)
_SHUT: Final = (_S.CLOSED,)
_LOCKED: Final = (_S.INTERLOCKED,)
_REACTING: Final = (_S.RAMPING, _S.TRIPPED, _S.SILENCED, _S.BURST)
_HOLDING: Final = (_S.HELD, _S.LET_GO)
_FREE: Final = (*_LOCKED, *_OPEN, *STARTING)
"""Neither closed nor tripped."""
_NOT_TRIPPED: Final = (*_SHUT, *_FREE)


def _stops(deed: Deed = Deed.STOP) -> _Row:
    return {
        (*_SHUT, *_REACTING): (None, deed),
        _FREE: (_S.INTERLOCKED, deed),
        _HOLDING: (_S.LET_GO, deed),
    }


def _starts(after: Stage, deed: Deed, kept: Iterable[Stage] = ()) -> _Row:
    """``kept``: stages of a start that the next one goes on with."""
    return {_FREE: (after, deed), tuple(kept): (None, deed)}


def _expires(after: Stage, deed: Deed = Deed.REACT) -> _Row:
    return {_NOT_TRIPPED: (after, deed)}


def _rests(in_start: Cell) -> _Row:
    """The drive is not enabled: a ramp is over, also while nothing is sent."""
    return {
        tuple(STARTING): in_start,
        (_S.RAMPING,): (_S.TRIPPED, Deed.END_RAMP),
        (_S.SILENCED, _S.BURST): (None, Deed.END_RAMP),
    }


_ROWS: Final[dict[Stimulus, _Row]] = {
    Stimulus.STOP_WORD: {
        _SHUT: (None, Deed.FORWARD),
        _FREE: (_S.READY, Deed.FORWARD),
        _REACTING: (None, Deed.TAKE),
        _HOLDING: (_S.LET_GO, Deed.FORWARD),
    },
    Stimulus.ENABLING_WORD: {
        (*_SHUT, *_LOCKED, *ANY_TRIP): (None, Deed.TAKE),
        (*_OPEN, *STARTING): (_S.ENABLED, Deed.FORWARD),
    },
    Stimulus.SETPOINTS: {
        (*_SHUT, *_LOCKED, *ANY_TRIP): (None, Deed.TAKE),
        (*_OPEN, *STARTING): (None, Deed.FORWARD),
    },
    Stimulus.INVALID: {tuple(Stage): (None, Deed.REFUSE)},
    Stimulus.LATE_STOP: {**_stops(Deed.FORWARD), _REACTING: (None, Deed.TAKE)},
    Stimulus.ACKNOWLEDGE: {
        _NOT_TRIPPED: (None, Deed.CLEAR),
        tuple(ANY_TRIP): (_S.INTERLOCKED, Deed.CLEAR_STOP),
    },
    Stimulus.ACKNOWLEDGE_FAULT: {
        _SHUT: (None, Deed.CLEAR_STOP),
        (*_FREE, *ANY_TRIP): (_S.INTERLOCKED, Deed.CLEAR_STOP),
    },
    Stimulus.RESUME: {_LOCKED: (_S.READY, Deed.NOTHING)},
    Stimulus.LEFT: _stops(),
    Stimulus.STOP: {**_stops(Deed.STOP_AS_ASKED), (_S.SILENCED,): (_S.BURST, Deed.STOP_AS_ASKED)},
    Stimulus.STOP_AGAIN: {(_S.SILENCED,): (None, Deed.KEEP_SILENT)},
    Stimulus.START_REFUSED: {_FREE: (None, Deed.REFUSE)},
    Stimulus.START: {
        (*_SHUT, *ANY_TRIP): (None, Deed.REFUSE),
        **_starts(_S.LEADING, Deed.BEGIN),
    },
    Stimulus.START_ENABLED: _starts(_S.ENABLED, Deed.DONE),
    Stimulus.START_STOPPING: _starts(_S.SETTLING, Deed.WAIT),
    Stimulus.START_UNHEARD: {
        **_starts(_S.ASKING, Deed.WAIT, kept=(_S.ASKING, _S.PREPARED)),
        (_S.BLIND,): (_S.PREPARED, Deed.WAIT),
    },
    Stimulus.START_BRAKING: _starts(_S.BRAKING, Deed.WAIT),
    Stimulus.EXPIRED_STOP: _expires(_S.TRIPPED),
    Stimulus.EXPIRED_RAMP: _expires(_S.RAMPING),
    Stimulus.EXPIRED_SILENCE: _expires(_S.SILENCED),
    Stimulus.EXPIRED_HOLD: _expires(_S.HELD, Deed.HOLD),
    Stimulus.REPORT_OVERDUE: {
        (_S.ASKING,): (_S.PREPARED, Deed.READY),
        (_S.PREPARED,): (_S.BLIND, Deed.ENABLE),
    },
    Stimulus.BRAKING_OVERDUE: {
        (_S.BRAKING,): (_S.LEAVING, Deed.LEAVE),
        (_S.SETTLING,): (None, Deed.LEAVE),
    },
    Stimulus.START_OVERDUE: {tuple(STARTING): (_S.INTERLOCKED, Deed.GIVE_UP)},
    Stimulus.RAMP_OVERDUE: {
        (_S.RAMPING,): (_S.TRIPPED, Deed.END_RAMP),
        (_S.SILENCED, _S.BURST): (None, Deed.END_RAMP),
    },
    Stimulus.SILENCE_DUE: {(_S.RAMPING, _S.TRIPPED): (_S.SILENCED, Deed.SILENCE)},
    Stimulus.BURST_OVER: {(_S.BURST,): (_S.SILENCED, Deed.SILENCE)},
    Stimulus.SAYS_ENABLED: {tuple(STARTING): (_S.ENABLED, Deed.DONE)},
    Stimulus.SAYS_BRAKING: {tuple(AWAITS_REPORT): (_S.BRAKING, Deed.AWAIT_REST)},
    Stimulus.SAYS_AT_REST: {
        **_rests((_S.LEADING, Deed.BEGIN)),
        (_S.LEADING,): (None, Deed.GO_ON),
    },
    Stimulus.SAYS_FAULT: _rests((_S.INTERLOCKED, Deed.GIVE_UP)),
    Stimulus.WAY_CLOSED: {
        _SHUT: (None, Deed.BLOCK),
        _FREE: (_S.CLOSED, Deed.BLOCK),
        _HOLDING: (_S.LET_GO, Deed.BLOCK),
    },
    Stimulus.WAY_OPEN: {_SHUT: (_S.INTERLOCKED, Deed.NOTHING)},
    Stimulus.NODE_BACK: {_FREE: (_S.INTERLOCKED, Deed.BLOCK)},
    Stimulus.ANEW: _stops(),
}


def _table() -> dict[tuple[Stage, Stimulus], Cell]:
    table = {(stage, stimulus): (stage, Deed.NOTHING) for stage in Stage for stimulus in Stimulus}
    for stimulus, row in _ROWS.items():
        for stages, (after, deed) in row.items():
            for stage in stages:
                table[stage, stimulus] = (after or stage, deed)
    return table


TABLE: Final = _table()
