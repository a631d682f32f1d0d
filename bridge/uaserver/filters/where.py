"""The where clause of an event filter: ContentFilter (OPC 10000-4 §7.7), with its three truth values.

None is the third one, NULL: what is compared with nothing, or with something of another kind.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from bridge.uaserver.hierarchy import EventTypes
from bridge.uaserver.library import AttributeIds, StatusCodes, get, make, status, ua

Operator = ua.FilterOperator
_MOST_ELEMENTS: Final = 100
_VALUE: Final = AttributeIds.Value
MOST_OPERANDS: Final = 500

Fields = Mapping[str, ua.Variant]
"""Fields of an event by ``field_name``."""
CONDITION_ID: Final = ""
"""Name of the field that is a condition's own NodeId."""
_Operand = Callable[[Fields, Sequence[Any]], Any]
"""Operand: its value for an event, and for what the elements after its own have come to."""


def _compared(how: Callable[[Any, Any], bool]) -> Callable[..., bool | None]:
    def compare(left: Any, right: Any) -> bool | None:
        if left is None or right is None:
            return None
        try:
            return how(left, right)
        except (TypeError, AttributeError):  # the latter from asyncua's NodeId
            return None

    return compare


_AT_LEAST: Final = _compared(operator.ge)
_AT_MOST: Final = _compared(operator.le)


def _and(left: Any, right: Any) -> bool | None:
    if left is False or right is False:
        return False
    return True if left is True and right is True else None


def _or(left: Any, right: Any) -> bool | None:
    if left is True or right is True:
        return True
    return False if left is False and right is False else None


def _not(value: Any) -> bool | None:
    return None if value is None else value is False


def _between(value: Any, low: Any, high: Any) -> bool | None:
    return _and(_AT_LEAST(value, low), _AT_MOST(value, high))


def _in_list(value: Any, *listed: Any) -> bool | None:
    return None if value is None else value in listed


def _is_null(value: Any) -> bool:
    return value is None


_OPERATORS: Final[Mapping[ua.FilterOperator, tuple[int, int, Callable[..., bool | None]]]] = {
    Operator.Equals: (2, 2, _compared(operator.eq)),
    Operator.IsNull: (1, 1, _is_null),
    Operator.GreaterThan: (2, 2, _compared(operator.gt)),
    Operator.LessThan: (2, 2, _compared(operator.lt)),
    Operator.GreaterThanOrEqual: (2, 2, _AT_LEAST),
    Operator.LessThanOrEqual: (2, 2, _AT_MOST),
    Operator.Not: (1, 1, _not),
    Operator.Between: (3, 3, _between),
    Operator.InList: (2, MOST_OPERANDS, _in_list),
    Operator.And: (2, 2, _and),
    Operator.Or: (2, 2, _or),
}
"""Least and greatest number of operands of each operator, and its evaluation. OfType is made for each
filter."""


@dataclass(frozen=True, slots=True)
class _Element:
    judge: Callable[..., bool | None]
    operands: Sequence[_Operand]


@dataclass(frozen=True, slots=True)
class Where:
    """Without elements everything passes."""

    elements: Sequence[_Element]

    @property
    def operands(self) -> int:
        return sum(len(element.operands) for element in self.elements)

    def passes(self, fields: Fields) -> bool:
        # An element refers to later ones only, so each is worked out once, from the last to the first.
        values: list[Any] = [None] * len(self.elements)
        for place in reversed(range(len(self.elements))):
            element = self.elements[place]
            values[place] = element.judge(*(operand(fields, values) for operand in element.operands))
        return values[0] is True if values else True


