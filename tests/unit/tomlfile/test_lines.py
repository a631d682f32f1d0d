"""Lines of the keys of a TOML file, wherever they are written."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.tomlfile import Key, TomlFile
from bridge.tomlfile.lines import key_lines


def file_of(folder: Path, content: str | bytes) -> TomlFile:
    path = folder / "some.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return TomlFile(path)


PLACES = '''\
# comment
title = "[not a header]"
long = """
[not.a.header]
key = "no key"
"""
quoted."with space" = 'a = 1'

[table]
list = [
  1,  # ] no end
  { name = "x", pattern = "]" },
  { name = "y", words = [
    "z" ] },
]
date = 1979-05-27 07:32:00
inline = { a = 1, b = { c = 2 } }
dotted.key = true

[[bus]]
name = "one"
[[bus.node]]
id = 1
  [[ bus . node . "drive" ]]
  slot = "fu1"
  [[bus.node.drive]]
  slot = "fu2"
[[bus.node]]
[bus.node.identity]
vendor_id = 5
[[bus]]
[[bus.node]]
id = 2
'''


@pytest.mark.parametrize(
    ("key", "line"),
    [
        (("title",), 2),
        (("long",), 3),
        (("quoted", "with space"), 7),
        (("table",), 9),
        (("table", "list"), 10),
        (("table", "list", 0), 11),
        (("table", "list", 1, "pattern"), 12),
        (("table", "list", 2, "name"), 13),
        (("table", "list", 2, "words"), 13),
        (("table", "list", 2, "words", 0), 14),
        (("table", "date"), 16),
        (("table", "inline", "a"), 17),
        (("table", "inline", "b", "c"), 17),
        (("table", "dotted", "key"), 18),
        (("bus", 0), 20),
        (("bus", 0, "name"), 21),
        (("bus", 0, "node", 0, "id"), 23),
        (("bus", 0, "node", 0, "drive", 0, "slot"), 25),
        (("bus", 0, "node", 0, "drive", 1, "slot"), 27),
        (("bus", 0, "node", 1), 28),
        (("bus", 0, "node", 1, "identity", "vendor_id"), 30),
        (("bus", 1), 31),
        (("bus", 1, "node", 0, "id"), 33),
        # What is not written counts as its table.
        (("bus", 0, "node", 1, "id"), 28),
        (("bus", 0, "node", 0, "drive", 1, "unit_id"), 26),
        (("table", "list", 2, "other"), 13),
        (("nowhere", 3), 0),
    ],
)
def test_keys_are_found_on_their_lines(tmp_path: Path, key: Key, line: int):
    assert file_of(tmp_path, PLACES).line(key) == line


def _keys(data: object, key: Key = ()) -> list[Key]:
    found: list[Key] = [key] if key else []
    if isinstance(data, dict):
        for name, value in data.items():
            found += _keys(value, (*key, name))
    elif isinstance(data, list):
        for position, value in enumerate(data):
            found += _keys(value, (*key, position))
    return found


def test_no_key_is_without_a_line(tmp_path: Path):
    file = file_of(tmp_path, PLACES)
    assert [key for key in _keys(file.data) if not file.line(key)] == []


_VALUE = st.recursive(
    st.one_of(st.integers(-9, 9), st.booleans(), st.text(max_size=5)),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(st.text(max_size=4), inner, max_size=3)
    ),
    max_leaves=10,
)


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return str(value)
    if isinstance(value, str):
        escaped = "".join(char if char.isalnum() else f"\\U{ord(char):08X}" for char in value)
        return f'"{escaped}"'
    if isinstance(value, list):
        return "[\n  " + ",\n  ".join(_written(item) for item in value) + "]"
    pairs = (f"{_written(name)} = {_written(item)}" for name, item in value.items())
    return "{ " + ", ".join(pairs) + " }"


@given(st.dictionaries(st.text(max_size=4), _VALUE, max_size=4))
def test_every_key_of_every_file_has_its_line(data: dict[str, Any]):
    text = "".join(f"# here\n{_written(name)} = {_written(value)}\n" for name, value in data.items())
    assert tomllib.loads(text) == data
    lines = key_lines(text)
    assert set(_keys(data)) == set(lines)
    all_lines = text.split("\n")
    for name in data:
        assert all_lines[lines[name,] - 1].startswith(f"{_written(name)} = ")
