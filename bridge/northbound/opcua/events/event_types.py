"""The bridge's event types in the address space: their fields, and that the server sends them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple

from asyncua.server.address_space import NodeManagementService

from bridge.command import EventKind
from bridge.northbound.opcua.space.nodes import pascal_case
from bridge.uaserver.library import ObjectIds, get, make, node_id, text, ua

Kind = ua.VariantType

BASE_TYPE: Final = "DriveEventType"
_SCALAR: Final = -1
_ONE_DIMENSION: Final = 1


class EventField(NamedTuple):
    """Field of an event type of ours. A rank of 1 is an array."""

    name: str
    type: ua.VariantType
    rank: int = _SCALAR


TOLD_FIELDS: Final = (EventField("Code", Kind.String), EventField("Facts", Kind.String))
"""Fields that a message is made of: the code of its text, and the facts in it as JSON."""
DRIVE_EVENT_FIELDS: Final = (
    *TOLD_FIELDS,
    EventField("Cause", Kind.LocalizedText),
    EventField("User", Kind.String),
    EventField("PreviousOwner", Kind.String),
    EventField("EmergencyCode", Kind.UInt16),
)
ALARM_FIELDS: Final = (
    *TOLD_FIELDS,
    EventField("Cause", Kind.LocalizedText),
    EventField("Remedy", Kind.LocalizedText),
    EventField("Explains", Kind.String, _ONE_DIMENSION),
    EventField("Owner", Kind.String),
    EventField("FaultNumber", Kind.String),
    EventField("EmergencyCode", Kind.UInt16),
)
ALARM_TYPES: Final = {
    "drive": "DriveAlarmType",
    "node": "NodeAlarmType",
    "bus": "BusAlarmType",
    "bridge": "BridgeAlarmType",
    "front": "FrontAlarmType",
}
"""Subtypes of ``BASE_ALARM_TYPE`` by what they are about."""
BASE_ALARM_TYPE: Final = "DriveBridgeAlarmType"
CERTIFICATE_ALARM_TYPE: Final = "CertificateAlarmType"
"""Subtype of the standard's CertificateExpirationAlarmType."""


def type_name(kind: EventKind) -> str:
    return f"{pascal_case(kind.value)}EventType"


class EventTypeMaker:
    """Makes types in the address space of ``management``, with ids that are their names, in ``namespace``."""

    def __init__(self, management: NodeManagementService, namespace: int) -> None:
        self._management = management
        self._namespace = namespace

    def make(self, name: str, parent: ua.NodeId, fields: Iterable[EventField] = ()) -> ua.NodeId:
        """Make a type below ``parent``. Raises UaError where there is one already."""
        where = node_id(name, self._namespace)
        attributes = make(ua.ObjectTypeAttributes, DisplayName=text(name))
        self._add(where, name, parent, ObjectIds.HasSubtype, ua.NodeClass.ObjectType, attributes)
        for field in fields:
            self._add_field(where, name, field)
        return where

    def generates(self, kind: ua.NodeId) -> None:
        """Say of the Server object's type that it sends events of ``kind`` and below (Part 3 §7.15)."""
        item = make(
            ua.AddReferencesItem,
            SourceNodeId=node_id(ObjectIds.ServerType),
            ReferenceTypeId=node_id(ObjectIds.GeneratesEvent),
            IsForward=True,
            TargetNodeId=kind,
            TargetNodeClass=ua.NodeClass.ObjectType,
        )
        (code,) = self._management.add_references([item])
        code.check()

    def _add_field(self, owner: ua.NodeId, above: str, field: EventField) -> None:
        where = node_id(f"{above}/{field.name}", self._namespace)
        attributes = make(
            ua.VariableAttributes,
            DisplayName=text(field.name),
            DataType=node_id(field.type.value),
            ValueRank=field.rank,
            AccessLevel=ua.AccessLevel.CurrentRead.mask,
            UserAccessLevel=ua.AccessLevel.CurrentRead.mask,
        )
        property_type = node_id(ObjectIds.PropertyType)
        self._add(
            where, field.name, owner, ObjectIds.HasProperty, ua.NodeClass.Variable, attributes, property_type
        )
        item = make(
            ua.AddReferencesItem,
            SourceNodeId=where,
            ReferenceTypeId=node_id(ObjectIds.HasModellingRule),
            IsForward=True,
            TargetNodeId=node_id(ObjectIds.ModellingRule_Mandatory),
            TargetNodeClass=ua.NodeClass.Object,
        )
        (code,) = self._management.add_references([item])
        code.check()

    def _add(
        self,
        where: ua.NodeId,
        name: str,
        parent: ua.NodeId,
        reference: int,
        node_class: ua.NodeClass,
        attributes: object,
        type_definition: ua.NodeId | None = None,
    ) -> None:
        item = make(
            ua.AddNodesItem,
            RequestedNewNodeId=where,
            BrowseName=ua.QualifiedName(name, self._namespace),
            NodeClass=node_class,
            ParentNodeId=parent,
            ReferenceTypeId=node_id(reference),
            NodeAttributes=attributes,
            TypeDefinition=type_definition or ua.NodeId(),
        )
        (result,) = self._management.add_nodes([item])
        get(result, "StatusCode").check()
