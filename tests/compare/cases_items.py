"""Cases with subscriptions: their items, and what these tell."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from asyncua import ua
from asyncua.ua.uaprotocol_auto import DataChangeFilter
from hypothesis import strategies as st

from tests.compare.asked import UNKNOWN, Ask, Fresh, HandleOf, Made
from tests.compare.drawn import (
    Attributes,
    Cases,
    Ids,
    attributes,
    encodings,
    lists,
    maybe_range,
    node,
    nodes,
    times,
)
from tests.compare.play import set_value
from tests.compare.publishing import INTERVAL_MS, Publish, Republish

# Subscriptions and their items

_SUBSCRIBE: Final = {
    "RequestedPublishingInterval": INTERVAL_MS,
    "RequestedLifetimeCount": 1000,
    "RequestedMaxKeepAliveCount": 1,
    "PublishingEnabled": True,
}
_first = Ask("CreateSubscription", _SUBSCRIBE, makes="subscription")
_subscriptions = st.sampled_from([Made("subscription", 0)] * 4 + [Made("subscription", 1), UNKNOWN])
_items = st.lists(
    st.one_of(st.integers(0, 3).map(lambda place: Made("item", place)), st.just(UNKNOWN)), max_size=3
)
_filters = st.one_of(
    st.none(),
    st.builds(
        DataChangeFilter,
        Trigger=st.sampled_from(list(ua.DataChangeTrigger)),
        DeadbandType=st.sampled_from([0, 0, 1, 1, 2, 3, 99]),
        DeadbandValue=st.sampled_from([0.0, 1.0, 5.0, 10.0, 100.0, 101.0, -1.0, math.nan]),
    ),
    st.just(ua.EventFilter()),
    st.just(ua.ExtensionObject()),
)
_modes = st.sampled_from([ua.MonitoringMode.Reporting] * 2 + list(ua.MonitoringMode))


def _parameters(filters: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    return st.builds(
        ua.MonitoringParameters,
        ClientHandle=st.builds(Fresh),
        SamplingInterval=st.just(0.0),
        QueueSize=st.sampled_from([0, 1, 2, 3, 10]),
        DiscardOldest=st.booleans(),
        Filter=filters,
    )


def _item(where: st.SearchStrategy[Any], attribute: st.SearchStrategy[Any], filters: Any) -> Any:
    target = st.builds(
        ua.ReadValueId,
        NodeId=where,
        AttributeId=attribute,
        IndexRange=maybe_range,
        DataEncoding=st.one_of(st.just(ua.QualifiedName()), encodings),
    )
    return st.builds(ua.MonitoredItemCreateRequest, target, _modes, _parameters(filters))


def _field(*names: str) -> Any:
    path = [ua.QualifiedName(name, 0) for name in names]
    return ua.SimpleAttributeOperand(ua.NodeId(Ids.BaseEventType), path, Attributes.Value)


def _event_filters() -> st.SearchStrategy[Any]:
    fields = st.sampled_from(
        [_field("Severity"), _field("Message"), _field("SourceName"), _field("EventType"), _field("nothing")]
    )
    limit = st.sampled_from([ua.FilterOperator.GreaterThan, ua.FilterOperator.Equals, ua.FilterOperator.Like])

    def where(operator: Any, severity: int) -> ua.ContentFilter:
        literal = ua.LiteralOperand(ua.Variant(severity, ua.VariantType.UInt16))
        return ua.ContentFilter([ua.ContentFilterElement(operator, [_field("Severity"), literal])])

    clauses = st.one_of(st.builds(ua.ContentFilter), st.builds(where, limit, st.sampled_from([100, 500])))
    return st.builds(ua.EventFilter, SelectClauses=st.lists(fields, max_size=3), WhereClause=clauses)


def _create(item: Any, subscription: Any = _subscriptions) -> st.SearchStrategy[Ask]:
    asked = st.fixed_dictionaries(
        {"SubscriptionId": subscription, "TimestampsToReturn": times, "ItemsToCreate": lists(item)}
    )
    return asked.map(lambda one: Ask("CreateMonitoredItems", one, makes="item"))


_WRITTEN: Final[Mapping[str, list[Any]]] = {
    "boolean": [True, False],
    "int32": [0, 5, -70000],
    "double": [2.5, 3.0, 13.0],
    "float": [1.5, math.nan],
    "analog": [20.0, 25.0, 41.0],
    "string": ["Förderband", "other"],
    "int32s": [[1, 2, 3, 4, 5], [1, 9, 3], []],
}


def _set() -> st.SearchStrategy[Ask]:
    writes = [set_value(name, value) for name, values in _WRITTEN.items() for value in values]
    return st.sampled_from(writes).map(lambda one: Ask("Write", {"NodesToWrite": [one]}))


def _emit(severity: int) -> Ask:
    call = ua.CallMethodRequest(
        node("machine"), node("machine/emit"), [ua.Variant(severity, ua.VariantType.UInt16)]
    )
    return Ask("Call", {"MethodsToCall": [call]})


# Not "float": NaN and a deadband together end node-opcua's server.
_watched = st.sampled_from([node(name) for name in _WRITTEN if name != "float"])
_reporting = st.sampled_from([ua.MonitoringMode.Reporting] * 3 + [ua.MonitoringMode.Sampling])


def _usual(filters: st.SearchStrategy[Any]) -> st.SearchStrategy[Ask]:
    """Items that all three servers make."""
    value = st.builds(
        ua.MonitoredItemCreateRequest,
        st.builds(
            ua.ReadValueId,
            NodeId=st.sampled_from([node(name) for name in _WRITTEN]),
            AttributeId=st.just(Attributes.Value),
        ),
        _reporting,
        _parameters(st.none()),
    )
    filtered = st.builds(
        ua.MonitoredItemCreateRequest,
        st.builds(
            ua.ReadValueId,
            NodeId=st.sampled_from([node("double"), node("analog"), node("int32")]),
            AttributeId=st.just(Attributes.Value),
        ),
        _reporting,
        _parameters(filters),
    )
    items = st.lists(st.one_of(value, filtered), min_size=1, max_size=4)
    return items.map(
        lambda some: Ask(
            "CreateMonitoredItems",
            {
                "SubscriptionId": Made("subscription", 0),
                "TimestampsToReturn": ua.TimestampsToReturn.Both,
                "ItemsToCreate": some,
            },
            makes="item",
        )
    )


_usual_filters = st.one_of(
    st.none(),
    st.builds(
        DataChangeFilter,
        Trigger=st.sampled_from(list(ua.DataChangeTrigger)),
        DeadbandType=st.sampled_from([0, 1, 1]),
        DeadbandValue=st.sampled_from([0.0, 1.0, 5.0, 10.0]),
    ),
)
_some_usual = _usual(_usual_filters)
_publish = st.builds(
    Publish,
    st.sampled_from(
        ["nothing", "everything", "everything", "again", "unknown", "of an unknown subscription"]
    ),
)


def _watching(steps: st.SearchStrategy[Any]) -> Cases:
    """``steps`` with a subscription that has items, and what these have to tell at the end."""
    cases = st.tuples(_some_usual, st.lists(steps, min_size=1, max_size=10))
    return cases.map(lambda case: [_first, case[0], *case[1], Publish()])


def _modified(item: Made, parameters: ua.MonitoringParameters) -> ua.MonitoredItemModifyRequest:
    return ua.MonitoredItemModifyRequest(item, replace(parameters, ClientHandle=HandleOf(item)))


def monitored_item() -> Cases:
    anything = _item(st.one_of(_watched, nodes), st.one_of(st.just(Attributes.Value), attributes), _filters)
    events = _item(
        st.sampled_from([node("machine"), ua.NodeId(Ids.Server), node("area")]),
        st.just(Attributes.EventNotifier),
        st.one_of(_event_filters(), _filters),
    )
    parameters = st.one_of(_parameters(_filters), _parameters(_event_filters()))
    modify = st.builds(
        lambda subscription, times, changes: Ask(
            "ModifyMonitoredItems",
            {
                "SubscriptionId": subscription,
                "TimestampsToReturn": times,
                "ItemsToModify": [_modified(*one) for one in changes],
            },
        ),
        _subscriptions,
        times,
        st.lists(st.tuples(st.integers(0, 3).map(lambda place: Made("item", place)), parameters), max_size=2),
    )
    mode = st.builds(
        lambda subscription, mode, items: Ask(
            "SetMonitoringMode",
            {"SubscriptionId": subscription, "MonitoringMode": mode, "MonitoredItemIds": items},
        ),
        _subscriptions,
        _modes,
        _items,
    )
    delete = st.builds(
        lambda subscription, items: Ask(
            "DeleteMonitoredItems", {"SubscriptionId": subscription, "MonitoredItemIds": items}
        ),
        _subscriptions,
        _items,
    )
    item = st.integers(0, 3).map(lambda place: Made("item", place))
    trigger = st.builds(
        lambda subscription, triggering, added, removed: Ask(
            "SetTriggering",
            {
                "SubscriptionId": subscription,
                "TriggeringItemId": triggering,
                "LinksToAdd": added,
                "LinksToRemove": removed,
            },
        ),
        _subscriptions,
        st.one_of(item, item, st.just(UNKNOWN)),
        _items,
        st.one_of(st.just([]), _items),
    )
    steps = st.one_of(
        trigger,
        _create(anything),
        _create(events),
        modify,
        mode,
        delete,
        *[_set()] * 5,
        *[st.sampled_from([100, 300, 500]).map(_emit)] * 2,
        *[_publish] * 2,
    )
    return _watching(steps)


def subscription() -> Cases:
    terms: dict[str, Any] = {
        "RequestedPublishingInterval": st.sampled_from([INTERVAL_MS, 0.0, -1.0, math.nan, math.inf, 1e12]),
        "RequestedLifetimeCount": st.sampled_from([0, 1, 1000, 2**32 - 1]),
        "RequestedMaxKeepAliveCount": st.sampled_from([0, 1, 2**32 - 1]),
        "MaxNotificationsPerPublish": st.sampled_from([0, 1, 2, 1000]),
    }
    odd = st.fixed_dictionaries(terms | {"PublishingEnabled": st.booleans()})
    usual = st.sampled_from([True, True, False]).map(lambda on: _SUBSCRIBE | {"PublishingEnabled": on})
    other = st.one_of(st.just(Made("odd subscription", 0)), st.just(UNKNOWN))
    numbers = st.lists(st.one_of(_subscriptions, other), max_size=2)
    modify = st.builds(
        lambda number, asked: Ask("ModifySubscription", {"SubscriptionId": number} | asked),
        other,
        st.fixed_dictionaries(terms),
    )
    modes = st.builds(
        lambda numbers, on: Ask("SetPublishingMode", {"SubscriptionIds": numbers, "PublishingEnabled": on}),
        numbers,
        st.booleans(),
    )
    delete = st.lists(st.one_of(other, other, _subscriptions), max_size=2).map(
        lambda numbers: Ask("DeleteSubscriptions", {"SubscriptionIds": numbers})
    )
    transfer = st.builds(
        lambda numbers, initial: Ask(
            "TransferSubscriptions", {"SubscriptionIds": numbers, "SendInitialValues": initial}
        ),
        numbers,
        st.booleans(),
    )
    republish = st.builds(
        Republish, st.integers(0, 1), st.sampled_from(["newest", "newest", "acknowledged", "unknown"])
    )
    return _watching(
        st.one_of(
            usual.map(lambda asked: Ask("CreateSubscription", asked, makes="subscription")),
            odd.map(lambda asked: Ask("CreateSubscription", asked, makes="odd subscription")),
            modify,
            modes,
            delete,
            transfer,
            republish,
            st.just(Ask("Cancel", {"RequestHandle": UNKNOWN})),
            _some_usual,
            *[_set()] * 4,
            *[_publish] * 3,
        )
    )
