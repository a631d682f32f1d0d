"""The differences that are known, of alarms and their methods."""

from __future__ import annotations

from typing import Any, Final

from asyncua import ua

from tests.compare.difference import ANYTHING, Difference, node_opcua, of_operation
from tests.compare.play import Seen
from tests.compare.servers import NODE_OPCUA, OURS

_REFRESHES: Final = {
    ua.NodeId(ua.ObjectIds.ConditionType_ConditionRefresh),
    ua.NodeId(ua.ObjectIds.ConditionType_ConditionRefresh2),
}


def _is_refresh(call: Any) -> bool:
    return call.MethodId in _REFRESHES


def _but_for_refreshing(seen: Seen, server: str) -> bool:
    ours = [one for one in seen.values[OURS] or () if "the refresh of the conditions" not in str(one)]
    return ours == (seen.values[server] or [])


OF_ALARMS: Final = (
    Difference(
        "Call",
        "ConditionRefresh of a subscription or an item that is not there",
        ("BadSubscriptionIdInvalid", "BadMonitoredItemIdInvalid"),
        node_opcua("Good"),
        "Part 9 §5.5.7, §5.5.8",
        "Nobody is told anything.",
        when=of_operation(_is_refresh),
    ),
    Difference(
        "Publish",
        "RefreshStartEvent and RefreshEndEvent, for a filter that they do not pass",
        ANYTHING,
        {NODE_OPCUA: ANYTHING},
        "Part 9 §5.5.7",
        "A client knows by them what belongs to the refresh, whatever it has filtered.",
        path=r"events \d+",
        when=_but_for_refreshing,
    ),
)
