"""Nodes of the alarms, made when somebody looks at them: each would be some fifty in asyncua's hands.

An alarm has the parts of its type that the server fills; methods are the type's own (OPC 10000-9 §5.12).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final, Protocol, cast

from asyncua.server.address_space import AddressSpace, AttributeValue, NodeData

from bridge.northbound.opcua.alarms.alarm_places import CERTIFICATE, AlarmPlace
from bridge.northbound.opcua.events.event_types import ALARM_FIELDS
from bridge.northbound.opcua.space.kinds import Kinds, Name, node_attributes
from bridge.northbound.opcua.space.structures import READ, variable_attributes
from bridge.uaserver.address_space import Attributes, Watchers, constant
from bridge.uaserver.conditions.condition_fields import field_value
from bridge.uaserver.conditions.conditions import Condition, Conditions
from bridge.uaserver.filters.where import own_name
from bridge.uaserver.hierarchy import reference_to
from bridge.uaserver.library import (
    AttributeIds,
    ObjectIds,
    make,
    node_id,
    ua,
)

Kind = ua.VariantType

SHELVING: Final = "ShelvingState"
_SCALAR: Final = -1
_HAS_CONDITION: Final = node_id(ObjectIds.HasCondition)
_HAS_COMPONENT: Final = node_id(ObjectIds.HasComponent)
_HAS_PROPERTY: Final = node_id(ObjectIds.HasProperty)
_HAS_TYPE_DEFINITION: Final = node_id(ObjectIds.HasTypeDefinition)
_METHODS: Final = {
    "": (
        ObjectIds.ConditionType_Enable,
        ObjectIds.ConditionType_Disable,
        ObjectIds.ConditionType_AddComment,
        ObjectIds.AcknowledgeableConditionType_Acknowledge,
        ObjectIds.AcknowledgeableConditionType_Confirm,
    ),
    SHELVING: (
        ObjectIds.AlarmConditionType_ShelvingState_TimedShelve,
        ObjectIds.AlarmConditionType_ShelvingState_OneShotShelve,
        ObjectIds.AlarmConditionType_ShelvingState_Unshelve,
    ),
}
"""Methods of an alarm's objects."""


@dataclass(frozen=True, slots=True)
class AlarmPart:
    """Part of every alarm: a variable, or without ``value`` an object. ``path`` is the field's name in events
    and, but for the namespaces, its place below the alarm."""

    path: str
    type_definition: int
    value: ua.VariantType | None = None
    data_type: int = 0
    rank: int = _SCALAR
    is_ours: bool = False

    @property
    def name(self) -> str:
        return self.path.rpartition("/")[2]

    @property
    def above(self) -> str:
        return self.path.rpartition("/")[0]

    @property
    def is_property(self) -> bool:
        return self.type_definition == ObjectIds.PropertyType


def _parts() -> Iterator[AlarmPart]:
    for name, kind in _PROPERTIES.items():
        yield AlarmPart(name, ObjectIds.PropertyType, kind, _DATA_TYPES.get(name, kind.value))
    for name in ("EnabledState", "ActiveState", "AckedState", "ConfirmedState"):
        yield _variable(name, ObjectIds.TwoStateVariableType, Kind.LocalizedText)
        yield AlarmPart(f"{name}/Id", ObjectIds.PropertyType, Kind.Boolean, ObjectIds.Boolean)
        yield AlarmPart(f"{name}/TransitionTime", ObjectIds.PropertyType, Kind.DateTime, ObjectIds.UtcTime)
    for name, kind in (
        ("Quality", Kind.StatusCode),
        ("LastSeverity", Kind.UInt16),
        ("Comment", Kind.LocalizedText),
    ):
        yield _variable(name, ObjectIds.ConditionVariableType, kind)
        yield AlarmPart(f"{name}/SourceTimestamp", ObjectIds.PropertyType, Kind.DateTime, ObjectIds.UtcTime)
    yield AlarmPart(SHELVING, ObjectIds.ShelvedStateMachineType)
    state = f"{SHELVING}/CurrentState"
    yield _variable(state, ObjectIds.FiniteStateVariableType, Kind.LocalizedText)
    yield AlarmPart(f"{state}/Id", ObjectIds.PropertyType, Kind.NodeId, ObjectIds.NodeId)
    yield AlarmPart(f"{SHELVING}/UnshelveTime", ObjectIds.PropertyType, Kind.Double, ObjectIds.Duration)
    for field in ALARM_FIELDS:
        yield AlarmPart(
            field.name, ObjectIds.PropertyType, field.type, field.type.value, field.rank, is_ours=True
        )


def _variable(path: str, type_definition: int, kind: ua.VariantType) -> AlarmPart:
    return AlarmPart(path, type_definition, kind, kind.value)


