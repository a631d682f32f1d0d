"""Write docs/reference/assurance-case.md from ``case.toml``.

.venv/bin/python -m tools.assurance
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import Final

from tools.assurance.case import PROMISES, ROOT, Case, Requirement, load, paragraphs
from tools.marks import replaced

PAGE: Final = ROOT / "docs" / "reference" / "assurance-case.md"
_CHAIN: Final = "../explanation/dead-man-chain.md"
BEGIN: Final = "<!-- drawn by tools/assurance: begin -->"
END: Final = "<!-- drawn by tools/assurance: end -->"


def drawing(case: Case) -> str:
    """What stands between the marks of the page."""
    parts = ["## Promises", *_promises(case.requirements)]
    parts += ["## Assumptions", "They are requirements on the plant, the machine and its operator."]
    parts.append(
        _table(
            ("", "has to hold", "seen by", "otherwise"),
            ((f"**{one.id}**", one.holds, one.seen_by, one.otherwise) for one in case.assumptions),
        )
    )
    parts += ["## What can fail", "Element by element: who finds it, within which time, and what follows."]
    parts.append(
        _table(
            ("element", "fails", "found by", "within", "what follows", "promises"),
            (
                (one.element, one.fails, one.found_by, one.within, one.follows, ", ".join(one.requirements))
                for one in case.failures
            ),
        )
    )
    parts += [
        "## Common causes of bridge and witness",
        f"[The witness]({_CHAIN}#the-witness) is to find what the bridge does wrong. What could hit both:",
        _table(("cause", "what is done"), ((one.cause, one.done) for one in case.common_causes)),
    ]
    return "\n\n".join(parts)


def _promises(requirements: Sequence[Requirement]) -> Iterable[str]:
    """Headings and tables, in the order of the page."""
    text = PROMISES.read_text(encoding="utf-8")
    headings = {one.id: _heading(one, text) for one in requirements}
    placed = sorted(requirements, key=lambda one: text.index(one.says))
    for heading, group in groupby(placed, key=lambda one: headings[one.id]):
        yield f"### {heading}"
        yield _table(
            ("", "promise", "shown by"), ([f"**{one.id}**", _quote(one), _evidence(one)] for one in group)
        )


def _heading(requirement: Requirement, text: str) -> str:
    return next(one.heading for one in paragraphs(text) if requirement.says in one.text)


def _quote(requirement: Requirement) -> str:
    """The words of the page, with links from here; the cells of a row one after the other."""
    says = requirement.says.removeprefix("- ")
    cells = [cell.strip() for cell in says.split("|") if cell.strip()]
    return " · ".join(cells).replace("](#", f"]({_CHAIN}#")


def _evidence(requirement: Requirement) -> str:
    kinds = (
        ("table", requirement.rows),
        ("test", [_test(one) for one in requirement.tests]),
        ("proof", requirement.faults),
        ("mutant", requirement.mutants),
        ("oracle", requirement.rules),
    )
    return "<br>".join(f"{kind}: {'; '.join(named)}" for kind, named in kinds if named)


def _test(name: str) -> str:
    file, _, test = name.partition("::")
    return f"`{file}` {test.replace('_', ' ')}"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


if __name__ == "__main__":
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(replaced(page, BEGIN, END, drawing(load())), encoding="utf-8")
