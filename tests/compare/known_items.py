"""The differences that are known, of monitored items and what they tell."""

from __future__ import annotations

import re
from itertools import groupby
from typing import Any, Final

from asyncua import ua
from asyncua.ua.uaprotocol_auto import DataChangeFilter

from tests.compare import faults
from tests.compare.difference import (
    ANY,
    ANY_ORDER,
    ANYTHING,
    FIRST_FAULT,
    Difference,
    both,
    node_opcua,
    of_operation,
    open62541,
    several,
    target_of,
)
from tests.compare.servers import NODE_OPCUA, OPEN62541, OURS

_GOOD_NUMBER: Final = re.compile(r"Double (\S+) Good(?: with Overflow)?")
_MOST_DEADBAND: Final = 10.0


def _once_each(told: Any) -> list[Any]:
    """Values that were told, without those that are told again."""
    return [value for value, _ in groupby(told or [])]


def _is_within_a_deadband(*told: Any) -> bool:
    """Whether good numbers were told, and all lie within the largest deadband that is asked for."""
    found = [_GOOD_NUMBER.fullmatch(str(value)) for values in told for value in values or ()]
    numbers = [float(one[1]) for one in found if one]
    return 1 < len(numbers) == len(found) and max(numbers) - min(numbers) <= _MOST_DEADBAND


