"""Facts of pydantic models as the documentation's tables show them: keys, types, defaults, bounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined


@dataclass(frozen=True, slots=True)
class KeyFacts:
    """One key of a file, as the pages show it."""

    type: str
    default: str
    allowed: str


def model_tables(model: type[BaseModel], leaves: tuple[type, ...] = ()) -> dict[str, dict[str, KeyFacts]]:
    """Every TOML table of ``model`` by its header, with its keys. ``leaves`` are models written as text."""
    found: dict[str, dict[str, KeyFacts]] = {}
    _walk(model, "", found, leaves)
    return found


def _walk(
    model: type[BaseModel], path: str, found: dict[str, dict[str, KeyFacts]], leaves: tuple[type, ...]
) -> None:
    for name, info in model.model_fields.items():
        key = f"{path}.{name}" if path else name
        inner, is_list = _inner_model(info.annotation, leaves)
        if inner is None:
            header = path
            found.setdefault(header, {})[name] = _facts(info)
        else:
            if get_origin(info.annotation) is dict:
                key = f"{key}.NAME"
            _walk(inner, key, found, leaves)
            header = f"[[{key}]]" if is_list else f"[{key}]"
            if key in found:  # a table that has nothing but tables has no header
                found[header] = found.pop(key)


def _inner_model(annotation: Any, leaves: tuple[type, ...]) -> tuple[type[BaseModel] | None, bool]:
    if annotation in leaves:
        return None, False
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation, False
    for argument in get_args(annotation):
        inner, is_list = _inner_model(argument, leaves)
        if inner:
            return inner, is_list or get_origin(annotation) is list
    return None, False


def _facts(info: FieldInfo) -> KeyFacts:
    kinds, allowed = _kinds(info.annotation)
    bounds = _bounds(info.metadata) or allowed
    if info.is_required():
        default = "required"
    else:
        value = info.get_default(call_default_factory=True)
        default = "–" if value is None or value is PydanticUndefined else toml_value(value)
    return KeyFacts(kinds, default, bounds)


def _kinds(annotation: Any) -> tuple[str, str]:
    """Type and allowed values in words."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        kind, allowed = _kinds(arguments[0])
        metadata = [m for a in arguments[1:] for m in (a.metadata if isinstance(a, FieldInfo) else [a])]
        return kind, _bounds(metadata) or allowed
    if origin in (Union, UnionType):
        kinds = [_kinds(argument) for argument in arguments if argument is not type(None)]
        return (" or ".join(kind for kind, _ in kinds), "") if len(kinds) > 1 else kinds[0]
    if origin is Literal:
        return "string", ", ".join(f'"{value}"' for value in arguments)
    if origin is list:
        inner = _kinds(arguments[0])[0]
        plural = inner.replace("list of", "lists of") if inner.startswith("list of") else f"{inner}s"
        return f"list of {plural}", ""
    if origin is dict:
        inner = _kinds(arguments[1])[0]
        plural = inner.replace("list of", "lists of", 1) if "list of" in inner else f"{inner}s"
        return f"table of {plural.replace(' or ', 's or ')}", ""
    if isinstance(annotation, type) and issubclass(annotation, Enum):
        return "string", ", ".join(f'"{member.value}"' for member in annotation)
    names = {str: "string", int: "integer", float: "number", bool: "boolean"}
    return names.get(annotation, "object"), ""


def _bounds(metadata: list[Any]) -> str:
    low = high = None
    for item in metadata:
        low = getattr(item, "ge", low)
        high = getattr(item, "le", high)
        if (above := getattr(item, "gt", None)) is not None:
            return f"above {above}"
    if low is None:
        return ""
    return f"{low}…{high}" if high is not None else f"from {low}"


def toml_value(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return f"[{', '.join(toml_value(item) for item in value)}]"  # pyright: ignore[reportUnknownVariableType]
    if isinstance(value, Mapping):
        return "{}"
    return str(value)
