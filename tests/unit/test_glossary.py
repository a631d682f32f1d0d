"""The glossary names what there is, each word once, in an order in which it is found."""

from __future__ import annotations

import re

from tests.support.process import REPOSITORY

PAGE = REPOSITORY / "docs" / "reference" / "glossary.md"
ROW = re.compile(r"^\| ([a-z][^|]*?) \| ([^|]+) \| ([^|]+) \|$", re.M)
HEAD = "word"


def parts() -> list[list[tuple[str, str, str]]]:
    """The rows below each heading."""
    sections = PAGE.read_text(encoding="utf-8").split("\n## ")[1:]
    return [[row for row in ROW.findall(section) if row[0] != HEAD] for section in sections]


def test_each_word_stands_once_and_in_its_order() -> None:
    words = [[row[0] for row in part] for part in parts()]
    assert [sorted(part, key=lambda word: word.replace(" ", "")) for part in words] == words
    everything = [word for part in words for word in part]
    assert len(everything) > 40
    assert len(set(everything)) == len(everything)


def test_what_it_points_to_is_there() -> None:
    files = [name for part in parts() for row in part for name in re.findall(r"`(bridge/[^`]+)`", row[2])]
    assert len(files) > 10
    assert [name for name in files if not (REPOSITORY / name).exists()] == []


def test_every_word_is_explained_by_something_to_look_at() -> None:
    assert [row[0] for part in parts() for row in part if "(" not in row[2] and "`" not in row[2]] == []
