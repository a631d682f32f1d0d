"""The differences that are known, of what is read of the past."""

from __future__ import annotations

from typing import Any, Final

from asyncua import ua

from tests.compare import faults, space
from tests.compare.asked import NO_TIME
from tests.compare.difference import (
    ANY,
    ANY_ORDER,
    ANYTHING,
    FIRST_FAULT,
    Difference,
    both,
    has_encoding,
    node_opcua,
    of_operation,
    of_step,
    open62541,
)
from tests.compare.faults import DATA_ENCODING, Faults
from tests.compare.play import Seen
from tests.compare.servers import NODE_OPCUA, OPEN62541, OURS

_KEPT: Final = {ua.NodeId(one.variable.id, 1) for one in space.HISTORIES}
_NO_TIMES: Final = (ua.TimestampsToReturn.Neither, ua.TimestampsToReturn.Invalid)
_RESULTS: Final = r"Results\[\d+\]\.(StatusCode|values|goes on)"


def _details(step: Any) -> Any:
    return step.asked["HistoryReadDetails"]


def _is_raw(step: Any) -> bool:
    return isinstance(_details(step), ua.ReadRawModifiedDetails)


def _is_modified(step: Any) -> bool:
    return _is_raw(step) and _details(step).IsReadModified


def _releases(step: Any) -> bool:
    return bool(step.asked["ReleaseContinuationPoints"])


def _is_too_little(step: Any) -> bool:
    """Whether fewer than two of start, end and number are given."""
    one = _details(step)
    given = (one.StartTime != NO_TIME) + (one.EndTime != NO_TIME) + (one.NumValuesPerNode != 0)
    return given < 2


def _has_two_ends(step: Any) -> bool:
    return _is_raw(step) and NO_TIME not in (_details(step).StartTime, _details(step).EndTime)


def _asks_of_no_variable(step: Any) -> bool:
    return any(faults.class_of(one.NodeId) in ("object", "method") for one in step.asked["NodesToRead"])


def _fails_as_a_whole(step: Any) -> bool:
    return isinstance(_details(step), ua.ReadProcessedDetails) or type(_details(step)) is ua.ExtensionObject


def _faults(step: Any, operation: Any) -> Faults:
    """Of one node of a read."""
    found: Faults = []
    if not faults.class_of(operation.NodeId):
        found.append({"BadNodeIdUnknown", "BadNodeIdInvalid"})
    elif operation.NodeId not in _KEPT:
        found.append({"BadHistoryOperationUnsupported", "BadHistoryOperationInvalid", "BadUserAccessDenied"})
    if operation.ContinuationPoint:
        found.append({"BadContinuationPointInvalid"})
    if operation.IndexRange:
        found.append({"BadIndexRangeInvalid", "BadIndexRangeNoData"})
    if has_encoding(operation):
        found.append(DATA_ENCODING)
    if not _is_raw(step) or _is_modified(step):
        found.append({"BadHistoryOperationUnsupported", "BadInvalidArgument"})
    elif _is_too_little(step):
        found.append({"BadHistoryOperationInvalid", "BadHistoryOperationUnsupported"})
    if step.asked.get("TimestampsToReturn") == ua.TimestampsToReturn.Server:
        found.append({"BadTimestampNotSupported"})
    return found


def _several(seen: Seen, server: str) -> bool:
    if seen.operation is None:
        return False
    found = _faults(seen.step, seen.operation)
    return len(found) > 1 and {str(seen.values[OURS]), str(seen.values[server])} <= set[str]().union(*found)


def _with_server_time(seen: Seen, server: str) -> bool:
    theirs = [one.removesuffix(" with server time") for one in seen.values[server] or ()]
    return theirs == seen.values[OURS]


def _asks_for_bounds(step: Any) -> bool:
    return _is_raw(step) and _details(step).ReturnBounds


def _has_more(seen: Seen, server: str) -> bool:
    ours, theirs = seen.values[OURS], seen.values[server]
    if isinstance(ours, list) and isinstance(theirs, list):
        return ours == theirs[: len(ours)]
    return (ours, theirs) in (("GoodNoData", "Good"), (False, True))


