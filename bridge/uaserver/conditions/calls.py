"""Methods of conditions as clients call them: which they are, and their arguments (OPC 10000-9 §5.5 to §5.8).

A client names the method of the type; that of a condition's own object is the same node.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from bridge.uaserver.library import ObjectIds, ServiceError, StatusCodes, get, make, node_id, status, ua

LONGEST_COMMENT: Final = 1_000
_LONGEST_LOCALE: Final = 50
_LONGEST_EVENT_ID: Final = 100
_INTEGERS: Final = (
    ua.VariantType.Byte,
    ua.VariantType.UInt16,
    ua.VariantType.UInt32,
    ua.VariantType.Int16,
    ua.VariantType.Int32,
    ua.VariantType.Int64,
    ua.VariantType.UInt64,
)
_NUMBERS: Final = (*_INTEGERS, ua.VariantType.Float, ua.VariantType.Double)


class ArgumentKind(Enum):
    EVENT_ID = "EventId"
    COMMENT = "Comment"
    SHELVING_TIME = "ShelvingTime"
    SUBSCRIPTION = "SubscriptionId"
    ITEM = "MonitoredItemId"


@dataclass(frozen=True, slots=True)
class ConditionMethod:
    name: str
    arguments: tuple[ArgumentKind, ...] = ()

    @property
    def is_refresh(self) -> bool:
        return ArgumentKind.SUBSCRIPTION in self.arguments


_EVENT_AND_COMMENT: Final = (ArgumentKind.EVENT_ID, ArgumentKind.COMMENT)
_ONE_COMMENT: Final = (ArgumentKind.COMMENT,)
_TIMED: Final = ConditionMethod("TimedShelve", (ArgumentKind.SHELVING_TIME,))
_TIMED_2: Final = ConditionMethod("TimedShelve", (ArgumentKind.SHELVING_TIME, ArgumentKind.COMMENT))
_ONCE: Final = ConditionMethod("OneShotShelve")
_ONCE_2: Final = ConditionMethod("OneShotShelve", _ONE_COMMENT)
_UNSHELVE: Final = ConditionMethod("Unshelve")
_UNSHELVE_2: Final = ConditionMethod("Unshelve", _ONE_COMMENT)

METHODS: Final[Mapping[ua.NodeId, ConditionMethod]] = {
    node_id(number): method
    for number, method in {
        ObjectIds.ConditionType_Enable: ConditionMethod("Enable"),
        ObjectIds.ConditionType_Disable: ConditionMethod("Disable"),
        ObjectIds.ConditionType_AddComment: ConditionMethod("AddComment", _EVENT_AND_COMMENT),
        ObjectIds.ConditionType_ConditionRefresh: ConditionMethod(
            "ConditionRefresh", (ArgumentKind.SUBSCRIPTION,)
        ),
        ObjectIds.ConditionType_ConditionRefresh2: ConditionMethod(
            "ConditionRefresh2", (ArgumentKind.SUBSCRIPTION, ArgumentKind.ITEM)
        ),
        ObjectIds.AcknowledgeableConditionType_Acknowledge: ConditionMethod(
            "Acknowledge", _EVENT_AND_COMMENT
        ),
        ObjectIds.AcknowledgeableConditionType_Confirm: ConditionMethod("Confirm", _EVENT_AND_COMMENT),
        ObjectIds.ShelvedStateMachineType_TimedShelve: _TIMED,
        ObjectIds.ShelvedStateMachineType_TimedShelve2: _TIMED_2,
        ObjectIds.ShelvedStateMachineType_OneShotShelve: _ONCE,
        ObjectIds.ShelvedStateMachineType_OneShotShelve2: _ONCE_2,
        ObjectIds.ShelvedStateMachineType_Unshelve: _UNSHELVE,
        ObjectIds.ShelvedStateMachineType_Unshelve2: _UNSHELVE_2,
        ObjectIds.AlarmConditionType_ShelvingState_TimedShelve: _TIMED,
        ObjectIds.AlarmConditionType_ShelvingState_TimedShelve2: _TIMED_2,
        ObjectIds.AlarmConditionType_ShelvingState_OneShotShelve: _ONCE,
        ObjectIds.AlarmConditionType_ShelvingState_OneShotShelve2: _ONCE_2,
        ObjectIds.AlarmConditionType_ShelvingState_Unshelve: _UNSHELVE,
        ObjectIds.AlarmConditionType_ShelvingState_Unshelve2: _UNSHELVE_2,
    }.items()
}
"""Methods by their NodeIds."""


class ArgumentFault(ServiceError):
    """Arguments that cannot be meant; ``faults`` is the status code of each, empty where their number is
    wrong."""

    def __init__(self, code: int, faults: Sequence[int] = ()) -> None:
        super().__init__(code)
        self.faults = faults


def arguments(method: ConditionMethod, given: Sequence[ua.Variant]) -> dict[ArgumentKind, Any]:
    """Arguments of a call. Raises ``ArgumentFault``."""
    if len(given) != len(method.arguments):
        few = len(given) < len(method.arguments)
        raise ArgumentFault(StatusCodes.BadArgumentsMissing if few else StatusCodes.BadTooManyArguments)
    pairs = list(zip(method.arguments, given, strict=True))
    faults = [_fault(kind, one) for kind, one in pairs]
    if any(faults):
        raise ArgumentFault(StatusCodes.BadInvalidArgument, faults)
    return {kind: one.Value for kind, one in pairs}


def _fault(kind: ArgumentKind, given: ua.Variant) -> int:
    if given.is_array:
        return StatusCodes.BadTypeMismatch
    value = given.Value
    match kind:
        case ArgumentKind.EVENT_ID:
            fits = value is None or isinstance(value, bytes)
            is_short = not fits or len(value or b"") <= _LONGEST_EVENT_ID
        case ArgumentKind.COMMENT:
            fits = value is None or isinstance(value, ua.LocalizedText)
            is_short = not fits or _is_short(value)
        case ArgumentKind.SHELVING_TIME:
            fits, is_short = given.VariantType in _NUMBERS, True
        case _:
            fits, is_short = given.VariantType in _INTEGERS, True
    if not fits:
        return StatusCodes.BadTypeMismatch
    return StatusCodes.Good if is_short else StatusCodes.BadOutOfRange


def _is_short(comment: ua.LocalizedText | None) -> bool:
    if comment is None:
        return True
    return len(comment.Text or "") <= LONGEST_COMMENT and len(comment.Locale or "") <= _LONGEST_LOCALE


def call_result(code: int, faults: Sequence[int] = ()) -> ua.CallMethodResult:
    return make(
        ua.CallMethodResult, StatusCode=status(code), InputArgumentResults=[status(one) for one in faults]
    )


def target_of(call: ua.CallMethodRequest) -> tuple[ua.NodeId, ua.NodeId, list[ua.Variant]]:
    """Object, method and arguments of a call."""
    return get(call, "ObjectId"), get(call, "MethodId"), get(call, "InputArguments") or []
