"""The assurance case as data: what the dead-man page promises, what shows it, and what it rests on."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

ROOT: Final = Path(__file__).resolve().parents[2]
SOURCE: Final = Path(__file__).with_name("case.toml")
PROMISES: Final = ROOT / "docs" / "explanation" / "dead-man-chain.md"


@dataclass(frozen=True, slots=True)
class Requirement:
    """One promise of the page, ``says`` in its words. ``rows`` are events of the leg's table, ``tests`` are
    ``file::test`` below ``tests`` without ``.py`` and ``test_``, ``faults`` those of the proof, ``mutants``
    of ``tests/proof/mutants.toml``, ``rules`` of the oracle of plants in a seed."""

    id: str
    says: str
    tests: list[str]
    rows: list[str] = field(default_factory=list[str])
    faults: list[str] = field(default_factory=list[str])
    mutants: list[str] = field(default_factory=list[str])
    rules: list[str] = field(default_factory=list[str])


@dataclass(frozen=True, slots=True)
class Assumption:
    """What the times rest on: who sees whether it holds, and what is so where it does not."""

    id: str
    holds: str
    seen_by: str
    otherwise: str


@dataclass(frozen=True, slots=True)
class Failure:
    """One way in which an element fails, with the ids of the requirements about it."""

    element: str
    fails: str
    found_by: str
    within: str
    follows: str
    requirements: list[str]


@dataclass(frozen=True, slots=True)
class CommonCause:
    """What could hit bridge and witness alike, and what is done about it."""

    cause: str
    done: str


@dataclass(frozen=True, slots=True)
class Case:
    """``explains`` has the beginnings of paragraphs that promise nothing by themselves."""

    requirements: list[Requirement]
    assumptions: list[Assumption]
    failures: list[Failure]
    common_causes: list[CommonCause]
    explains: list[str]


@dataclass(frozen=True, slots=True)
class Paragraph:
    """A paragraph, item of a list or table of the page, below this heading."""

    heading: str
    text: str


def load() -> Case:
    """The case of ``case.toml``. Raises TypeError where an entry lacks a key, or has an unknown one."""
    content: dict[str, Any] = tomllib.loads(SOURCE.read_text(encoding="utf-8"))
    return Case(
        [Requirement(**one) for one in content["requirement"]],
        [Assumption(**one) for one in content["assumption"]],
        [Failure(**one) for one in content["failure"]],
        [CommonCause(**one) for one in content["common_cause"]],
        content["explains"]["begins"],
    )


def paragraphs(page: str) -> Iterator[Paragraph]:
    """The paragraphs of a page in its order; blocks of code are left out."""
    heading, lines, is_code = "", list[str](), False
    for line in [*page.splitlines(), ""]:
        is_item = line.startswith("- ") or line[:3] in {f"{n}. " for n in range(10)}
        if lines and (is_item or not line or line.startswith(("#", "```"))):
            yield Paragraph(heading, "\n".join(lines))
            lines = []
        if line.startswith("```"):
            is_code = not is_code
        elif line.startswith("#"):
            heading = line.lstrip("# ")
        elif line and not is_code:
            lines.append(line)
