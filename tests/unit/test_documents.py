"""Every document that is cited is on the page of documents, with its edition."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from tests.support.docs import page
from tests.support.process import REPOSITORY

CITED = re.compile(
    r"\b(?:CiA \d{3}(?:-\d)?|DS-\d{3}|BU \d{4}|ID 44\d{4}|EDS84\w+|OPC 10000-\d+|RFC \d+"
    r"|(?:IEC|EN) \d{5}(?:-\d+)*|ISO 11898-\d|MODBUS Application Protocol|MODBUS Messaging on TCP/IP"
    r"|UNECE Recommendation \d+)(?!\w)(?P<section>[ ,.\d(de-]*§)?"
)
PART = re.compile(r"\bPart (\d+)(?= §)")
SOURCES = ("bridge/**/*.py", "bridge/**/*.toml", "mappings/**/*.toml", "tools/**/*.py", "docs/**/*.md")
TESTS = tuple(f"tests/{folder}/**/*.py" for folder in ("unit", "wire", "lab", "support", "proof", "fuzz"))
ITSELF = ("docs/reference/documents.md", "tests/unit/test_documents.py")
IN_NAMES = {"DS-402"}  # of a NORD family: what BU 2500 calls CiA 402


def citations(*patterns: str) -> Iterator[tuple[str, bool, str]]:
    """Document, whether a section of it is named, and where."""
    for pattern in patterns:
        for path in sorted(REPOSITORY.glob(pattern)):
            where = path.relative_to(REPOSITORY).as_posix()
            if where not in ITSELF and "node_modules" not in where:
                text = PART.sub(r"OPC 10000-\1", read(path))
                for match in CITED.finditer(text):
                    section = match["section"] or ""
                    yield match[0].removesuffix(section), bool(section), where


def read(path: Path) -> str:
    """Text of a file as one line: a citation may be broken."""
    return re.sub(r"\s*\n\s*#?\s*", " ", path.read_text(encoding="utf-8"))


def editions() -> dict[str, str]:
    reference = page("reference/documents.md")
    return {
        document: row["edition"]
        for heading in reference.headings[1:]
        for row in reference.table(heading)
        for document in row["cited as"].split(", ")
    }


def test_every_cited_document_is_on_the_page() -> None:
    known = editions().keys() | IN_NAMES
    missing = {(cited, where) for cited, _, where in citations(*SOURCES, *TESTS) if cited not in known}
    assert not missing


def test_every_document_on_the_page_is_cited() -> None:
    assert editions().keys() - {cited for cited, _, _ in citations(*SOURCES)} == set()


def test_sections_are_those_of_a_known_edition() -> None:
    found = {(cited, where) for cited, section, where in citations(*SOURCES, *TESTS) if section}
    assert len(found) > 100, "the test finds them"
    unknown = {document for document, edition in editions().items() if edition.startswith("not known")}
    assert unknown, "a document cited without sections is one of those that this test is about"
    assert not {(cited, where) for cited, where in found if cited in unknown}
