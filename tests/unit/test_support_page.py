"""The page of what tests share: every file of it is there once, and nothing else."""

from __future__ import annotations

import re

import pytest

from tests.support.docs import Page
from tests.support.process import REPOSITORY

FOLDER = REPOSITORY / "tests" / "support"
TEXT = (FOLDER / "README.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| `([a-z_]+\.[a-z]+)` \| (.+) \|$", TEXT, re.MULTILINE)


def test_every_file_is_on_the_page_once() -> None:
    files = sorted(file.name for file in FOLDER.iterdir() if file.suffix in (".py", ".json"))
    assert sorted(name for name, _ in ROWS) == files


def test_each_is_said_something_else_of() -> None:
    said = [text for _, text in ROWS]
    assert len(set(said)) == len(said)
    assert all(text.endswith(".") for text in said)


@pytest.mark.parametrize("link", Page(FOLDER / "README.md").links)
def test_every_link_leads_somewhere(link: str) -> None:
    assert (FOLDER / link).is_file()


def test_every_part_of_the_exploration_is_in_its_story() -> None:
    story = TEXT.partition("| File |")[0]
    parts = {file.stem for file in FOLDER.glob("leg_*.py")} - {"leg_outputs"}
    assert {part for part in parts if part not in story} == set()