OF_ITEMS: Final = (
    # MonitoredItem
    Difference(
        "CreateMonitoredItems",
        "several faults in one operation",
        ANYTHING,
        ANY,
        FIRST_FAULT,
        ANY_ORDER,
        when=several(faults.of_item),
    ),
    Difference(
        "CreateMonitoredItems",
        "an `indexRange` of what has no elements",
        ("BadIndexRangeNoData",),
        {
            OPEN62541: ("Good", "BadInternalError", "BadFilterNotAllowed"),
            NODE_OPCUA: ("Good", "BadIndexRangeInvalid"),
        },
        "Part 4 §5.13.2.4",
        "Nothing will ever be in the range.",
        when=of_operation(lambda one: bool(target_of(one).IndexRange)),
    ),
    Difference(
        "CreateMonitoredItems",
        "an `indexRange` that is none",
        ("BadIndexRangeInvalid",),
        {OPEN62541: ("Good", "BadInternalError", "BadIndexRangeNoData"), NODE_OPCUA: ("Good",)},
        "Part 4 §7.27",
        "It is no range.",
        when=of_operation(lambda one: bool(target_of(one).IndexRange)),
    ),
    Difference(
        "CreateMonitoredItems",
        "an attribute that the node does not have",
        ("BadAttributeIdInvalid",),
        both("Good"),
        "Part 4 §5.13.2.4",
        "It can never tell anything.",
    ),
    Difference(
        "CreateMonitoredItems",
        "an attribute that the node does not have, with an `indexRange`",
        ("BadAttributeIdInvalid",),
        open62541("BadInternalError"),
        "Part 4 §5.13.2.4",
        "It is not the server that has failed.",
        when=of_operation(lambda one: bool(target_of(one).IndexRange)),
    ),
    Difference(
        "CreateMonitoredItems",
        "events of an object that sends none",
        ("BadNotSupported",),
        node_opcua("Good"),
        "Part 4 §5.13.1.1",
        "Its EventNotifier says so.",
    ),
    Difference(
        "CreateMonitoredItems",
        "events with a filter of changes, without a filter, or without fields",
        ("BadFilterNotAllowed", "BadMonitoredItemFilterInvalid", "BadEventFilterInvalid"),
        {OPEN62541: ("BadEventFilterInvalid",), NODE_OPCUA: ("Good", "BadFilterNotAllowed")},
        "Part 4 §7.22.3",
        "Without an EventFilter that has fields there is nothing to tell.",
        when=of_operation(lambda one: one.ItemToMonitor.AttributeId == ua.AttributeIds.EventNotifier),
    ),
    Difference(
        "CreateMonitoredItems",
        "a filter of changes without a deadband, for another attribute than Value",
        ("BadFilterNotAllowed",),
        open62541("Good"),
        "Part 4 §5.13.1.1",
        "The filter would not be used.",
        when=of_operation(lambda one: one.ItemToMonitor.AttributeId != ua.AttributeIds.Value),
    ),
    Difference(
        "CreateMonitoredItems, ModifyMonitoredItems",
        "events, and no event has any of the fields",
        ("BadEventFilterInvalid",),
        both("Good"),
        "Part 4 §7.22.3",
        "There is nothing to tell. With one field that there is, the others are null.",
        when=of_operation(lambda one: faults.has_odd_fields(one.RequestedParameters.Filter)),
    ),
    Difference(
        "CreateMonitoredItems, ModifyMonitoredItems",
        "results of the fields of an event filter",
        ("None", "Good", "BadNodeIdUnknown"),
        {OPEN62541: ("None",), NODE_OPCUA: ("Good", "BadNoMatch")},
        "Part 4 §7.22.3",
        "They are told where one is wrong: BadNodeIdUnknown is a field that there is not.",
        path=r"Results\[\d+\]\.FilterResult\.SelectClauseResults\[\d+\]",
    ),
    Difference(
        "CreateMonitoredItems, ModifyMonitoredItems",
        "results of the elements of an event filter",
        ("Good",),
        both("None"),
        "Part 4 §7.7.2",
        "Where a field is wrong there is one for each element, too.",
        path=r"Results\[\d+\]\.FilterResult\.WhereClauseResult\.ElementResults\[\d+\]"
        r"\.(StatusCode|OperandStatusCodes\[\d+\])",
    ),
    Difference(
        "CreateMonitoredItems, ModifyMonitoredItems",
        "a deadband that there is not, or of what has none",
        ("BadDeadbandFilterInvalid", "BadFilterNotAllowed"),
        both("BadMonitoredItemFilterUnsupported", "BadFilterNotAllowed", "Good"),
        "Part 4 §7.22.2, Part 8 §7.2",
        "The filter is known; it is its deadband that cannot be.",
        when=of_operation(
            lambda one: (
                isinstance(one.RequestedParameters.Filter, DataChangeFilter)
                and one.RequestedParameters.Filter.DeadbandType != 0
            )
        ),
    ),
    Difference(
        "SetTriggering",
        "an item that triggers itself",
        ("Good",),
        node_opcua("BadMonitoredItemIdInvalid"),
        "Part 4 §5.13.5",
        "Nothing forbids it: it is told when it has something to tell.",
        path=r"(Add|Remove)Results\[\d+\]",
    ),
    # Subscription
    Difference(
        "Cancel",
        "whatever it is",
        ("Good",),
        node_opcua("BadServiceUnsupported"),
        "Part 4 §5.7.5",
        "It tells how many requests were cancelled.",
    ),
    Difference(
        "Publish",
        "the value of a variable that can only be written",
        ("['BadNotReadable']",),
        open62541("['BadUserAccessDenied']"),
        "Part 4 §5.11.2.4",
        "Nobody may read it, whoever asks.",
        path=r"item \d+",
    ),
    Difference(
        "Publish",
        "a part of a text that is not ASCII",
        ANYTHING,
        {OPEN62541: ANYTHING},
        "Part 4 §7.27",
        "A text is an array of characters; there they are bytes.",
        path=r"item \d+",
        when=lambda seen, server: str(seen.values[OURS]).startswith("['String "),
    ),
    Difference(
        "Publish",
        "the same value with another source time, with StatusValueTimestamp and a deadband",
        ANYTHING,
        {NODE_OPCUA: ANYTHING},
        "Part 4 §7.22.2",
        "With a deadband this trigger is as StatusValue: the value is told once.",
        path=r"item \d+",
        when=lambda seen, server: _once_each(seen.values[server]) == _once_each(seen.values[OURS]),
    ),
    Difference(
        "Publish",
        "a value within the deadband with another source time, with StatusValueTimestamp",
        ANYTHING,
        {NODE_OPCUA: ANYTHING},
        "Part 4 §7.22.2",
        "With a deadband this trigger is as StatusValue: the value is not told.",
        path=r"item \d+",
        when=lambda seen, server: _is_within_a_deadband(seen.values[server], seen.values[OURS]),
    ),
    Difference(
        "Publish",
        "a subscription that has something to tell while its publishing is off, beside others",
        ("None",),
        open62541("does not end"),
        "Part 4 §5.14.1.2",
        "It takes one Publish request in an interval, for its keep-alive, and leaves the others their turn.",
    ),
    Difference(
        "TransferSubscriptions",
        "a subscription of this session",
        ("BadNothingToDo",),
        open62541("Good"),
        "Part 4 §5.14.7",
        "It is there already.",
    ),
)
