"""Cases of HistoryRead: pages of raw values, and details, nodes and continuation points that are not there.

Neither open62541's nor node-opcua's store reads at times, modified values or events: of these only the codes
are compared, not what our server reads. Aggregates no server of the three has for these variables.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from typing import Any, Final

from asyncua import ua
from hypothesis import strategies as st

from tests.compare import space
from tests.compare.asked import NO_TIME, Ask, Made
from tests.compare.drawn import (
    METHODS,
    NOWHERE,
    OBJECTS,
    VARIABLES,
    Cases,
    cases,
    encodings,
    lists,
    node,
    times,
)
from tests.compare.play import Play

POINT: Final = "history point"


@dataclass(frozen=True, slots=True)
class Pages:
    """Read ``where`` with ``details``, and then up to ``more`` times on from where the last answer stopped.
    With ``releases`` the point is given back first, so that it is one that is not there any more."""

    where: ua.HistoryReadValueId
    details: Any
    more: int
    releases: bool
    asked: dict[str, Any] = field(default_factory=dict[str, Any])
    service: str = "HistoryRead"

    def play(self, play: Play) -> None:
        has_more = self._ask(play, self.where)
        for _ in range(self.more):
            if not has_more:
                return
            there = replace(self.where, ContinuationPoint=Made(POINT, _known(play) - 1))
            if self.releases:
                self._ask(play, there, releases=True)
            has_more = self._ask(play, there)

    def _ask(self, play: Play, where: ua.HistoryReadValueId, *, releases: bool = False) -> bool:
        """Whether all of them have more."""
        before = _known(play)
        asked = self.asked | {"NodesToRead": [where], "HistoryReadDetails": self.details}
        play.ask(Ask("HistoryRead", asked | {"ReleaseContinuationPoints": releases}, makes=POINT))
        return _known(play) > before


def _known(play: Play) -> int:
    return len(play.parties[0].made.get(POINT, ()))


def _seconds(*after: float) -> list[datetime]:
    return [space.BEGIN + timedelta(seconds=one) for one in after]


_HISTORIES: Final = [node(one.variable.id) for one in space.HISTORIES]
_points = st.sampled_from([None, None, None, b"nothing"])
_moments = st.sampled_from([NO_TIME, *_seconds(-10, 0, 0, 2, 2.5, 5, 9, 20)])
_most = st.sampled_from([0, 0, 1, 2, 3, 100])


def _raw(moments: Any, most: Any, modified: Any) -> Any:
    return st.builds(
        ua.ReadRawModifiedDetails,
        IsReadModified=modified,
        StartTime=moments,
        EndTime=moments,
        NumValuesPerNode=most,
        ReturnBounds=st.sampled_from([False, False, True]),
    )


_never = st.just(False)
_event_filter = ua.EventFilter(
    SelectClauses=[
        ua.SimpleAttributeOperand(
            ua.NodeId(ua.ObjectIds.BaseEventType), [ua.QualifiedName("Severity", 0)], ua.AttributeIds.Value
        )
    ]
)
_others = st.one_of(
    st.builds(ua.ReadAtTimeDetails, ReqTimes=st.lists(_moments, max_size=2), UseSimpleBounds=st.booleans()),
    _raw(_moments, _most, st.just(True)),
    st.builds(
        ua.ReadEventDetails,
        NumValuesPerNode=_most,
        StartTime=_moments,
        EndTime=_moments,
        Filter=st.just(_event_filter),
    ),
    st.builds(
        ua.ReadProcessedDetails,
        StartTime=_moments,
        EndTime=_moments,
        ProcessingInterval=st.just(1000.0),
        AggregateType=st.just([ua.NodeId(ua.ObjectIds.AggregateFunction_Average)]),
    ),
    st.just(ua.ExtensionObject()),
)
_anywhere = st.sampled_from([*_HISTORIES, *_HISTORIES, *VARIABLES[:3], *OBJECTS, *METHODS, *NOWHERE])


def _value(where: Any, points: Any, ranges: Any, encoded: Any) -> Any:
    return st.builds(
        ua.HistoryReadValueId,
        NodeId=where,
        IndexRange=ranges,
        DataEncoding=encoded,
        ContinuationPoint=points,
    )


def history() -> Cases:
    plain = _value(st.sampled_from(_HISTORIES), st.none(), st.none(), st.just(ua.QualifiedName()))
    odd = _value(_anywhere, _points, st.sampled_from([None, None, None, "0", "x"]), encodings)
    stamps = st.sampled_from([ua.TimestampsToReturn.Source] * 3 + [ua.TimestampsToReturn.Both])
    pages = st.builds(
        Pages,
        plain,
        _raw(_moments, _most, _never),
        st.integers(0, 4),
        st.sampled_from([False, False, False, True]),
        stamps.map(lambda one: {"TimestampsToReturn": one}),
    )
    any_details = st.one_of(_raw(_moments, _most, _never), _others)
    wrong = st.fixed_dictionaries(
        {
            "HistoryReadDetails": any_details,
            "TimestampsToReturn": times,
            "ReleaseContinuationPoints": st.sampled_from([False, False, False, True]),
            "NodesToRead": lists(odd, 2),
        }
    )
    return cases(st.one_of(pages, pages, wrong.map(lambda asked: Ask("HistoryRead", asked))))
