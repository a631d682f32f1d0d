"""Event filters as clients write them, and an event to try them on."""

from __future__ import annotations

from datetime import UTC, datetime

from asyncua import ua

from bridge.uaserver.filters.eventfilter import Occurrence

Ids, Kind, Op = ua.ObjectIds, ua.VariantType, ua.FilterOperator
SERVER = ua.NodeId(Ids.Server)


def chosen(
    *path: str,
    type_id: int = Ids.BaseEventType,
    attribute: int = ua.AttributeIds.Value,
    index_range: str = "",
) -> ua.SimpleAttributeOperand:
    return ua.SimpleAttributeOperand(
        ua.NodeId(type_id), [ua.QualifiedName(name, 0) for name in path], attribute, index_range
    )


def element(operator: Op, *operands: object) -> ua.ContentFilterElement:
    """Element of a filter. What is no operand is meant as a literal."""
    kinds = ua.FilterOperand | ua.ExtensionObject
    made = [one if isinstance(one, kinds) else literal(one) for one in operands]
    return ua.ContentFilterElement(operator, made)


def literal(value: object) -> ua.LiteralOperand:
    return ua.LiteralOperand(value if isinstance(value, ua.Variant) else ua.Variant(value))


def at(index: int) -> ua.ElementOperand:
    return ua.ElementOperand(index)


def asked(
    *elements: ua.ContentFilterElement, select: list[ua.SimpleAttributeOperand] | None = None
) -> ua.EventFilter:
    fields = [chosen("Message")] if select is None else select
    return ua.EventFilter(fields, ua.ContentFilter(list(elements)))


EVENT = Occurrence(
    SERVER,
    {
        "EventType": ua.Variant(ua.NodeId(Ids.AuditWriteUpdateEventType), Kind.NodeId),
        "SourceName": ua.Variant("conveyor/fu1", Kind.String),
        "Message": ua.Variant(ua.LocalizedText("emergency", "en"), Kind.LocalizedText),
        "Severity": ua.Variant(700, Kind.UInt16),
        "Time": ua.Variant(datetime(2026, 1, 1, tzinfo=UTC), Kind.DateTime),
    },
)
SEVERITY, SOURCE, MESSAGE = chosen("Severity"), chosen("SourceName"), chosen("Message")
ABSENT = chosen("LocalTime")