_PROPERTIES: Final = {
    "EventId": Kind.ByteString,
    "EventType": Kind.NodeId,
    "SourceNode": Kind.NodeId,
    "SourceName": Kind.String,
    "Time": Kind.DateTime,
    "ReceiveTime": Kind.DateTime,
    "Message": Kind.LocalizedText,
    "Severity": Kind.UInt16,
    "ConditionClassId": Kind.NodeId,
    "ConditionClassName": Kind.LocalizedText,
    "ConditionName": Kind.String,
    "BranchId": Kind.NodeId,
    "Retain": Kind.Boolean,
    "ClientUserId": Kind.String,
    "InputNode": Kind.NodeId,
    "SuppressedOrShelved": Kind.Boolean,
    "MaxTimeShelved": Kind.Double,
}
_DATA_TYPES: Final = {
    "Time": ObjectIds.UtcTime,
    "ReceiveTime": ObjectIds.UtcTime,
    "MaxTimeShelved": ObjectIds.Duration,
}
_PARTS: Final = {part.path: part for part in _parts()}
_OF_CERTIFICATE: Final = {
    part.path: part
    for part in (
        AlarmPart("NormalState", ObjectIds.PropertyType, Kind.NodeId, ObjectIds.NodeId),
        AlarmPart("ExpirationDate", ObjectIds.PropertyType, Kind.DateTime, ObjectIds.DateTime),
        AlarmPart("ExpirationLimit", ObjectIds.PropertyType, Kind.Double, ObjectIds.Duration),
        AlarmPart("CertificateType", ObjectIds.PropertyType, Kind.NodeId, ObjectIds.NodeId),
        AlarmPart("Certificate", ObjectIds.PropertyType, Kind.ByteString, ObjectIds.ByteString),
    )
}


@cache
def parts_of(kind: str) -> Mapping[str, AlarmPart]:
    """Parts of an alarm of this kind, by their paths."""
    return _PARTS | _OF_CERTIFICATE if kind == CERTIFICATE else _PARTS


class _AlarmNode:
    """An alarm, or a part of it, in place of asyncua's NodeData."""

    __slots__ = ("_nodes", "alarm", "part")

    def __init__(self, nodes: AlarmNodes, alarm: Alarm, part: AlarmPart | None) -> None:
        self._nodes = nodes
        self.alarm = alarm
        self.part = part

    @property
    def path(self) -> str:
        return self.part.path if self.part else ""

    @property
    def nodeid(self) -> ua.NodeId:
        return self._nodes.id_of(self.alarm, self.path)

    @property
    def name(self) -> Name:
        name = self.part.name if self.part else self.alarm.place.name
        return self._nodes.name_of(name, is_ours=self.part is None or self.part.is_ours)

    @property
    def references(self) -> list[ua.ReferenceDescription]:
        return list(self._nodes.references_of(self))

    @property
    def attributes(self) -> Attributes:
        own = _OWN if self.part is None or self.part.value is None else _OWN_OF_VARIABLE
        return Attributes(self._nodes.attributes_of(self.part), own, self)

    def refer(self, reference: ua.NodeId, *, forward: bool = True) -> ua.ReferenceDescription:
        kind = ua.NodeClass.Variable if self.part and self.part.value else ua.NodeClass.Object
        name = self.name
        type_id = node_id(self.part.type_definition) if self.part else self.alarm.type_id
        return ua.ReferenceDescription(
            reference, forward, self.nodeid, name.qualified, name.text, kind, type_id
        )

    def id_attribute(self) -> AttributeValue:
        made = constant(self.nodeid, Kind.NodeId)
        made.datachange_callbacks = self._nodes.never_called
        return made

    def value_attribute(self) -> AttributeValue:
        return ConditionValue(self._nodes.conditions, self.alarm.condition, self._nodes.field_of(self.path))


_OWN: Final[Mapping[int, Callable[[_AlarmNode], AttributeValue]]] = {
    AttributeIds.NodeId: _AlarmNode.id_attribute,
    AttributeIds.BrowseName: lambda node: node.name.browse_name,
    AttributeIds.DisplayName: lambda node: node.name.display_name,
}
_OWN_OF_VARIABLE: Final = {**_OWN, AttributeIds.Value: _AlarmNode.value_attribute}


class ConditionValue(AttributeValue):
    """Value of a condition's field, read whenever somebody asks."""

    value = None
    value_setter = None

    def __init__(self, conditions: Conditions, condition: Condition, field: str) -> None:
        self._conditions = conditions
        self._condition = condition
        self._field = field

    def read(self, *_: object) -> ua.DataValue:
        return field_value(self._conditions.fields(self._condition), self._field)

    value_callback = read  # pyright: ignore[reportAssignmentType]

    @property
    def datachange_callbacks(self) -> Watchers:  # pyright: ignore[reportIncompatibleVariableOverride]
        of_condition = self._conditions.watched.setdefault(self._condition.place.node, {})
        return of_condition.setdefault(self._field, {})


