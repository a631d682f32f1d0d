"""Titles of the objects of a device description."""

from __future__ import annotations

from bridge.derive.toml import file_name
from bridge.eds import Description, Entry


def title_of(description: Description, entry: Entry) -> str:
    """The entry's title; the object's goes first where the entry is one of several."""
    one = description.object(entry.index)
    if one is None or not one.object_type.has_subs or entry.name.lower().startswith(one.name.lower()):
        return entry.name
    return f"{one.name} {entry.name}"


def name_of(title: str, entry: Entry) -> str:
    """A name in lower_snake_case."""
    words = file_name(title).replace("-", "_")
    return words if words[:1].isalpha() else f"object_{entry.index:04x}_{entry.sub:02x}"
