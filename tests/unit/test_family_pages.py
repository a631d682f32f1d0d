"""The pages that are made from the mapping files are those of today's files."""

from __future__ import annotations

from bridge.mapping import family_names
from tests.support.docs import Page
from tests.support.process import REPOSITORY
from tools.family_pages.pages import pages

FOLDER = REPOSITORY / "docs" / "reference" / "families"


def test_the_pages_are_up_to_date() -> None:
    shown = {path.name: path.read_text(encoding="utf-8") for path in FOLDER.glob("*.md")}
    made = pages()
    assert shown.keys() == made.keys(), "run `make docs`"
    old = [name for name, text in made.items() if shown[name] != text]
    assert not old, "run `make docs`"


def test_every_family_has_a_page_that_the_index_names() -> None:
    index = Page(FOLDER / "index.md")
    assert [row["mapping"] for row in index.table("Drive families")] == [
        f"[{name}]({name.replace('/', '-')}.md)" for name in family_names()
    ]


def test_a_page_says_what_the_file_says() -> None:
    page = Page(FOLDER / "lenze-8400-motec.md")
    values = {row["point"]: row for row in page.table("Values")}
    assert values["command/velocity"]["made of"] == "setpoint_1 × C00011 / 16384"
    states = {row["state"]: row["word & mask = value"] for row in page.table("States")}
    assert states["operation_enabled"] == "0F00h = 0500h"
    codes = {row["code"]: row["text"] for row in page.table("Emergency codes")}
    assert codes["8130h"] == "life guarding error or heartbeat error"
    parameters = {row["name"]: row["object"] for row in page.table("Parameters")}
    assert parameters["C00039/1"] == "5FD8:01"
    assert "»Engineer«" in "".join(page.section("What is special")), "the file's own comments"