def where_clause(
    asked: ua.ContentFilter, types: EventTypes
) -> tuple[Where | None, list[ua.ContentFilterElementResult]]:
    """The clause, None for one with a fault, and what is to be said of each of its elements."""
    asked_elements: list[ua.ContentFilterElement] = get(asked, "Elements") or []
    operand_count = sum(len(get(one, "FilterOperands") or []) for one in asked_elements)
    if len(asked_elements) > _MOST_ELEMENTS or operand_count > MOST_OPERANDS:
        return None, []
    elements: list[_Element] = []
    results: list[ua.ContentFilterElementResult] = []
    for place, one in enumerate(asked_elements):
        operands: list[object] = get(one, "FilterOperands") or []
        codes = [_operand_fault(operand, place, len(asked_elements), types) for operand in operands]
        code = _element_fault(get(one, "FilterOperator"), operands, codes, types)
        results.append(_told(code, codes))
        if not code:
            elements.append(_element(get(one, "FilterOperator"), operands, types))
    return (Where(elements) if len(elements) == len(asked_elements) else None), results


def _element_fault(
    wanted: ua.FilterOperator, operands: Sequence[object], codes: Sequence[int], types: EventTypes
) -> int:
    if wanted == Operator.OfType:
        low, high = 1, 1
    elif wanted in _OPERATORS:
        low, high, _ = _OPERATORS[wanted]
    else:
        return StatusCodes.BadFilterOperatorUnsupported
    if not low <= len(operands) <= high:
        return StatusCodes.BadFilterOperandCountMismatch
    if any(codes):
        return StatusCodes.BadFilterOperandInvalid
    if wanted == Operator.OfType and _literal(operands[0]) not in types:
        return StatusCodes.BadFilterOperandInvalid
    return StatusCodes.Good


def _operand_fault(operand: object, place: int, count: int, types: EventTypes) -> int:
    if isinstance(operand, ua.SimpleAttributeOperand):
        return types.fault(operand)
    if isinstance(operand, ua.ElementOperand):
        is_later = place < get(operand, "Index") < count
        return StatusCodes.Good if is_later else StatusCodes.BadFilterOperandInvalid
    is_literal = isinstance(operand, ua.LiteralOperand)
    return StatusCodes.Good if is_literal else StatusCodes.BadFilterOperandInvalid


def _told(code: int, codes: Sequence[int]) -> ua.ContentFilterElementResult:
    return make(
        ua.ContentFilterElementResult,
        StatusCode=status(code),
        OperandStatusCodes=[status(one) for one in codes],
    )


def _element(wanted: ua.FilterOperator, operands: Sequence[object], types: EventTypes) -> _Element:
    if wanted == Operator.OfType:
        kind: ua.NodeId = _literal(operands[0])
        return _Element(partial(types.is_of, wanted=kind), [_event_type])
    return _Element(_OPERATORS[wanted][2], [_value_of(operand) for operand in operands])


def _event_type(fields: Fields, _values: Sequence[Any]) -> Any:
    return _plain(fields.get("EventType"))


def _value_of(operand: object) -> _Operand:
    if isinstance(operand, ua.ElementOperand):
        index: int = get(operand, "Index")
        return lambda _fields, values: values[index]
    if isinstance(operand, ua.LiteralOperand):
        value = _literal(operand)
        return lambda _fields, _values: value
    name = field_name(operand)
    return lambda fields, _values: None if name is None else _plain(fields.get(name))


def field_name(operand: object) -> str | None:
    """The field that is meant, None for what no event has: its path, names of another namespace with its
    index: ``Message``, ``AckedState/Id``, ``2:Code``."""
    path: list[ua.QualifiedName] = get(operand, "BrowsePath") or []
    attribute: int = get(operand, "AttributeId")
    if not path:
        return CONDITION_ID if attribute == AttributeIds.NodeId else None
    return "/".join(own_name(one.Name, one.NamespaceIndex) for one in path) if attribute == _VALUE else None


def own_name(name: str | None, namespace: int) -> str:
    """Name of a field in ``Fields``, of a namespace other than the standard's with its index."""
    return f"{namespace}:{name}" if namespace else str(name)


def _literal(operand: object) -> Any:
    return _plain(get(operand, "Value")) if isinstance(operand, ua.LiteralOperand) else None


def _plain(held: ua.Variant | None) -> Any:
    """A value that can be compared: of a LocalizedText its text."""
    value = held.Value if isinstance(held, ua.Variant) else held
    return value.Text if isinstance(value, ua.LocalizedText) else value
