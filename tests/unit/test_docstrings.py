"""Docstrings, and descriptions of the keys of files, begin with the noun, or with the verb of what is done:
not with "What", "How" or "Of"."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.process import REPOSITORY

ROOMS = sorted(path.name for path in (REPOSITORY / "bridge").iterdir() if (path / "__init__.py").exists())
HEADLESS = frozenset(
    ("As", "By", "How", "Of", "Those", "What", "Whatever", "When", "Where", "Which", "Who", "Whose", "Why")
)


def docstrings(source: str) -> Iterator[str]:
    """Docstrings of modules, classes and functions, those below attributes, and descriptions of fields."""
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.keyword(arg="description", value=ast.Constant(value=str(text))):
                yield text
            case _:
                pass
        body = getattr(node, "body", None)
        for statement in body if isinstance(body, list) else []:
            value = statement.value if isinstance(statement, ast.Expr) else None
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                yield value.value


def headless(folder: Path) -> list[str]:
    """Docstrings of the modules in ``folder`` that begin with a headless clause, with their files."""
    return [
        f"{file.relative_to(folder)}: {text}"
        for file in sorted(folder.rglob("*.py"))
        for text in docstrings(file.read_text(encoding="utf-8"))
        if text.split(None, 1)[:1] and text.split(None, 1)[0].capitalize() in HEADLESS
    ]


@pytest.mark.parametrize("room", ROOMS)
def test_docstrings_begin_with_the_noun(room: str) -> None:
    assert headless(REPOSITORY / "bridge" / room) == []


def test_every_room_is_looked_at() -> None:
    assert {"command", "text", "uaserver"} <= set(ROOMS)


def test_a_headless_description_is_found(tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text('x = Field(1, description="how many of "\n    "them")\n')
    assert headless(tmp_path) == ["module.py: how many of them"]


def test_a_headless_docstring_is_found(tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text('class Tap:\n    x = 1\n    """What has come."""\n')
    assert headless(tmp_path) == ["module.py: What has come."]
