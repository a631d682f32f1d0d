"""The JSON schema beside the mapping files: what editors check them by."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest

from bridge.mapping.loader import mappings_dir
from bridge.mapping.schema import mapping_schema, schema_text

FILES = sorted(mappings_dir().rglob("*.toml"))
SCHEMA = mapping_schema()


def test_the_file_is_what_the_models_say() -> None:
    text = (mappings_dir() / "schema.json").read_text(encoding="utf-8")
    assert text == schema_text(), "python -m bridge.mapping.schema > mappings/schema.json"
    assert json.loads(text) == SCHEMA


def resolved(node: dict[str, Any]) -> list[dict[str, Any]]:
    """The alternatives of a schema, without references."""
    if "$ref" in node:
        return resolved(SCHEMA["$defs"][node["$ref"].rpartition("/")[2]])
    return [one for each in node["anyOf"] for one in resolved(each)] if "anyOf" in node else [node]


def unknown(value: Any, node: dict[str, Any], at: str = "") -> list[str]:
    """The keys of ``value`` that the schema does not have, or that it misses."""
    kinds = resolved(node)
    if isinstance(value, list):
        items = [kind["items"] for kind in kinds if "items" in kind]
        return [told for item in value for told in unknown(item, items[0], at)] if items else [f"{at}: list"]
    if not isinstance(value, dict):
        return []
    tables = [kind for kind in kinds if kind.get("type") == "object"]
    if not tables:
        return [f"{at}: table"]
    (table,) = tables
    known, rest = table.get("properties", {}), table.get("additionalProperties")
    told = [f"{at}.{name}" for name in value if name not in known and not rest]
    told += [f"{at} misses {name}" for name in table.get("required", ()) if name not in value]
    for name, item in value.items():
        told += unknown(item, known.get(name) or rest or {}, f"{at}.{name}")
    return told


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_every_mapping_file_fits_the_schema_and_names_it(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    hint = text.splitlines()[0]
    assert hint.startswith("#:schema "), "editors look for it in the first line"
    assert (file.parent / hint.removeprefix("#:schema ")).resolve() == mappings_dir() / "schema.json"
    data = tomllib.loads(text)
    is_part = "extends" in data or data["family"].get("template", False)
    assert not unknown(data, SCHEMA["then" if is_part else "else"])


def test_a_key_that_is_not_known_and_one_that_is_missing_are_faults() -> None:
    whole: dict[str, Any] = {}
    for name in ("faults", "5000"):
        whole |= tomllib.loads((mappings_dir() / "stoeber" / f"{name}.toml").read_text(encoding="utf-8"))
    del whole["family"]["vendor"]
    whole["slot"][0]["colour"] = "red"
    assert unknown(whole, SCHEMA["else"]) == [".family misses vendor", ".slot.colour"]
