"""Fields of a condition's events, and of the condition where clients read it (OPC 10000-9 §5.5 to §5.8)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Final

from bridge.uaserver.condition_state import MAX_TIME_SHELVED_MS, ConditionState, Shelving
from bridge.uaserver.library import GOOD, ObjectIds, StatusCodes, data_value, node_id, status, ua, variant
from bridge.uaserver.where import CONDITION_ID, Fields

Kind = ua.VariantType

STATES: Final = (
    "enabled",
    "disabled",
    "active",
    "inactive",
    "acknowledged",
    "unacknowledged",
    "confirmed",
    "unconfirmed",
    *Shelving,
)
"""Names of the states, for which there are words."""
_SHELVING_ID: Final = {
    Shelving.UNSHELVED: ObjectIds.ShelvedStateMachineType_Unshelved,
    Shelving.TIMED: ObjectIds.ShelvedStateMachineType_TimedShelved,
    Shelving.ONE_SHOT: ObjectIds.ShelvedStateMachineType_OneShotShelved,
}
_TRUE: Final = variant(True, Kind.Boolean)
_FALSE: Final = variant(False, Kind.Boolean)
_NO_BRANCH: Final = variant(ua.NodeId(), Kind.NodeId)
_GOOD: Final = variant(GOOD, Kind.StatusCode)
_MAX_TIME_SHELVED: Final = variant(MAX_TIME_SHELVED_MS, Kind.Double)
_NO_DATA: Final = data_value(variant(None, Kind.Null), status(StatusCodes.BadNoData))
_NO_TIME: Final = variant(None, Kind.Null)


@dataclass(frozen=True, slots=True)
class AlarmContent:
    """Content of an alarm at present. ``more`` are fields of its own type, by ``where.field_name``."""

    message: ua.LocalizedText
    severity: int
    more: Fields = field(default_factory=dict[str, ua.Variant])


@dataclass(frozen=True, slots=True)
class ConditionPlace:
    """Subject of a condition. ``emitters`` are the nodes whose events tell of it, ``fixed`` the fields
    that never change."""

    node: ua.NodeId
    source_name: str
    emitters: tuple[ua.NodeId, ...]
    fixed: Fields


def condition_place(
    node: ua.NodeId,
    kind: ua.NodeId,
    name: str,
    source: tuple[ua.NodeId, str],
    emitters: Iterable[ua.NodeId],
    condition_class: tuple[int, ua.LocalizedText],
    more: Fields,
) -> ConditionPlace:
    """``kind`` is its event type, ``source`` the node that it is about with its name, ``condition_class`` the
    type and name of its class (§5.9), ``more`` are fields of its type."""
    source_node, source_name = source
    class_id, class_name = condition_class
    return ConditionPlace(
        node,
        source_name,
        tuple(emitters),
        {
            CONDITION_ID: variant(node, Kind.NodeId),
            "EventType": variant(kind, Kind.NodeId),
            "SourceNode": variant(source_node, Kind.NodeId),
            "SourceName": variant(source_name, Kind.String),
            "InputNode": variant(source_node, Kind.NodeId),
            "ConditionName": variant(name, Kind.String),
            "ConditionClassId": variant(node_id(class_id), Kind.NodeId),
            "ConditionClassName": variant(class_name, Kind.LocalizedText),
            "BranchId": _NO_BRANCH,
            "MaxTimeShelved": _MAX_TIME_SHELVED,
            "Quality": _GOOD,
            **more,
        },
    )


class ConditionWords:
    """Names of states as ``words`` has them, made once."""

    def __init__(self, words: Callable[[str], ua.LocalizedText]) -> None:
        self._made = {name: variant(words(name), Kind.LocalizedText) for name in STATES}

    def two_state(self, path: str, is_true: bool, words: tuple[str, str], time_ms: float) -> Fields:
        """TwoStateVariableType (§5.2). ``words`` are those for true and for false."""
        return {
            path: self._made[words[0] if is_true else words[1]],
            f"{path}/Id": _flag(is_true),
            f"{path}/TransitionTime": moment(time_ms),
        }

    def shelving(self, state: ConditionState, now_ms: float) -> Fields:
        left_ms = max(0.0, state.unshelve_at_ms - now_ms) if state.shelved else 0.0
        return {
            "SuppressedOrShelved": _flag(state.shelved),
            "ShelvingState/CurrentState": self._made[state.shelving],
            "ShelvingState/CurrentState/Id": variant(node_id(_SHELVING_ID[state.shelving]), Kind.NodeId),
            "ShelvingState/UnshelveTime": variant(left_ms, Kind.Double),
        }


def condition_fields(
    place: ConditionPlace,
    state: ConditionState,
    content: AlarmContent,
    words: ConditionWords,
    now_ms: float,
) -> dict[str, ua.Variant]:
    """All fields but those of the event itself, which ``event_fields`` has."""
    comment = state.comment
    acked, confirmed = ("acknowledged", "unacknowledged"), ("confirmed", "unconfirmed")
    return {
        **place.fixed,
        "Message": variant(content.message, Kind.LocalizedText),
        "Severity": variant(state.severity, Kind.UInt16),
        "LastSeverity": variant(state.last_severity, Kind.UInt16),
        "LastSeverity/SourceTimestamp": moment(state.severity_ms),
        "Quality/SourceTimestamp": moment(state.active_ms),
        "Retain": _flag(state.retain),
        "Comment": variant(_comment(state), Kind.LocalizedText),
        "Comment/SourceTimestamp": moment(comment.time_ms),
        "ClientUserId": variant(comment.user, Kind.String),
        **words.two_state("EnabledState", state.enabled, ("enabled", "disabled"), state.enabled_ms),
        **words.two_state("ActiveState", state.active, ("active", "inactive"), state.active_ms),
        **words.two_state("AckedState", state.acked, acked, state.acked_ms),
        **words.two_state("ConfirmedState", state.confirmed, confirmed, state.confirmed_ms),
        **words.shelving(state, now_ms),
        **content.more,
    }


def event_fields(event_id: bytes, time_ms: float) -> dict[str, ua.Variant]:
    """Fields of one event of a condition (Part 5 §6.4.2). It comes from this server: it was received when it
    was made."""
    time = moment(time_ms)
    return {"EventId": variant(event_id, Kind.ByteString), "Time": time, "ReceiveTime": time}


def field_value(fields: Fields, name: str) -> ua.DataValue:
    """Value of a field where clients read it: BadNoData for one that has none."""
    held = fields.get(name)
    return _NO_DATA if held is None or held.Value is None else data_value(held)


def moment(time_ms: float) -> ua.Variant:
    """A time in ms since 1970; null for 0, which stands for none."""
    if not time_ms:
        return _NO_TIME
    return variant(datetime.fromtimestamp(time_ms / 1000, UTC), Kind.DateTime)


def _comment(state: ConditionState) -> ua.LocalizedText:
    comment = state.comment
    return ua.LocalizedText(comment.text, comment.locale or None) if comment.text else ua.LocalizedText()


def _flag(value: bool) -> ua.Variant:
    return _TRUE if value else _FALSE
