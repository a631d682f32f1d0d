"""What the properties of variables and methods hold, and the attributes of new nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from bridge.northbound.opcua.library import ObjectIds, make, node_id, text, ua, variant
from bridge.northbound.opcua.nodes import Argument, ArgumentType, VariableKind, VariableNode, enum_strings
from bridge.northbound.opcua.units import UNIT_NAMESPACE, unit_description, unit_id

READ: Final = 1
READ_WRITE: Final = 3

_SAMPLING_MS: Final = 50.0
_SCALAR: Final = -1
_ONE_DIMENSION: Final = 1
_ARGUMENT_TYPE: Final = {
    ArgumentType.INT32: ObjectIds.Int32,
    ArgumentType.UINT32: ObjectIds.UInt32,
    ArgumentType.STRING: ObjectIds.String,
    ArgumentType.ANY: ObjectIds.BaseDataType,
}

Property = tuple[str, ua.Variant, int]
"""BrowseName, value, data type."""


def properties(node: VariableNode) -> list[Property]:
    """The properties that Part 8 gives a variable of this kind."""
    point = node.point
    match node.kind:
        case VariableKind.ANALOG:
            found = [_structure("EngineeringUnits", _unit(point.unit), ObjectIds.EUInformation)]
            if point.low is not None and point.high is not None:
                limits = make(ua.Range, Low=float(point.low), High=float(point.high))
                found.append(_structure("EURange", limits, ObjectIds.Range))
            return found
        case VariableKind.MULTI_STATE:
            return [_texts("EnumStrings", [text(state) for state in enum_strings(point.states)])]
        case VariableKind.TWO_STATE:
            return [_texts("FalseState", text("false")), _texts("TrueState", text("true"))]
        case VariableKind.PLAIN:
            return []


def arguments(name: str, described: Sequence[Argument]) -> Property:
    """The property of a method called ``name``: InputArguments or OutputArguments."""
    structures = [
        make(
            ua.Argument,
            Name=argument.name,
            DataType=node_id(_ARGUMENT_TYPE[argument.type]),
            ValueRank=_SCALAR,
            Description=text(argument.description),
        )
        for argument in described
    ]
    return _structure(name, structures, ObjectIds.Argument)


def _structure(name: str, value: object, data_type: int) -> Property:
    return name, variant(value, ua.VariantType.ExtensionObject), data_type


def _texts(name: str, value: object) -> Property:
    return name, variant(value, ua.VariantType.LocalizedText), ObjectIds.LocalizedText


def _unit(unit: str) -> ua.EUInformation:
    return make(
        ua.EUInformation,
        NamespaceUri=UNIT_NAMESPACE,
        UnitId=unit_id(unit),
        DisplayName=text(unit),
        Description=text(unit_description(unit)),
    )


def property_attributes(value: ua.Variant, data_type: int) -> ua.VariableAttributes:
    rank = _ONE_DIMENSION if value.is_array else _SCALAR
    return _variable_attributes(data_type, READ, rank, Value=value)


def point_attributes(kind: ua.VariantType, *, writable: bool) -> ua.VariableAttributes:
    access = READ_WRITE if writable else READ
    return _variable_attributes(kind.value, access, _SCALAR, MinimumSamplingInterval=_SAMPLING_MS)


def _variable_attributes(data_type: int, access: int, rank: int, **more: object) -> ua.VariableAttributes:
    return make(
        ua.VariableAttributes,
        DataType=node_id(data_type),
        ValueRank=rank,
        AccessLevel=access,
        UserAccessLevel=access,
        Historizing=False,
        **more,
    )
