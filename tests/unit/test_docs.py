"""The pages of the documentation by themselves: links, marks, snippets.

How a page marks its blocks is described in ``tests/support/docs.py``.
"""

from __future__ import annotations

import configparser
import json
import re
import tomllib
from pathlib import Path

import pytest

from bridge.config import Site, load_site
from bridge.mapping import read_family
from tests.support.docs import (
    LINKED,
    RUN,
    Page,
    page,
    with_blocks,
)
from tests.support.process import REPOSITORY

LANGUAGES = {"console", "python", "toml", "json", "json5", "ini", "sh", "text"}


# the pages themselves


@pytest.mark.parametrize("page", LINKED, ids=repr)
def test_every_link_leads_somewhere(page: Page) -> None:
    for link in page.links:
        path, _, anchor = link.partition("#")
        target = (page.path.parent / path).resolve() if path else page.path
        assert target.exists(), f"{page}: there is no {link}"
        if anchor:
            assert anchor in Page(target).anchors, f"{page}: {link} has no such heading"


@pytest.mark.parametrize("page", LINKED, ids=repr)
def test_every_file_of_the_program_that_a_page_names_is_there(page: Page) -> None:
    """A test alone by its name, as it is called in the text beside its folder."""
    named = set(
        re.findall(r"\b(?:(?:bridge|tests|tools)/[a-z0-9_/]+|test_[a-z0-9_]+)\.py\b", "\n".join(page.prose))
    )
    assert {name for name in named if not _is_there(name)} == set()


def _is_there(name: str) -> bool:
    if "/" in name:
        return (REPOSITORY / name).is_file()
    return any((REPOSITORY / "tests").rglob(name))


@pytest.mark.parametrize("page", LINKED, ids=repr)
def test_every_picture_is_there_and_is_described(page: Page) -> None:
    for description, picture in re.findall(r"!\[([^\]]*)\]\(([^()\s]+)\)", "\n".join(page.prose)):
        assert (page.path.parent / picture).is_file(), f"{page}: there is no {picture}"
        assert description, f"{page}: {picture} says nothing to those who cannot see it"


def test_every_page_can_be_found_from_the_index() -> None:
    indices = [page("index.md"), page("reference/families/index.md")]
    linked = {(one.path.parent / link.partition("#")[0]).resolve() for one in indices for link in one.links}
    linked.add(indices[0].path)
    missing = [str(page) for page in RUN[1:] if page.path not in linked]
    assert not missing


@pytest.mark.parametrize("page", RUN, ids=repr)
def test_what_is_not_run_says_why(page: Page) -> None:
    for block in page.blocks:
        assert block.language in LANGUAGES, f"{page}:{block.line}: language {block.language!r}"
        reason = block.note("not run")
        assert reason != "", f"{page}:{block.line}: not run, without a reason"
        if block.language == "sh":
            assert reason or page.is_not_run, f"{page}:{block.line}: commands that run are in console blocks"


def test_the_layers_are_those_that_are_checked() -> None:
    rules = configparser.ConfigParser()
    rules.read(REPOSITORY / ".importlinter", encoding="utf-8")
    layers = rules["importlinter:contract:layers"]["layers"].split("\n")
    checked = [set(re.findall(r"\w+", layer)) for layer in layers]
    shown = page("explanation/architecture.md").column("Layers", "folder or file in bridge/")
    assert [set(cell.split(", ")) for cell in shown] == [one for one in checked if one - {"__main__"}]


# snippets


@pytest.mark.landing(18)
@pytest.mark.parametrize("page", with_blocks("json", "ini", "toml"), ids=repr)
def test_snippets_are_what_they_say(page: Page, tmp_path: Path) -> None:
    for block in page.blocks:
        where = f"{page}:{block.line}"
        if block.language == "json":
            for line in block.text.splitlines() if block.text.count("\n{") else [block.text]:
                json.loads(line)
        elif block.language == "ini":
            configparser.ConfigParser(strict=False, interpolation=None).read_string(block.text)
        elif block.language == "toml":
            source = block.note("from")
            if block.note("mapping") is not None:
                path = tmp_path / "mapping.toml"
                path.write_text(block.text, encoding="utf-8")
                read_family(path)
            elif source:
                check_quotation(block.text, REPOSITORY / source, where)
            else:
                load_fragment(block.text, tmp_path, where)


def check_quotation(text: str, source: Path, where: str) -> None:
    """Every line stands in ``source``, in this order; ``# …`` leaves lines out."""
    lines = iter(source.read_text(encoding="utf-8").splitlines())
    for line in text.splitlines():
        if line.strip() and line.strip() != "# …":
            assert line in lines, f"{where}: {line!r} is not in {source.name}"


BEFORE = (
    ("[site]", '[site]\nname = "docs"\n'),
    ("[[bus]]", '[[bus]]\nname = "can0"\ninterface = "socketcan"\nchannel = "can0"\n'),
    ("[[bus.node]]", '[[bus.node]]\nname = "conveyor"\nid = 5\nmapping = "nord/sk-tu4-cao"\n'),
    ("[[bus.node.drive]]", '[[bus.node.drive]]\nslot = "fu4"\n'),
)


def load_fragment(text: str, folder: Path, where: str) -> Site:
    """A site file, or a part of one, is one that drivebridge takes."""
    tomllib.loads(text)
    whole = text
    if "[site]" not in text:
        known = [position for position, (header, _) in enumerate(BEFORE) if header in text]
        before = BEFORE[: known[0]] if known else BEFORE
        after = BEFORE[known[-1] + 1 :] if known else ()
        whole = "\n".join([part for _, part in before] + [text] + [part for _, part in after])
        for control in set(re.findall(r'^control = "(modbus|opcua|zenoh)"', text, re.MULTILINE)):
            whole += "" if f"[{control}]" in text else f"\n[{control}]\n"
    path = folder / f"{where.replace('/', '-')}.toml"
    path.write_text(whole, encoding="utf-8")
    return load_site(path)
