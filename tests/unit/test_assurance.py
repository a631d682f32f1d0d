"""The assurance case is about what there is, and about all that the dead-man page promises."""

from __future__ import annotations

import re
import tomllib

from bridge.command.leg.table import Stimulus
from tests.proof.faults import FAULTS
from tests.support.process import REPOSITORY
from tools.assurance.__main__ import BEGIN, END, PAGE, drawing
from tools.assurance.case import PROMISES, load, paragraphs
from tools.marks import replaced

CASE = load()
TEXT = PROMISES.read_text(encoding="utf-8")
CERTIFIED = re.compile(r"\b(SIL|PLr?|safe|safety|certified)\b", re.I)


def test_the_page_is_up_to_date() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert page == replaced(page, BEGIN, END, drawing(CASE)), "run python -m tools.assurance"


def test_each_promise_stands_on_the_page_once_and_has_a_number_of_its_own() -> None:
    counts = {one.id: TEXT.count(one.says) for one in CASE.requirements}
    assert {name: count for name, count in counts.items() if count != 1} == {}
    assert len(counts) == len(CASE.requirements)


def test_no_paragraph_of_the_page_is_left_out() -> None:
    left = [
        one.text[:80]
        for one in paragraphs(TEXT)
        if not any(requirement.says in one.text for requirement in CASE.requirements)
    ]
    assert [text for text in left if not text.startswith(tuple(CASE.explains))] == []
    assert [begin for begin in CASE.explains if not any(text.startswith(begin) for text in left)] == []


def test_each_promise_is_shown_by_tests_that_there_are() -> None:
    assert [one.id for one in CASE.requirements if not one.tests] == []
    named = {test for one in CASE.requirements for test in one.tests}
    missing: list[str] = []
    for name in sorted(named):
        file, _, test = name.partition("::")
        path = REPOSITORY / "tests" / f"{file}.py"
        if not path.is_file() or f"def test_{test}(" not in path.read_text(encoding="utf-8"):
            missing.append(name)
    assert missing == []


def test_rows_faults_mutants_and_rules_are_there() -> None:
    assert {row for one in CASE.requirements for row in one.rows} <= {one.value for one in Stimulus}
    mutants = tomllib.loads((REPOSITORY / "tests/proof/mutants.toml").read_text(encoding="utf-8"))["mutant"]
    assert {name for one in CASE.requirements for name in one.mutants} == {one["name"] for one in mutants}
    assert {name for one in CASE.requirements for name in one.faults} == {one.name for one in FAULTS}
    oracle = (REPOSITORY / "docs/explanation/plant-in-a-seed.md").read_text(encoding="utf-8")
    rules = set(re.findall(r"^\| ([a-z][a-z ]+) \|", oracle.partition("## Who judges")[2], re.M))
    of_harness = {"rule", "nothing fails", "one answer"}
    assert {name for one in CASE.requirements for name in one.rules} == rules - of_harness


def test_what_can_fail_is_answered_by_promises() -> None:
    ids = {one.id for one in CASE.requirements}
    assert {name for one in CASE.failures for name in one.requirements} <= ids
    elements = [one.element for one in CASE.failures]
    assert {"controller", "network", "bus process", "kernel", "node", "drive", "witness"} <= set(elements)


def test_it_claims_no_level_and_no_certificate() -> None:
    said = [one.says for one in CASE.requirements]
    said += [text for one in CASE.assumptions for text in (one.holds, one.seen_by, one.otherwise)]
    said += [text for one in CASE.failures for text in (one.fails, one.found_by, one.within, one.follows)]
    assert [text for text in said if CERTIFIED.search(text)] == []