OF_HISTORY: Final = (
    Difference(
        "HistoryRead",
        "several faults in one operation",
        ANYTHING,
        ANY,
        FIRST_FAULT,
        ANY_ORDER,
        when=_several,
    ),
    Difference(
        "HistoryRead",
        "details that are not ReadRawModifiedDetails",
        ANYTHING,
        open62541("BadNotSupported"),
        "Part 4 §5.11.3.4",
        "Each node has its own result; open62541's store reads raw values alone.",
        path="result",
        when=of_step(lambda step: not _is_raw(step)),
    ),
    Difference(
        "HistoryRead",
        "a node that is no variable, or details that are none or of aggregates",
        ("Good", "BadTimestampsToReturnInvalid"),
        node_opcua("BadHistoryOperationInvalid"),
        "Part 4 §5.11.3.4",
        "Each node has its own result, and another may be read.",
        path="result",
        when=of_step(lambda step: _asks_of_no_variable(step) or _fails_as_a_whole(step)),
    ),
    Difference(
        "HistoryRead",
        "fewer than two of start, end and number",
        ("Good",),
        open62541("BadHistoryOperationInvalid"),
        "Part 11 §6.5.3.2",
        "Each node has its own result, which is this one.",
        path="result",
        when=of_step(lambda step: _is_raw(step) and _is_too_little(step)),
    ),
    Difference(
        "HistoryRead",
        "timestamps that there are not, or neither of them",
        ("BadTimestampsToReturnInvalid",),
        both("Good"),
        "Part 4 §5.11.3.2",
        "It shall be refused.",
        path="result",
        when=of_step(lambda step: step.asked["TimestampsToReturn"] in _NO_TIMES),
    ),
    Difference(
        "HistoryRead",
        "to release continuation points, with timestamps that there are not",
        ("Good",),
        both("BadTimestampsToReturnInvalid"),
        "Part 4 §5.11.3.2",
        "Nothing is read.",
        path="result",
        when=of_step(_releases),
    ),
    Difference(
        "HistoryRead",
        "to release continuation points, also such that are not there",
        ANYTHING,
        ANY,
        "Part 4 §5.11.3.2",
        "Nothing is read, and what is not there need not be released.",
        path=_RESULTS,
        when=of_step(_releases),
    ),
    Difference(
        "HistoryRead",
        "a variable without a history",
        ("BadHistoryOperationUnsupported",),
        open62541("BadUserAccessDenied"),
        "Part 4 §5.11.3.4",
        "It has none, whoever asks.",
        when=of_operation(lambda one: one.NodeId not in _KEPT),
    ),
    Difference(
        "HistoryRead",
        "server times",
        ("BadTimestampNotSupported",),
        both("Good", "GoodNoData"),
        "Part 11 §6.5.3.2",
        "Only source times are kept.",
        when=of_step(lambda step: step.asked["TimestampsToReturn"] == ua.TimestampsToReturn.Server),
    ),
    Difference(
        "HistoryRead",
        "source and server times",
        ANYTHING,
        {OPEN62541: ANYTHING},
        "Part 11 §6.5.3.2",
        "Only source times are kept; there a sample is given one where it has none.",
        path=r"Results\[\d+\]\.values",
        when=_with_server_time,
    ),
    Difference(
        "HistoryRead",
        "nothing in that time",
        ("GoodNoData",),
        node_opcua("Good"),
        "Part 11 §6.5.3.2",
        "The code says so.",
        when=of_step(_is_raw),
    ),
    Difference(
        "HistoryRead",
        "bounds",
        ANYTHING,
        {NODE_OPCUA: ANYTHING},
        "Part 11 §6.5.3.2",
        "They are values of their own; node-opcua's store gives none.",
        path=_RESULTS,
        when=of_step(_asks_for_bounds),
    ),
    Difference(
        "HistoryRead",
        "the last bound of a read in pages",
        ("True",),
        open62541("False"),
        "Part 11 §6.5.3.2",
        "It is the last value; open62541's store leaves it out where it has a page of its own.",
        path=r"Results\[\d+\]\.goes on",
        when=of_step(lambda step: _asks_for_bounds(step) and _details(step).NumValuesPerNode > 0),
    ),
    Difference(
        "HistoryRead",
        "bounds of a moment",
        ANYTHING,
        {OPEN62541: ANYTHING},
        "Part 11 §6.5.3.2",
        "Its value is both bounds, and without one those beside it are.",
        path=_RESULTS,
        when=of_step(
            lambda step: _asks_for_bounds(step) and _details(step).StartTime == _details(step).EndTime
        ),
    ),
    Difference(
        "HistoryRead",
        "a value at the end of the range",
        ANYTHING,
        {NODE_OPCUA: ANYTHING},
        "Part 11 §6.5.3.2",
        "The end is not part of it.",
        path=_RESULTS,
        when=lambda seen, server: _has_two_ends(seen.step) and _has_more(seen, server),
    ),
    Difference(
        "HistoryRead",
        "an `indexRange` of what has no elements",
        ("Good", "GoodNoData"),
        open62541("BadIndexRangeNoData"),
        "Part 4 §7.27",
        "Each sample says so.",
        when=of_operation(lambda one: bool(one.IndexRange)),
    ),
    Difference(
        "HistoryRead",
        "an `indexRange`",
        ANYTHING,
        {NODE_OPCUA: ANYTHING},
        "Part 4 §7.27",
        "It counts here, too.",
        path=_RESULTS,
        when=of_operation(lambda one: bool(one.IndexRange)),
    ),
    Difference(
        "HistoryRead",
        "modified values",
        ("BadHistoryOperationUnsupported", "BadContinuationPointInvalid"),
        {
            OPEN62541: ("BadInvalidArgument", "Good", "GoodNoData"),
            NODE_OPCUA: ("BadUnexpectedError",),
        },
        "Part 11 §6.5.3.3",
        "Nothing can be modified.",
        when=of_step(_is_modified),
    ),
)
