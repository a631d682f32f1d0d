"""Fields of a condition's events, and of the condition where clients read it (OPC 10000-9 §5.5 to §5.8)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Final

from bridge.uaserver.conditions.condition import MAX_TIME_SHELVED_MS, ConditionState, Shelving
from bridge.uaserver.filters.where import CONDITION_ID, Fields
from bridge.uaserver.library import GOOD, ObjectIds, StatusCodes, data_value, node_id, status, ua, variant

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
    """Subject of a condition: ``source``, called ``source_name``. ``emitters`` are the nodes whose events
    tell of it, ``common`` the fields that it has in common with all of its kind."""

    node: ua.NodeId
    source: ua.NodeId
    source_name: str
    emitters: tuple[ua.NodeId, ...]
    common: Fields

    def fields(self) -> Fields:
        """Fields that never change."""
        source = variant(self.source, Kind.NodeId)
        return {
            **self.common,
            CONDITION_ID: variant(self.node, Kind.NodeId),
            "SourceNode": source,
            "InputNode": source,
            "SourceName": variant(self.source_name, Kind.String),
        }


def common_fields(
    kind: ua.NodeId, name: str, class_id: int, class_name: ua.LocalizedText, more: Fields
) -> Fields:
    """Fields of all conditions of the event type ``kind`` that are called ``name``; ``class_id`` and
    ``class_name`` are those of their condition class (§5.9), ``more`` are fields of their type."""
    return {
        "EventType": variant(kind, Kind.NodeId),
        "ConditionName": variant(name, Kind.String),
        "ConditionClassId": variant(node_id(class_id), Kind.NodeId),
        "ConditionClassName": variant(class_name, Kind.LocalizedText),
        "BranchId": _NO_BRANCH,
        "MaxTimeShelved": _MAX_TIME_SHELVED,
        "Quality": _GOOD,
        **more,
    }


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
        **place.fields(),
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