@dataclass(frozen=True, slots=True, eq=False)
class Alarm:
    """``type_id`` is its event type."""

    place: AlarmPlace
    condition: Condition
    type_id: ua.NodeId


def condition_of(where: ua.NodeId) -> ua.NodeId:
    """Alarm whose methods the object ``where`` has: itself, or its ShelvingState."""
    name, suffix = where.Identifier, f"/{SHELVING}"
    if not isinstance(name, str) or not name.endswith(suffix):
        return where
    return node_id(name.removesuffix(suffix), where.NamespaceIndex)


class _Referable(Protocol):
    def refer(self, reference: ua.NodeId, *, forward: bool) -> ua.ReferenceDescription: ...


class AlarmNodes:
    """The nodes of ``alarms`` in ``space``, beside those of the points."""

    def __init__(
        self,
        space: AddressSpace,
        namespace: int,
        kinds: Kinds,
        conditions: Conditions,
        alarms: Sequence[Alarm],
    ) -> None:
        self._space = space
        self._namespace = namespace
        self._kinds = kinds
        self._alarms = {one.place.id: one for one in alarms}
        self._of_owner: dict[str, list[Alarm]] = {}
        for one in alarms:
            self._of_owner.setdefault(one.place.owner, []).append(one)
        self.conditions = conditions
        self.never_called: Watchers = {}
        self.attributes_of = cache(self._attributes_of)
        self._to_type = cache(self._to_type_of)
        self._to_methods = cache(self._to_methods_of)

    def find(self, name: str) -> NodeData | None:
        """The node with this id, if it is an alarm's."""
        found = self._alarms.get(name)
        if found:
            return cast("NodeData", _AlarmNode(self, found, None))
        owner, mark, rest = name.rpartition("Alarm/")
        alarm = self._alarms.get(f"{owner}{mark.rstrip('/')}") if mark else None
        part = parts_of(alarm.place.kind).get(rest) if alarm else None
        return cast("NodeData", _AlarmNode(self, alarm, part)) if alarm and part else None

    def below(self, owner: str) -> Iterator[ua.ReferenceDescription]:
        """References of the object ``owner`` to its alarms."""
        for alarm in self._of_owner.get(owner, ()):
            node = _AlarmNode(self, alarm, None)
            yield node.refer(_HAS_COMPONENT)
            yield node.refer(_HAS_CONDITION)

    def id_of(self, alarm: Alarm, path: str) -> ua.NodeId:
        return node_id(f"{alarm.place.id}/{path}" if path else alarm.place.id, self._namespace)

    def name_of(self, name: str, *, is_ours: bool) -> Name:
        return self._kinds.name(name, self._namespace if is_ours else 0)

    def field_of(self, path: str) -> str:
        part = parts_of(CERTIFICATE)[path]
        return own_name(path, self._namespace) if part.is_ours else path

    def references_of(self, node: _AlarmNode) -> Iterator[ua.ReferenceDescription]:
        yield from self._upwards(node)
        yield self._to_type(node_id(node.part.type_definition) if node.part else node.alarm.type_id)
        for part in parts_of(node.alarm.place.kind).values():
            if part.above == node.path and part is not node.part:
                below = _AlarmNode(self, node.alarm, part)
                yield below.refer(_HAS_PROPERTY if part.is_property else _HAS_COMPONENT)
        yield from self._to_methods(node.path)

    def _upwards(self, node: _AlarmNode) -> Iterator[ua.ReferenceDescription]:
        if node.part is None:
            above = self._space[node_id(node.alarm.place.owner, self._namespace)]
            for reference in (_HAS_COMPONENT, _HAS_CONDITION):
                yield _refer_to(above, reference)
            return
        part = parts_of(node.alarm.place.kind).get(node.part.above)
        reference = _HAS_PROPERTY if node.part.is_property else _HAS_COMPONENT
        yield _AlarmNode(self, node.alarm, part).refer(reference, forward=False)

    def _to_type_of(self, kind: ua.NodeId) -> ua.ReferenceDescription:
        return reference_to(self._space, kind, _HAS_TYPE_DEFINITION, forward=True)

    def _to_methods_of(self, path: str) -> tuple[ua.ReferenceDescription, ...]:
        return tuple(
            reference_to(self._space, node_id(method), _HAS_COMPONENT, forward=True)
            for method in _METHODS.get(path, ())
        )

    def _attributes_of(self, part: AlarmPart | None) -> Mapping[AttributeIds, AttributeValue]:
        if part is None or part.value is None:
            return node_attributes(ua.NodeClass.Object, make(ua.ObjectAttributes, EventNotifier=0))
        wanted = variable_attributes(part.data_type, READ, part.rank)
        return node_attributes(ua.NodeClass.Variable, wanted)


def _refer_to(above: NodeData, reference: ua.NodeId) -> ua.ReferenceDescription:
    """The reference to what an alarm stands below, which is a node of the tree."""
    return cast("_Referable", above).refer(reference, forward=False)
