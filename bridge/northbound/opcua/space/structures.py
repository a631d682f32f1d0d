"""Content of the properties of variables and methods, and the attributes of new nodes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Final

from bridge.northbound.opcua.space.data_values import VARIANT_TYPE
from bridge.northbound.opcua.space.engineering_units import UNIT_NAMESPACE, unit_description, unit_id
from bridge.northbound.opcua.space.nodes import (
    Argument,
    ArgumentType,
    MethodNode,
    VariableKind,
    VariableNode,
    enum_strings,
)
from bridge.northbound.opcua.space.words import spoken, state_named
from bridge.text import Text, Words
from bridge.uaserver.library import ObjectIds, change, make, node_id, text, ua, variant

READ: Final = 1
READ_WRITE: Final = 3
READ_HISTORY: Final = 4

_SAMPLING_MS: Final = 50.0
_SCALAR: Final = -1
_ONE_DIMENSION: Final = 1
_ARGUMENT_TYPE: Final = {
    ArgumentType.INT32: ObjectIds.Int32,
    ArgumentType.UINT32: ObjectIds.UInt32,
    ArgumentType.STRING: ObjectIds.String,
    ArgumentType.TEXT: ObjectIds.LocalizedText,
    ArgumentType.ANY: ObjectIds.BaseDataType,
}


@dataclass(frozen=True, slots=True, eq=False)
class Property:
    """A property, one object for all nodes that have the same."""

    name: str
    value: ua.Variant
    data_type: int


@dataclass(frozen=True, slots=True)
class PropertyNode:
    id: str
    content: Property

    @property
    def browse_name(self) -> str:
        return self.content.name


def property_nodes(node: MethodNode | VariableNode) -> Iterator[PropertyNode]:
    """The properties of a method, or those that Part 8 gives a variable of this kind."""
    for found in _arguments(node) if isinstance(node, MethodNode) else _properties(node):
        yield PropertyNode(f"{node.id}/{found.name}", found)


def _properties(node: VariableNode) -> Iterator[Property]:
    point = node.point
    match node.kind:
        case VariableKind.ANALOG:
            yield _engineering_units(point.unit)
            if point.low is not None and point.high is not None:
                # One range for -0.0 and 0.0, too.
                yield _range(point.low + 0.0, point.high + 0.0)
        case VariableKind.MULTI_STATE:
            yield _enum_strings(point.states)
        case VariableKind.MULTI_STATE_VALUE:
            yield _enum_values(point.states)
            yield VALUE_AS_TEXT
        case VariableKind.TWO_STATE:
            yield from _TWO_STATE
        case VariableKind.PLAIN:
            pass


def _arguments(node: MethodNode) -> Iterator[Property]:
    if node.arguments:
        yield _described("InputArguments", node.arguments)
    if node.results:
        yield _described("OutputArguments", node.results)


@cache
def _described(name: str, arguments: tuple[Argument, ...]) -> Property:
    structures = [
        make(
            ua.Argument,
            Name=argument.name,
            DataType=node_id(_ARGUMENT_TYPE[argument.type]),
            ValueRank=_SCALAR,
            Description=spoken(argument.description),
        )
        for argument in arguments
    ]
    return _structure(name, structures, ObjectIds.Argument)


@cache
def units_of(unit: str) -> ua.Variant:
    """Engineering units of a point with this unit."""
    return variant(_unit(unit), ua.VariantType.ExtensionObject)


@cache
def range_of(low: float, high: float) -> ua.Variant:
    return variant(make(ua.Range, Low=low, High=high), ua.VariantType.ExtensionObject)


@cache
def _engineering_units(unit: str) -> Property:
    return Property("EngineeringUnits", units_of(unit), ObjectIds.EUInformation)


@cache
def _range(low: float, high: float) -> Property:
    return Property("EURange", range_of(low, high), ObjectIds.Range)


@cache
def _enum_strings(states: tuple[tuple[int, Words], ...]) -> Property:
    return _texts("EnumStrings", [state_named(state) for state in enum_strings(states)])


@cache
def _enum_values(states: tuple[tuple[int, Words], ...]) -> Property:
    values = [make(ua.EnumValueType, Value=code, DisplayName=state_named(state)) for code, state in states]
    return _structure("EnumValues", values, ObjectIds.EnumValueType)


def _structure(name: str, value: object, data_type: int) -> Property:
    return Property(name, variant(value, ua.VariantType.ExtensionObject), data_type)


def _texts(name: str, value: object) -> Property:
    return Property(name, variant(value, ua.VariantType.LocalizedText), ObjectIds.LocalizedText)


VALUE_AS_TEXT: Final = _texts("ValueAsText", ua.LocalizedText())
"""The state that the value is (Part 8 §5.3.3.4): each node has its own."""

_TWO_STATE: Final = (
    _texts("FalseState", spoken(Text.of("truth.false"))),
    _texts("TrueState", spoken(Text.of("truth.true"))),
)


def _unit(unit: str) -> ua.EUInformation:
    return make(
        ua.EUInformation,
        NamespaceUri=UNIT_NAMESPACE,
        UnitId=unit_id(unit),
        DisplayName=text(unit),
        Description=spoken(unit_description(unit)),
    )


def value_type(node: VariableNode) -> ua.VariantType:
    return VARIANT_TYPE[node.point.data_type] if node.bit is None else ua.VariantType.Boolean


def property_attributes(content: Property) -> ua.VariableAttributes:
    rank = _ONE_DIMENSION if content.value.is_array else _SCALAR
    return variable_attributes(content.data_type, READ, rank, Value=content.value)


def point_attributes(
    kind: ua.VariantType, *, writable: bool = False, kept: bool = False
) -> ua.VariableAttributes:
    """``kept``: past values are."""
    access = (READ_WRITE if writable else READ) | (READ_HISTORY if kept else 0)
    made = variable_attributes(kind.value, access, _SCALAR, MinimumSamplingInterval=_SAMPLING_MS)
    return change(made, Historizing=kept)


def variable_attributes(data_type: int, access: int, rank: int, **more: object) -> ua.VariableAttributes:
    return make(
        ua.VariableAttributes,
        DataType=node_id(data_type),
        ValueRank=rank,
        AccessLevel=access,
        UserAccessLevel=access,
        Historizing=False,
        **more,
    )
