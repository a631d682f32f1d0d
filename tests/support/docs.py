"""The documentation as a test sees it: pages, their code blocks, their tables.

A console block holds commands (``$ ``, continued by ``> ``) with the output that is expected below each
(``…`` stands for anything, alone on its line for any lines). Comments directly above a block say how it
is to be taken:

``<!-- not run: reason -->``    not at all; with "on this page" for all console and sh blocks of a page
``<!-- stays up -->``           its one command runs on until the page has been worked through
``<!-- Ctrl-C -->``             what was started last is ended first
``<!-- from PATH -->``          the block is quoted from that file of the repository
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from tests.support.process import REPOSITORY

DOCS = REPOSITORY / "docs"
_FENCE = re.compile(r"^( *)```(\S*)\s*$")
_COMMENT = re.compile(r"^\s*<!--\s*(.*?)\s*-->\s*$")
_HEADING = re.compile(r"^(#+) (.*)$")
_LINK = re.compile(r"(?<!!)\[[^\]]*\]\(([^()\s]+)\)")


@dataclass(frozen=True, slots=True)
class Block:
    """``line`` is that of the opening fence; ``notes`` are the comments directly above it."""

    line: int
    language: str
    text: str
    notes: tuple[str, ...] = ()

    def note(self, name: str) -> str | None:
        """Text behind ``name`` in a comment above the block, or None where there is no such comment."""
        for note in self.notes:
            if note == name or note.startswith((f"{name}:", f"{name} ")):
                return note[len(name) :].strip(": ")
        return None

    @property
    def file_name(self) -> str | None:
        """The name in a first line such as ``# site.toml``: the reader saves the block under it."""
        match = re.match(r"# ([\w-]+\.(?:py|toml))\n", self.text)
        return match[1] if match else None


@dataclass(frozen=True, slots=True)
class Command:
    """``expected`` is what the page shows as its output; empty where it shows nothing."""

    line: int
    text: str
    expected: str


class Page:
    def __init__(self, path: Path) -> None:
        self.path = path
        self.name = str(path.relative_to(REPOSITORY))
        self.text = path.read_text(encoding="utf-8")
        self.lines = self.text.splitlines()

    def __repr__(self) -> str:
        return self.name

    @cached_property
    def blocks(self) -> list[Block]:
        return list(self._blocks())

    def _blocks(self) -> Iterator[Block]:
        notes: list[str] = []
        start, indent, language, inside = 0, "", "", False
        body: list[str] = []
        for number, line in enumerate(self.lines, 1):
            fence = _FENCE.match(line)
            if inside:
                if fence and not fence[2]:
                    yield Block(start, language, "".join(f"{text}\n" for text in body), tuple(notes))
                    inside, notes = False, []
                else:
                    body.append(line.removeprefix(indent))
            elif fence:
                start, indent, language, inside, body = number, fence[1], fence[2], True, []
            elif comment := _COMMENT.match(line):
                notes.append(comment[1])
            else:
                notes = []

    @property
    def is_not_run(self) -> bool:
        return any(
            (note := _COMMENT.match(line)) and note[1].startswith("not run on this page: ")
            for line in self.lines
        )

    @cached_property
    def prose(self) -> list[str]:
        """The lines of the page, empty where they belong to a code block."""
        lines = list(self.lines)
        for block in self.blocks:
            end = block.line + block.text.count("\n") + 1
            lines[block.line - 1 : end] = [""] * (end - block.line + 1)
        return lines

    @property
    def links(self) -> list[str]:
        return [link for link in _LINK.findall("\n".join(self.prose)) if "://" not in link]

    @property
    def anchors(self) -> set[str]:
        return {slug(heading) for heading in self.headings}

    @cached_property
    def headings(self) -> list[str]:
        return [match[2] for line in self.prose if (match := _HEADING.match(line))]

    def table(self, heading: str) -> list[dict[str, str]]:
        """The first table below ``heading`` as rows by column; backticks are taken away."""
        lines = self.section(heading)
        begin = next((number for number, line in enumerate(lines) if line.startswith("|")), None)
        assert begin is not None, f"{self}: no table below {heading!r}"
        columns = _cells(lines[begin])
        rows: list[dict[str, str]] = []
        for line in lines[begin + 2 :]:
            if not line.startswith("|"):
                break
            rows.append(dict(zip(columns, _cells(line), strict=True)))
        return rows

    def column(self, heading: str, name: str) -> list[str]:
        return [row[name] for row in self.table(heading)]

    def section(self, heading: str) -> list[str]:
        """The lines between ``heading`` and the next one, without code blocks."""
        found: list[str] | None = None
        for line in self.prose:
            match = _HEADING.match(line)
            if match and found is not None:
                break
            if match and match[2] == heading:
                found = []
            elif found is not None:
                found.append(line)
        assert found is not None, f"{self} has no heading {heading!r}"
        return found


def _cells(line: str) -> list[str]:
    cells = re.split(r"(?<!\\)\|", line.strip().strip("|"))
    return [cell.replace("\\|", "|").replace("`", "").strip() for cell in cells]


def slug(heading: str) -> str:
    """The anchor that a Markdown renderer makes of a heading."""
    text = re.sub(r"[^\w\- ]", "", heading.lower())
    return text.replace(" ", "-")


def commands(block: Block) -> Iterator[Command]:
    """The commands of a console block."""
    text, expected, line = "", [], 0
    for number, content in enumerate(block.text.splitlines(), block.line + 1):
        if content.startswith("$ "):
            if text:
                yield Command(line, text, "\n".join(expected))
            text, expected, line = content[2:], [], number
        elif content.startswith("> ") and not expected:
            text += f"\n{content[2:]}"
        else:
            assert text, f"line {number}: a console block begins with a command"
            expected.append(content)
    if text:
        yield Command(line, text, "\n".join(expected))


def output_pattern(expected: str) -> re.Pattern[str]:
    """Pattern of the outputs (as ``squeezed`` gives them) that are as expected."""
    parts: list[str] = []
    for line in squeezed(expected).splitlines():
        if line == "…":
            parts.append(r"(?:.*\n)*?")
        else:
            parts.append(".*?".join(re.escape(part) for part in line.split("…")) + r"\n")
    return re.compile("".join(parts))


def squeezed(text: str) -> str:
    """``text`` without empty lines, with single spaces: how wide a column is does not matter."""
    lines = (" ".join(line.split()) for line in text.splitlines())
    return "".join(f"{line}\n" for line in lines if line)


RUN = [Page(path) for path in (REPOSITORY / "README.md", *sorted(DOCS.rglob("*.md")))]
LINKED = [*RUN, *(Page(REPOSITORY / name) for name in ("CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"))]


def page(name: str) -> Page:
    return Page(DOCS / name)


def with_blocks(*languages: str) -> list[Page]:
    return [page for page in RUN if any(block.language in languages for block in page.blocks)]
