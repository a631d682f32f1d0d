"""Faults that the validators of a model find: each is a text with a code, which both languages have."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Final

_VALIDATORS: Final = {"AfterValidator", "BeforeValidator", "field_validator", "model_validator"}


def raised_in_words(source: str) -> Iterator[int]:
    """Lines of a module with validators that raise words without a code."""
    nodes = list(ast.walk(ast.parse(source)))
    imported = {name.name for node in nodes if isinstance(node, ast.ImportFrom) for name in node.names}
    if not imported & _VALIDATORS:
        return
    for node in nodes:
        match node:
            case ast.Raise(exc=ast.Call(func=ast.Name(id="ValueError"))):
                yield node.lineno
            case _:
                pass


def test_no_validator_raises_words_without_a_code() -> None:
    found = {
        str(path): lines
        for path in Path("bridge").rglob("*.py")
        if (lines := list(raised_in_words(path.read_text(encoding="utf-8"))))
    }
    assert not found


def test_words_of_a_validator_are_found() -> None:
    validator = "from pydantic import field_validator\n"
    assert list(raised_in_words(validator + 'raise ValueError("no")\nraise Unfit(said)\n')) == [2]
    assert not list(raised_in_words('raise ValueError("no")\n'))
