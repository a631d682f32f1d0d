"""Findings of pydantic, in words for people who edit the file."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Sequence
from typing import Any, Final, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from bridge.base.data_type_texts import text_of_misfit
from bridge.canopen.datatypes import DataTypeError
from bridge.text import Said, Text
from bridge.tomlfile.unfit import Unfit

_LONGEST_SHOWN: Final = 40

_WRONG_TYPE: Final = {
    "string_type": Text.of("toml.type_text"),
    "int_type": Text.of("toml.type_whole_number"),
    "float_type": Text.of("toml.type_number"),
    "bool_type": Text.of("toml.type_bool"),
    "list_type": Text.of("toml.type_list"),
    "dict_type": Text.of("toml.type_table"),
    "model_type": Text.of("toml.type_table"),
    "finite_number": Text.of("toml.finite"),
}
_SAYS_ALL: Final = ("missing", "extra_forbidden", "too_short", "too_long")
"""Kinds of fault for which the value itself would tell nothing."""


def explain(model: type[BaseModel], detail: ErrorDetails) -> tuple[Text, Said]:
    """Message and hint for one fault that pydantic found in ``model``'s data."""
    said = _said(detail)
    shown = "" if detail["type"] in _SAYS_ALL else _shown(detail.get("input"))
    if shown:
        said = Text.of("toml.not", said=said, shown=shown)
    return said, _hint(model, detail)


def _said(detail: ErrorDetails) -> Text:
    facts: dict[str, Any] = detail.get("ctx", {})
    match detail["type"]:
        case "value_error" if isinstance(facts["error"], Unfit):
            return facts["error"].said
        case "value_error" if isinstance(facts["error"], DataTypeError):
            return text_of_misfit(facts["error"])
        case "missing":
            return Text.of("toml.missing")
        case "extra_forbidden":
            return Text.of("toml.unknown_key")
        case "literal_error" | "enum":
            *others, last = (_in_quotes(one) for one in _choices(detail))
            if others:
                return Text.of("toml.one_of", choices=tuple(others), last=last)
            return Text.of("toml.only", choice=last)
        case "greater_than_equal":
            return Text.of("toml.at_least", least=str(facts["ge"]))
        case "less_than_equal":
            return Text.of("toml.at_most", most=str(facts["le"]))
        case "greater_than":
            return Text.of("toml.more_than", limit=str(facts["gt"]))
        case "less_than":
            return Text.of("toml.less_than", limit=str(facts["lt"]))
        case "too_short":
            return Text.of("toml.too_few", least=str(facts["min_length"]))
        case "too_long":
            return Text.of("toml.too_many", most=str(facts["max_length"]))
        case "string_too_short":
            return Text.of("toml.empty")
        case "string_too_long":
            return Text.of("toml.too_long", most=str(facts["max_length"]))
        case kind:
            return _WRONG_TYPE.get(kind) or _of_pydantic(detail["msg"])


def _of_pydantic(message: str) -> Text:
    words = message.removeprefix("Value error, ")
    words = f"{words[:1].lower()}{words[1:]}"
    return Text.plain(words)


def _choices(detail: ErrorDetails) -> list[str]:
    """The values that a choice has, out of pydantic's sentence of them."""
    return re.findall(r"'([^']*)'", str(detail.get("ctx", {}).get("expected")))


def _in_quotes(text: str) -> str:
    return f'"{text}"'


def _shown(value: object) -> str:
    """The value as it is in the file; nothing for tables, lists and what is too long for a line."""
    if isinstance(value, bool | str):
        text = json.dumps(value, ensure_ascii=False)
    elif isinstance(value, float) or (isinstance(value, int) and abs(value) < 1 << 64):
        text = str(value)
    else:
        return ""
    return text if len(text) <= _LONGEST_SHOWN else ""


def _hint(model: type[BaseModel], detail: ErrorDetails) -> Said:
    location = detail["loc"]
    fields = _fields(model, location)
    name = str(location[-1]) if location else ""
    if detail["type"] == "extra_forbidden":
        near = difflib.get_close_matches(name, fields, n=1)
        if near:
            return Text.of("toml.did_you_mean", name=near[0])
        return Text.of("toml.known_here", names=tuple(sorted(fields)))
    if detail["type"] in ("literal_error", "enum"):
        near = difflib.get_close_matches(str(detail["input"]), _choices(detail), n=1)
        if near:
            return Text.of("toml.did_you_mean", name=_in_quotes(near[0]))
    field = fields.get(name)
    return Text.plain(field.description) if field and field.description else ""


def _fields(model: type[BaseModel], location: Sequence[int | str]) -> dict[str, FieldInfo]:
    """The keys of the table that ``location`` ends in, as they are written in the file."""
    here: type[BaseModel] | None = model
    for part in location[:-1]:
        if here is None or isinstance(part, int):
            continue
        field = _by_name(here).get(part)
        here = _submodel(field.annotation) if field else here
    return _by_name(here) if here else {}


def _by_name(model: type[BaseModel]) -> dict[str, FieldInfo]:
    return {field.alias or name: field for name, field in model.model_fields.items()}


def _submodel(annotation: Any) -> type[BaseModel] | None:
    """The model inside an annotation such as ``list[Node] | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in get_args(annotation):
        found = _submodel(argument)
        if found:
            return found
    return None
