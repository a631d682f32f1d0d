"""The documentation as a test sees it: pages, their code blocks, their tables; and facts of models.

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
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from tests.support.process import REPOSITORY

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
        """What follows ``name`` in a comment above the block, or None where there is no such comment."""
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
    """What matches an output (as ``squeezed`` gives it) that is as expected."""
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


# facts of models


@dataclass(frozen=True, slots=True)
class KeyFacts:
    """One key of a file, as the pages show it."""

    type: str
    default: str
    allowed: str


def model_tables(model: type[BaseModel], leaves: tuple[type, ...] = ()) -> dict[str, dict[str, KeyFacts]]:
    """Every TOML table of ``model`` by its header, with its keys. ``leaves`` are models written as text."""
    found: dict[str, dict[str, KeyFacts]] = {}
    _walk(model, "", found, leaves)
    return found


def _walk(
    model: type[BaseModel], path: str, found: dict[str, dict[str, KeyFacts]], leaves: tuple[type, ...]
) -> None:
    for name, info in model.model_fields.items():
        key = f"{path}.{name}" if path else name
        inner, is_list = _inner_model(info.annotation, leaves)
        if inner is None:
            header = path
            found.setdefault(header, {})[name] = _facts(info)
        else:
            _walk(inner, key, found, leaves)
            header = f"[[{key}]]" if is_list else f"[{key}]"
            found[header] = found.pop(key)


def _inner_model(annotation: Any, leaves: tuple[type, ...]) -> tuple[type[BaseModel] | None, bool]:
    if annotation in leaves:
        return None, False
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation, False
    for argument in get_args(annotation):
        inner, is_list = _inner_model(argument, leaves)
        if inner:
            return inner, is_list or get_origin(annotation) is list
    return None, False


def _facts(info: FieldInfo) -> KeyFacts:
    kinds, allowed = _kinds(info.annotation)
    bounds = _bounds(info.metadata) or allowed
    if info.is_required():
        default = "required"
    else:
        value = info.get_default(call_default_factory=True)
        default = "–" if value is None or value is PydanticUndefined else toml_value(value)
    return KeyFacts(kinds, default, bounds)


def _kinds(annotation: Any) -> tuple[str, str]:
    """Type and allowed values in words."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        kind, allowed = _kinds(arguments[0])
        metadata = [m for a in arguments[1:] for m in (a.metadata if isinstance(a, FieldInfo) else [a])]
        return kind, _bounds(metadata) or allowed
    if origin in (Union, UnionType):
        kinds = [_kinds(argument) for argument in arguments if argument is not type(None)]
        return (" or ".join(kind for kind, _ in kinds), "") if len(kinds) > 1 else kinds[0]
    if origin is Literal:
        return "string", ", ".join(f'"{value}"' for value in arguments)
    if origin is list:
        inner = _kinds(arguments[0])[0]
        plural = inner.replace("list of", "lists of") if inner.startswith("list of") else f"{inner}s"
        return f"list of {plural}", ""
    if origin is dict:
        return f"table of {_kinds(arguments[1])[0]}s", ""
    if isinstance(annotation, type) and issubclass(annotation, Enum):
        return "string", ", ".join(f'"{member.value}"' for member in annotation)
    names = {str: "string", int: "integer", float: "number", bool: "boolean"}
    return names.get(annotation, "object"), ""


def _bounds(metadata: list[Any]) -> str:
    low = high = None
    for item in metadata:
        low = getattr(item, "ge", low)
        high = getattr(item, "le", high)
        if (above := getattr(item, "gt", None)) is not None:
            return f"above {above}"
    if low is None:
        return ""
    return f"{low}…{high}" if high is not None else f"from {low}"


def toml_value(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return f"[{', '.join(toml_value(item) for item in value)}]"  # pyright: ignore[reportUnknownVariableType]
    if isinstance(value, Mapping):
        return "{}"
    return str(value)
