"""The judgement as two tables: the place of a stop on its way to the drive, and its outcome then.

The code asks these tables for the next place or outcome and for the deed;
``docs/reference/decision-tables.md`` has them printed. The conditions of a finding are decided in ``step``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import StrEnum
from typing import Final

from bridge.command.stop_check.state import LastStop, StopPlace

_P, _L = StopPlace, LastStop


class News(StrEnum):
    """Changes of the word, of the node or of the way to it."""

    __hash__ = str.__hash__

    ENABLES = "a word that enables is in force"
    STOPS = "a stop is in force, the node is in operation"
    STOPS_AWAY = "a stop is in force, the node is not in operation"
    STOPS_OTHERWISE = "another stop is in force, the node is in operation"
    STOPS_OTHERWISE_AWAY = "another stop is in force, the node is not in operation"
    HANDED_OVER = "handed to the bus"
    GONE = "node not in operation any more, not by the bridge"
    BACK = "node in operation"
    CUT_OFF = "bridge takes the node out of operation"
    RESTARTED = "node that the bridge took out of operation has started anew"
    PAUSE = "first telegram after a pause longer than the deadline"


class PlaceDeed(StrEnum):
    """Change of the state beside the step to the next place."""

    __hash__ = str.__hash__

    NOTHING = "–"
    FORGIVE = "forget the stop and its outcome"
    BEGIN = "forwarded"
    BEGIN_ANEW = "forget what was said, forwarded"
    BOUND = "the bound begins"
    CHANGE_BOUND = "the bound of the weaker word holds"
    FORGET = "forget what was said"
    LAST_REPORT = "judge by the last report"
    BOUND_ANEW = "the bound begins anew"


class Evidence(StrEnum):
    """Meaning of a telegram, or of time without one, for a stop that is on the bus."""

    __hash__ = str.__hash__

    FOLLOWS = "drive does what the stop asks"
    BEGINS_TO_FOLLOW = "drive begins to do what the stop asks, after it was called ignored"
    PUSHED = "drive that held the motor is enabled again, the word leaves the voltage on"
    ENABLED_AGAIN = "drive is enabled again, the word leaves the voltage on"
    RUNS_ON = "drive does not, within the bound"
    RUNS_ON_LATE = "drive does not, after the bound"
    SUMMED = "short stops have added up to a bound"
    CALM = "drive has done what the stop asks for the short bound"


class OutcomeDeed(StrEnum):
    """Change of the state beside the next outcome; several in this order."""

    __hash__ = str.__hash__

    COUNT = "its time begins"
    COUNT_NO_MORE = "its time is over"
    REST = "not enabled: the short bound holds"
    GRANT_RAMP = "the bound of a ramp begins"
    GRANT_SHORT = "once, the short bound begins"
    TELL = "tell"


PlaceCell = tuple[StopPlace, PlaceDeed]
OutcomeCell = tuple[LastStop, tuple[OutcomeDeed, ...]]

_STOPPED: Final = (_P.AWAY, _P.TO_SEND, _P.ON_BUS, _P.CHANGING)
_JUDGED: Final = (_P.ON_BUS, _P.CHANGING)

_PLACES: Final[Mapping[News, Mapping[Iterable[StopPlace], tuple[StopPlace | None, PlaceDeed]]]] = {
    News.ENABLES: {_STOPPED: (_P.ENABLED, PlaceDeed.FORGIVE)},
    News.STOPS: {(_P.ENABLED,): (_P.TO_SEND, PlaceDeed.BEGIN)},
    News.STOPS_AWAY: {(_P.ENABLED,): (_P.AWAY, PlaceDeed.BEGIN)},
    News.STOPS_OTHERWISE: {(_P.ON_BUS,): (_P.CHANGING, PlaceDeed.NOTHING)},
    News.STOPS_OTHERWISE_AWAY: {(_P.CHANGING,): (_P.ON_BUS, PlaceDeed.NOTHING)},
    News.HANDED_OVER: {
        (_P.TO_SEND,): (_P.ON_BUS, PlaceDeed.BOUND),
        (_P.CHANGING,): (_P.ON_BUS, PlaceDeed.CHANGE_BOUND),
    },
    News.GONE: {
        (_P.TO_SEND,): (_P.AWAY, PlaceDeed.NOTHING),
        _JUDGED: (_P.AWAY, PlaceDeed.FORGET),
    },
    News.BACK: {
        (_P.ENABLED,): (None, PlaceDeed.FORGET),
        (_P.AWAY, *_JUDGED): (_P.TO_SEND, PlaceDeed.BEGIN_ANEW),
    },
    News.CUT_OFF: {(_P.ON_BUS,): (None, PlaceDeed.LAST_REPORT)},
    News.RESTARTED: {_JUDGED: (_P.AWAY, PlaceDeed.FORGET)},
    News.PAUSE: {_JUDGED: (None, PlaceDeed.BOUND_ANEW)},
}

_OUTCOMES: Final[Mapping[Evidence, Mapping[LastStop, OutcomeCell]]] = {
    Evidence.FOLLOWS: {
        _L.FORWARDED: (_L.FOLLOWED, (OutcomeDeed.REST, OutcomeDeed.TELL)),
        _L.FOLLOWED: (_L.FOLLOWED, (OutcomeDeed.REST,)),
        _L.IGNORED: (_L.IGNORED, (OutcomeDeed.REST,)),
    },
    Evidence.BEGINS_TO_FOLLOW: {_L.IGNORED: (_L.IGNORED, (OutcomeDeed.COUNT,))},
    Evidence.PUSHED: {_L.FOLLOWED: (_L.FOLLOWED, (OutcomeDeed.GRANT_RAMP,))},
    Evidence.ENABLED_AGAIN: {_L.FOLLOWED: (_L.FOLLOWED, (OutcomeDeed.GRANT_SHORT,))},
    Evidence.RUNS_ON: {_L.IGNORED: (_L.IGNORED, (OutcomeDeed.COUNT_NO_MORE,))},
    Evidence.RUNS_ON_LATE: {
        _L.FORWARDED: (_L.IGNORED, (OutcomeDeed.TELL,)),
        _L.FOLLOWED: (_L.IGNORED, (OutcomeDeed.TELL,)),
        _L.IGNORED: (_L.IGNORED, (OutcomeDeed.COUNT_NO_MORE,)),
    },
    Evidence.SUMMED: {
        _L.FORWARDED: (_L.IGNORED, (OutcomeDeed.TELL,)),
        _L.FOLLOWED: (_L.IGNORED, (OutcomeDeed.TELL,)),
    },
    Evidence.CALM: {_L.IGNORED: (_L.FOLLOWED, (OutcomeDeed.TELL,))},
}


def _places() -> dict[tuple[StopPlace, News], PlaceCell]:
    table = {(place, news): (place, PlaceDeed.NOTHING) for place in StopPlace for news in News}
    for news, row in _PLACES.items():
        for places, (after, deed) in row.items():
            for place in places:
                table[place, news] = (after or place, deed)
    return table


def _outcomes() -> dict[tuple[LastStop, Evidence], OutcomeCell]:
    table: dict[tuple[LastStop, Evidence], OutcomeCell] = {
        (outcome, finding): (outcome, ()) for outcome in LastStop for finding in Evidence
    }
    for finding, row in _OUTCOMES.items():
        for outcome, cell in row.items():
            table[outcome, finding] = cell
    return table


PLACE_TABLE: Final = _places()
OUTCOME_TABLE: Final = _outcomes()
