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

_LONGEST_SHOWN: Final = 40

_SENTENCES: Final = {
    "missing": "is missing",
    "extra_forbidden": "is not a key that belongs here",
    "string_type": "must be a text in quotes",
    "int_type": "must be a whole number",
    "float_type": "must be a number",
    "bool_type": "must be true or false",
    "list_type": "must be a list",
    "dict_type": "must be a table",
    "model_type": "must be a table",
    "finite_number": "must be a finite number",
    "literal_error": "must be {expected}",
    "enum": "must be {expected}",
    "greater_than_equal": "must be at least {ge}",
    "less_than_equal": "must be at most {le}",
    "greater_than": "must be more than {gt}",
    "less_than": "must be less than {lt}",
    "too_short": "must have {min_length} or more entries",
    "too_long": "must have {max_length} entries or fewer",
    "string_too_short": "must not be empty",
    "string_too_long": "must have at most {max_length} characters",
}
_SAYS_ALL: Final = ("missing", "extra_forbidden", "too_short", "too_long")
"""Kinds of fault for which the value itself would tell nothing."""


def explain(model: type[BaseModel], detail: ErrorDetails) -> tuple[str, str]:
    """Message and hint for one fault that pydantic found in ``model``'s data."""
    kind = detail["type"]
    context = {name: _plain(value) for name, value in detail.get("ctx", {}).items()}
    if kind in _SENTENCES:
        message = _SENTENCES[kind].format(**context)
    else:
        text = detail["msg"].removeprefix("Value error, ")
        message = f"{text[:1].lower()}{text[1:]}"
    if kind not in _SAYS_ALL:
        message += _shown(detail.get("input"))
    return message, _hint(model, detail)


def _plain(value: object) -> object:
    return value.replace("'", '"') if isinstance(value, str) else value


def _shown(value: object) -> str:
    """``, not …`` with the value as it is in the file; nothing for tables and lists."""
    if isinstance(value, bool | str):
        text = json.dumps(value, ensure_ascii=False)
    elif isinstance(value, float) or (isinstance(value, int) and abs(value) < 1 << 64):
        text = str(value)
    else:
        return ""
    return f", not {text}" if len(text) <= _LONGEST_SHOWN else ""


def _hint(model: type[BaseModel], detail: ErrorDetails) -> str:
    location = detail["loc"]
    fields = _fields(model, location)
    name = str(location[-1]) if location else ""
    if detail["type"] == "extra_forbidden":
        near = difflib.get_close_matches(name, fields, n=1)
        return f"did you mean {near[0]}?" if near else f"known here: {', '.join(sorted(fields))}"
    if detail["type"] in ("literal_error", "enum"):
        choices = re.findall(r"'([^']*)'", str(detail.get("ctx", {}).get("expected")))
        near = difflib.get_close_matches(str(detail["input"]), choices, n=1)
        if near:
            return f'did you mean "{near[0]}"?'
    field = fields.get(name)
    return (field.description or "") if field else ""


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
