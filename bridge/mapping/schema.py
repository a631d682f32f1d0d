"""JSON schema of mapping files, made from the models: editors check and complete by it.

A file that extends another, or that can only be extended, need not be whole: for those nothing is required.
"""

from __future__ import annotations

import json
from typing import Any, Final, cast

from bridge.mapping.model import Family

TITLE: Final = "drivebridge mapping file"


def mapping_schema() -> dict[str, Any]:
    """Schema as a JSON document."""
    whole = Family.model_json_schema(by_alias=True)
    definitions = cast("dict[str, Any]", _plain(whole.pop("$defs")))
    definitions["Family"] = _plain(whole)
    parts = {f"Part{name}": _without_required(definition) for name, definition in definitions.items()}
    is_template = {
        "properties": {"family": {"properties": {"template": {"const": True}}, "required": ["template"]}},
        "required": ["family"],
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": TITLE,
        "if": {"anyOf": [{"required": ["extends"]}, is_template]},
        "then": {"$ref": "#/$defs/PartFamily"},
        "else": {"$ref": "#/$defs/Family"},
        "$defs": {**definitions, **parts},
    }


def schema_text() -> str:
    """Content of ``mappings/schema.json``."""
    return json.dumps(mapping_schema(), indent=1, ensure_ascii=False) + "\n"


def _plain(node: Any) -> Any:
    """A copy without the titles that pydantic makes of the names."""
    if isinstance(node, list):
        return [_plain(item) for item in cast("list[Any]", node)]
    if not isinstance(node, dict):
        return node
    items = cast("dict[str, Any]", node).items()
    return {name: _plain(value) for name, value in items if name != "title" or not isinstance(value, str)}


def _without_required(node: Any) -> Any:
    """A copy in which no key is required, and which refers to such copies."""
    if isinstance(node, list):
        return [_without_required(item) for item in cast("list[Any]", node)]
    if not isinstance(node, dict):
        return node
    table = cast("dict[str, Any]", node)
    copy: dict[str, Any] = {}
    for name, value in table.items():
        if name == "$ref" and isinstance(value, str):
            copy[name] = value.replace("#/$defs/", "#/$defs/Part")
        elif name != "required" or not isinstance(value, list):
            copy[name] = _without_required(value)
    return copy


if __name__ == "__main__":
    print(schema_text(), end="")
