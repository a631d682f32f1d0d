"""Cases of the methods of alarms, and what a refresh tells.

open62541 as PyPI's o6 has it is built without alarms: these cases are asked of node-opcua's server alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from asyncua import ua
from hypothesis import strategies as st

from tests.compare import space
from tests.compare.asked import UNKNOWN, Ask, Fresh, Made
from tests.compare.drawn import Cases, Ids, node
from tests.compare.play import EndOfCaseError, Play
from tests.compare.publishing import INTERVAL_MS, Publish

_TYPE: Final = ua.NodeId(Ids.ConditionType)
_ALARM: Final = node(space.ALARM)
_CALL: Final = ua.CallMethodRequest(node(space.ALARM.rpartition("/")[0]), node(space.RAISE), [])
_Kind = ua.VariantType


@dataclass(frozen=True, slots=True)
class Raise:
    """Make the alarm active, for another reason than before. Its EventId is a server's own."""

    service: str = "Call"

    def play(self, play: Play) -> None:
        for one in play.parties:
            answer = one.ask(Ask("Call", {"MethodsToCall": [_CALL]}))
            result = answer.Results[0]
            result.StatusCode.check()
            one.made.setdefault("event", []).append(result.OutputArguments[0].Value)


@dataclass(frozen=True, slots=True)
class Do:
    """Ends the case at a difference: one server may have told again what the other has not."""

    call: Any
    service: str = "Call"

    def play(self, play: Play) -> None:
        before = len(play.seen)
        play.ask(Ask("Call", {"MethodsToCall": [self.call]}))
        if len(play.seen) > before:
            raise EndOfCaseError


def _call(where: Any, method: int, arguments: Any) -> Any:
    return st.builds(
        ua.CallMethodRequest, ObjectId=where, MethodId=st.just(ua.NodeId(method)), InputArguments=arguments
    )


def _some_of(*arguments: Any) -> Any:
    """All of them, or in the end too few or too many."""
    more = st.just(ua.Variant(7, _Kind.Int32))
    return st.one_of(
        *[st.tuples(*arguments)] * 4, st.tuples(*arguments[:-1]), st.tuples(*arguments, more)
    ).map(list)


def _variants(kind: ua.VariantType, *values: Any) -> list[ua.Variant]:
    return [ua.Variant(value, kind) for value in values]


_odd: Final = [ua.Variant("words", _Kind.String), ua.Variant(1.5, _Kind.Double)]
_events = st.sampled_from(
    [
        *_variants(_Kind.ByteString, *[Made("event", -1)] * 6, Made("event", 0), b"unknown", b"", None),
        *_odd,
    ]
)
_comments = st.sampled_from(
    [
        *_variants(
            _Kind.LocalizedText,
            ua.LocalizedText("seen", "en"),
            ua.LocalizedText("gesehen", "de"),
            ua.LocalizedText(),
        ),
        *_variants(_Kind.LocalizedText, ua.LocalizedText("seen again", "en")),
        *_odd,
    ]
)
_numbers = st.sampled_from(
    [*_variants(_Kind.UInt32, *[Made("subscription", 0)] * 3, UNKNOWN, 0), ua.Variant("words", _Kind.String)]
)
_items = st.sampled_from(
    [*_variants(_Kind.UInt32, Made("item", 0), UNKNOWN), ua.Variant("words", _Kind.String)]
)
_alarms = st.sampled_from([*[_ALARM] * 6, node("machine"), node("nowhere"), _TYPE])
_types = st.sampled_from([*[_TYPE] * 6, _ALARM, node("machine"), node("nowhere")])


def _field(*names: str) -> Any:
    path = [ua.QualifiedName(name, 0) for name in names]
    return ua.SimpleAttributeOperand(ua.NodeId(Ids.AlarmConditionType), path, ua.AttributeIds.Value)


_FIELDS: Final = [
    _field("Message"),
    _field("Severity"),
    _field("ActiveState", "Id"),
    _field("AckedState", "Id"),
    _field("ConfirmedState", "Id"),
    _field("Retain"),
    _field("Comment"),
]
_OF_ALARMS: Final = ua.ContentFilter(
    [
        ua.ContentFilterElement(
            ua.FilterOperator.OfType,
            [ua.LiteralOperand(ua.Variant(ua.NodeId(Ids.AlarmConditionType), _Kind.NodeId))],
        )
    ]
)
_ITEM: Final = ua.MonitoredItemCreateRequest(
    ua.ReadValueId(ua.NodeId(Ids.Server), ua.AttributeIds.EventNotifier),
    ua.MonitoringMode.Reporting,
    ua.MonitoringParameters(
        ClientHandle=Fresh(),
        SamplingInterval=0.0,
        QueueSize=100,
        DiscardOldest=True,
        Filter=ua.EventFilter(SelectClauses=_FIELDS, WhereClause=_OF_ALARMS),
    ),
)
_WATCH: Final = (
    Ask(
        "CreateSubscription",
        {
            "RequestedPublishingInterval": INTERVAL_MS,
            "RequestedLifetimeCount": 1000,
            "RequestedMaxKeepAliveCount": 1,
            "PublishingEnabled": True,
        },
        makes="subscription",
    ),
    Ask(
        "CreateMonitoredItems",
        {
            "SubscriptionId": Made("subscription", 0),
            "TimestampsToReturn": ua.TimestampsToReturn.Both,
            "ItemsToCreate": [_ITEM],
        },
        makes="item",
    ),
)


def alarm() -> Cases:
    about = (_events, _comments)
    call = st.one_of(
        *[_call(_alarms, Ids.AcknowledgeableConditionType_Acknowledge, _some_of(*about))] * 2,
        _call(_alarms, Ids.ConditionType_AddComment, _some_of(*about)),
        _call(_types, Ids.ConditionType_ConditionRefresh, _some_of(_numbers)),
        _call(_types, Ids.ConditionType_ConditionRefresh2, _some_of(_numbers, _items)),
    )
    steps = st.one_of(*[st.builds(Do, call)] * 5, st.builds(Raise), st.builds(Publish))
    return st.lists(steps, min_size=1, max_size=8).map(
        lambda found: [*_WATCH, Raise(), Publish(), *found, Publish()]
    )
