"""CHANGELOG.md: one line for each change, grouped under headings."""

from __future__ import annotations

import pytest

from tests.support.process import REPOSITORY

MAX_LENGTH = 160


def entries() -> list[str]:
    """Lines of all versions, without headings and blank lines; the preamble and introductions left out."""
    _, *sections = (REPOSITORY / "CHANGELOG.md").read_text(encoding="utf-8").split("\n### ")
    lines = [line for section in sections for line in section.splitlines()[1:]]
    return [line for line in lines if line and not line.startswith("#")]


def test_there_are_entries() -> None:
    assert len(entries()) > 100


@pytest.mark.parametrize(
    "is_right",
    [
        lambda line: line.startswith("- "),
        lambda line: len(line) <= MAX_LENGTH,
        lambda line: line.endswith((".", ".)")),
    ],
    ids=["an item of a list", "short", "a sentence"],
)
def test_each_line_is(is_right) -> None:
    assert [line for line in entries() if not is_right(line)] == []


def test_no_entry_stands_twice() -> None:
    assert len(set(entries())) == len(entries())
